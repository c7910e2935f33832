// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "render/media/equiangular.h"
#include "render/media/media_stack.h"

namespace selenite {

/// Scatters light at a surface: where a shadow ray starts, and value and density of a direction.
/// Bsdf: of the Principled BSDF or of several closures.
template <int L, class X, class Bsdf = PrincipledBsdf<X>>
struct SurfaceScatterer {
  using Number = X;

  const Hit& hit;
  const Surface& surface;
  const PreparedMaterial<L>& material;
  const Bsdf& bsdf;

  int object() const { return hit.instance; }
  Vec3f origin(const Vec3f& direction) const { return surface.leave(direction); }
  void cross(MediaStack<L>& media, const Vec3f& direction) const {
    media.cross(hit, surface, direction);
  }
  /// Towards the inside of a body from where no light is seen.
  bool seals(const Vec3f& direction) const {
    return material.sealed && dot(direction, surface.ng) < 0;
  }
  bool refracts(const Vec3f& direction) const { return bsdf.transmits(direction); }
  float share(const Light&) const { return 1; }
  /// Of light that these kinds of rays see.
  void evaluate(const Vec3f& direction, RayKinds visible_to, Color<X>& value,
                float& density) const {
    if ((visible_to & kScatteredRays) == kScatteredRays)
      bsdf.value_and_density(direction, value, density);
    else
      bsdf.seen_by(visible_to).value_and_density(direction, value, density);
  }
  /// The throughput takes what is scattered to a direction of this value.
  void attenuate(const Geometry& geometry, const Color<X>& value, Throughput<L>& beta) const {
    material.attenuate(geometry, hit, value, beta);
  }
  /// The radiance takes the light that has come along `through` and is scattered by `value`.
  void bring(const Geometry& geometry, const Color<X>& value, const Factor<L>& emitted,
             float weight, Throughput<L>& through, Radiance<L>& radiance) const {
    if constexpr (is_taped(L))
      if (material.is_recorded()) {
        material.record(geometry, hit, value, through);
        return radiance.add(through, emitted, weight);
      }
    radiance.add(through, material.factor(value), emitted, weight);
  }
};
/// The same in a medium; `forward` is the way of the path.
template <int L>
struct PhaseScatterer {
  using Scalar = PathScalar<L>;
  using Number = Scalar;

  const PreparedMaterial<L>& material;
  Vec3f forward, position;
  const Ray* ray;  ///< the position was drawn on it by a free flight
  float reach;     ///< how far a flight could have gone
  typename MediaStack<L>::Flight flight;
  int medium;  ///< the object that it fills

  int object() const { return medium; }
  Vec3f origin(const Vec3f&) const { return position; }
  void cross(MediaStack<L>&, const Vec3f&) const {}
  bool seals(const Vec3f&) const { return false; }
  bool refracts(const Vec3f&) const { return false; }
  /// MIS weight of the position, which `add_lamp_along` could have drawn too.
  float share(const Light& lamp) const {
    if (!lamp.has_place()) return 1;
    const Equiangular along(ray->origin, ray->direction, reach, lamp.position);
    return power_heuristic(flight.density, along.density(flight.length));
  }
  void evaluate(const Vec3f& direction, RayKinds visible_to, Color<Scalar>& value,
                float& density) const {
    if (!(visible_to & kScatterRay)) return;
    const Scalar p = henyey_greenstein(material.values.anisotropy, dot(forward, direction));
    value = Color<Scalar>(p);
    density = value_of(p);
  }
  void attenuate(const Geometry&, const Color<Scalar>& value, Throughput<L>& beta) const {
    beta.multiply(material.factor(value));
  }
  void bring(const Geometry&, const Color<Scalar>& value, const Factor<L>& emitted, float weight,
             const Throughput<L>& through, Radiance<L>& radiance) const {
    radiance.add(through, material.factor(value), emitted, weight);
  }
};

}  // namespace selenite
