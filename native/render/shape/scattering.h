// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

#include "render/path/direct_light.h"

namespace selenite {

/// How what is scattered from wo to wi depends on both directions, channel by channel, and on the
/// place on the triangle where it has a texture.
struct ScatteringSlopes {
  Colorf value;
  std::array<Vec3f, 3> by_wi, by_wo;
  Colorf by_b1, by_b2;
};

/// By directions alone, of a sum of channels.
struct DirectionSlopes {
  Vec3f by_wi, by_wo;
  float by_b1 = 0, by_b2 = 0;

  DirectionSlopes() = default;
  /// Of the channels' values, each times its weight.
  DirectionSlopes(const ScatteringSlopes& slopes, const Colorf& weight) {
    for (int c = 0; c < 3; ++c) {
      by_wi += slopes.by_wi[c] * weight[c];
      by_wo += slopes.by_wo[c] * weight[c];
      by_b1 += slopes.by_b1[c] * weight[c];
      by_b2 += slopes.by_b2[c] * weight[c];
    }
  }
  /// By the normal: what is scattered stays the same if it turns together with both directions.
  Vec3f by_normal(const Vec3f& wi, const Vec3f& wo, const Vec3f& n) const {
    return cross(n, cross(wi, by_wi) + cross(wo, by_wo));
  }
};

/// What the surface at a hit does with light, seen from wi. Opaque parts alone have derivatives; see
/// docs/method/shape.md.
class Scattering {
 public:
  Scattering(const Prepared<0>& prepared, const CameraPlace& camera, const Hit& hit,
             const Vec3f& wi, const PathFacts& facts, bool after_diffuse)
      : p_(prepared),
        camera_(camera),
        facts_(facts),
        after_diffuse_(after_diffuse),
        hit(hit),
        surface(prepared.geometry.surface(hit)),
        wi(wi) {}

  const PreparedMaterial<0>& material() const { return p_.materials[surface.material]; }
  /// Whether values vary over the surface.
  bool varies() const { return material().shader || !material().maps->empty(); }
  /// `action(bsdf)` for what is at another place, or seen from elsewhere.
  template <class Action>
  auto with_bsdf(const Hit& at, const Surface& s, const Vec3f& viewer, Action&& action) const {
    const PreparedMaterial<0>& m = p_.materials[s.material];
    if (m.shader) {
      ShadingPoint point;
      point.geometry = &p_.geometry;
      point.hit = at;
      point.surface = s;
      point.wi = viewer;
      point.camera = &camera_;
      point.path = facts_;
      return action(m.shader->bsdf(point, after_diffuse_, room_));
    }
    typename PreparedMaterial<0>::Room room;
    return action(PrincipledBsdf<float>(m.at(p_.geometry, at, room), m.flavour,
                                        DirectLight<0>::point(s, viewer, after_diffuse_)));
  }

  /// `action(bsdf)`.
  template <class Action>
  auto with_bsdf(Action&& action) const {
    return with_bsdf(hit, surface, wi, action);
  }
  Colorf value(const Vec3f& wo) const {
    return with_bsdf([&](const auto& bsdf) { return bsdf.value(wo); });
  }
  /// By differences: what a closure and its shader compute is smooth on the scale of the step.
  ScatteringSlopes slopes(const Vec3f& wo) const;
  /// The shading normal on the viewer's side is this times that of the surface.
  float side() const { return dot(surface.ng, wi) < 0 ? -1.0f : 1.0f; }

 private:
  const Prepared<0>& p_;
  const CameraPlace& camera_;
  PathFacts facts_;
  bool after_diffuse_;
  mutable ShaderRoom<float> room_;

 public:
  const Hit hit;
  const Surface surface;
  const Vec3f wi;
};

}  // namespace selenite
