// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "model/bsdf.h"
#include "render/lanes/lane_lights.h"
#include "render/lanes/lane_textures.h"
#include "render/path/dimension.h"

namespace selenite {

/// Evaluates and samples the bsdfs of all surface points that the paths of a tracer have met, eight at
/// a time. Those eight lie on the same side of the same material, whatever packets they come from: its
/// parameters are plain numbers to them, and branches on these are branches.
template <int L>
class LaneShading {
 public:
  using Paths = LanePaths<L>;
  using Vertices = LaneVertices<L>;

  static constexpr int kMostPackets = 16;

  explicit LaneShading(const Prepared<L>& prepared) : p_(prepared) {
    for (const PreparedMaterial<L>& m : p_.materials) {
      kinds_.push_back(kind_of(m));
      const Color<PathScalar<L>> white(PathScalar<L>(1));
      whites_.push_back(m.values);
      whites_.back().base_color = white;
      plain_whites_.push_back(m.plain_values);
      plain_whites_.back().base_color = Colorf(1);
    }
  }

  /// What the vertices' materials are.
  void classify(Vertices& v) const {
    for (LaneMask left = v.met; any(left);) {
      const int index = v.material[std::countr_zero(left.bits())];
      const LaneMask lanes = left & (v.material == index);
      left &= !lanes;
      if (p_.materials[index].has_medium) v.medium |= lanes;
      if (p_.materials[index].sealed) v.sealed |= lanes;
      if (kinds_[index].all_singular) v.dim |= lanes;
      if (kinds_[index].opaque) v.opaque |= lanes;
    }
  }

  /// Of all packets.
  void shade(std::vector<Vertices>& vertices) const {
    const int count = static_cast<int>(vertices.size());
    LaneMask left[kMostPackets];
    for (int i = 0; i < count; ++i) left[i] = vertices[i].met;
    for (int i = 0; i < count; ++i)
      while (any(left[i])) {
        const int first = std::countr_zero(left[i].bits());
        const int material = vertices[i].material[first];
        const bool back = vertices[i].back[first];
        Batch batch;
        for (int j = i; j < count; ++j) {
          const Vertices& v = vertices[j];
          const LaneMask same = left[j] & (v.material == material) & (back ? v.back : !v.back);
          left[j] &= !same;
          for_each_lane(same, [&](int lane) {
            batch.at[batch.size++] = {j, lane};
            if (batch.size < kLanes) return;
            shade(batch, p_.materials[material], back, vertices);
            batch.size = 0;
          });
        }
        if (batch.size > 0) shade(batch, p_.materials[material], back, vertices);
      }
  }

  /// The radiance takes what comes from the sampled lights.
  void bring(const LaneLights<L>& lights, const Vertices& v, Paths& paths) const {
    const LaneLightSamples& s = v.lights;
    if (!any(s.lit)) return;
    const Lanes weight = select(s.delta, Lanes(1), power_heuristic(s.heuristic, v.value_density));
    const Color<Lanes> w = masked(s.lit, s.shape * (weight / s.density), 0);
    const Color<Lanes> fw = w * masked(s.lit, value_of(v.value), 0);
    Color<Lanes> e(Lanes(0));
    for (LaneMask left = s.lit; any(left);) {
      const int source = s.source[std::countr_zero(left.bits())];
      const LaneMask lanes = left & (s.source == source);
      left &= !lanes;
      const Factor<L>& emitted = lights.emitted(source);
      e += masked(lanes, lanes_of(emitted.value), 0);
      if (emitted.count > 0)
        paths.radiance.add_slopes(emitted, masked(lanes, paths.beta.value * fw, 0));
    }
    paths.radiance.add(paths.beta, fw * e);
    const Color<Lanes> others = paths.beta.value * (w * e);
    for_each_ticked(s.lit, v, [&](const LaneMask& lanes, const PreparedMaterial<L>& material) {
      paths.radiance.add_slopes(lanes, material, others, v.value);
    });
  }

  /// The throughput takes the weights of the sampled directions.
  void attenuate(const Vertices& v, Paths& paths) const {
    const Color<Lanes> before = paths.beta.value;
    paths.beta.multiply(v.goes, value_of(v.weight));
    for_each_ticked(v.goes, v, [&](const LaneMask& lanes, const PreparedMaterial<L>& material) {
      paths.beta.add_slopes(lanes, material, before, v.weight);
    });
  }

 private:
  /// What of a material decides whether light is looked for.
  struct Kind {
    bool all_singular;  ///< from either side
    bool opaque;        ///< no light comes through
  };
  static Kind kind_of(const PreparedMaterial<L>& m) {
    const auto& transmission = m.values.transmission;
    Kind kind{true, value_of(transmission) == 0 && !has_slope(transmission)};
    for (const bool back : {false, true}) {
      const Vec3f up{0, 0, 1};
      const PrincipledBsdf<PathScalar<L>> bsdf(m.values, m.flavour,
                                               SurfacePoint<float>{up, up, up, back});
      kind.all_singular = kind.all_singular && bsdf.all_singular();
    }
    return kind;
  }

  struct Place {
    int packet, lane;
  };
  /// Surface points that are shaded together.
  struct Batch {
    Place at[kLanes];
    int size = 0;
    LaneMask active() const {
      LaneMask mask(false);
      for (int i = 0; i < size; ++i) mask.set(i, true);
      return mask;
    }
  };
  /// Moves between the lanes of a batch and those of the packets that its points come from.
  class Exchange {
   public:
    Exchange(const Batch& batch, std::vector<Vertices>& vertices)
        : batch_(batch), vertices_(vertices) {
      constexpr int kStride = sizeof(Vertices) / sizeof(Lanes) * kLanes;  // in numbers
      for (int i = 0; i < kLanes; ++i) {
        const auto [packet, lane] = batch.at[i < batch.size ? i : 0];
        index_.set(i, packet * kStride + lane);
      }
    }
    /// `in_first`: a member of the first packet's vertices. Lanes that are left over repeat the first.
    Lanes take(const Lanes& in_first) const {
      return gather(reinterpret_cast<const float*>(&in_first), index_);
    }
    Vec3<Lanes> take(const Vec3<Lanes>& in_first) const {
      return {take(in_first.x), take(in_first.y), take(in_first.z)};
    }
    /// `member(vertices)` of the packets takes x, which is made of lanes.
    template <class X, class Member>
    void put(const X& x, Member&& member) const {
      constexpr int kNumbers = sizeof(X) / sizeof(Lanes);  // NOLINT(bugprone-sizeof-expression)
      const float* from = reinterpret_cast<const float*>(&x);
      for (int i = 0; i < batch_.size; ++i) {
        const auto [packet, lane] = batch_.at[i];
        X& field = member(vertices_[packet]);
        float* to = reinterpret_cast<float*>(&field) + lane;
        for (int k = 0; k < kNumbers; ++k) to[k * kLanes] = from[k * kLanes + i];
      }
    }
    /// Numbers without derivatives, of a material where nothing is ticked.
    template <class Member>
    void put_color(const Color<Lanes>& x, Member&& member) const {
      for (int c = 0; c < 3; ++c)
        put(x[c], [&](Vertices& v) -> Lanes& {
          if constexpr (L == 0)
            return member(v)[c];
          else
            return member(v)[c].v;
        });
    }
    template <class Member>
    void put_color(const Color<LaneScalar<L>>& x, Member&& member) const requires(L > 0) {
      put(x, member);
    }

   private:
    const Batch& batch_;
    std::vector<Vertices>& vertices_;
    LaneInts index_;
  };

  void shade(const Batch& batch, const PreparedMaterial<L>& material, bool back,
             std::vector<Vertices>& vertices) const {
    if (!material.maps->empty())
      shade_coloured(batch, material, back, vertices);
    else if (material.plain)
      shade<Lanes>(batch, material.plain_values, material.flavour, back, vertices);
    else
      shade<LaneScalar<L>>(batch, material.values, material.flavour, back, vertices);
  }

  /// Points of a material whose images colour its diffuse lobe.
  void shade_coloured(const Batch& batch, const PreparedMaterial<L>& material, bool back,
                      std::vector<Vertices>& vertices) const {
    Color<Lanes> color(Lanes(1));
    for (int i = 0; i < batch.size; ++i) {
      const auto [packet, lane] = batch.at[i];
      const HitPacket& hits = vertices[packet].hits;
      const Hit hit{hits.instance[lane], hits.triangle[lane], hits.b1[lane], hits.b2[lane],
                    hits.t[lane]};
      const Colorf found =
          mapped_color(material.maps->back(), p_.geometry, p_.scene.appearance.mesh_colors, hit);
      for (int c = 0; c < 3; ++c) color[c].set(i, clamp01(found[c]));
    }
    const auto index = static_cast<std::size_t>(&material - p_.materials.data());
    const Flavour& flavour = material.flavour;
    const auto with = [&]<class X>(const auto& white, std::type_identity<X>) {
      const auto bsdf_at = [&](const SurfacePoint<Lanes>& point) {
        const auto layers = [&](const Lanes& cos_i) -> Layers<X> {
          return ColouredLayers<X>(white, flavour, point, cos_i, batch.active(), color);
        };
        return PrincipledBsdf<X>(layers, flavour, point, batch.active());
      };
      scatter<X>(batch, back, vertices, bsdf_at);
    };
    if (L > 0 && material.count == 0)
      with(plain_whites_[index], std::type_identity<Lanes>());
    else
      with(whites_[index], std::type_identity<LaneScalar<L>>());
  }

  template <class X, class U>
  void shade(const Batch& batch, const Principled<U>& values, const Flavour& flavour, bool back,
             std::vector<Vertices>& vertices) const {
    scatter<X>(batch, back, vertices, [&](const SurfacePoint<Lanes>& point) {
      return PrincipledBsdf<X>(values, flavour, point, batch.active());
    });
  }

  template <class X, class BsdfAt>
  void scatter(const Batch& batch, bool back, std::vector<Vertices>& vertices,
               const BsdfAt& bsdf_at) const {
    const Exchange exchange(batch, vertices);
    const Vertices& first = vertices[0];
    const Vec3<Lanes> ng = exchange.take(first.ng), n = exchange.take(first.n);
    const PrincipledBsdf<X> bsdf =
        bsdf_at({back ? -ng : ng, back ? -n : n, -exchange.take(first.direction), back});
    bool lit = false;
    for (int i = 0; i < batch.size; ++i)
      lit = lit || vertices[batch.at[i].packet].lights.lit[batch.at[i].lane];
    if (lit) {
      Color<X> value;
      Lanes density;
      bsdf.value_and_density(exchange.take(first.lights.direction), value, density);
      exchange.put_color(
          value, [](Vertices & v) -> auto& { return v.value; });
      exchange.put(
          density, [](Vertices & v) -> auto& { return v.value_density; });
    }
    const BsdfSample<X> sample =
        bsdf.draw(exchange.take(first.u[0]), exchange.take(first.u[1]), exchange.take(first.u[2]));
    for (int i = 0; i < batch.size; ++i) {
      const auto [packet, lane] = batch.at[i];
      Vertices& v = vertices[packet];
      v.goes.set(lane, sample.exists[i]);
      v.transmits.set(lane, sample.transmits[i]);
      v.singular.set(lane, sample.singular[i]);
    }
    exchange.put(
        sample.wo, [](Vertices & v) -> auto& { return v.wo; });
    exchange.put(
        sample.density, [](Vertices & v) -> auto& { return v.density; });
    exchange.put_color(
        sample.weight, [](Vertices & v) -> auto& { return v.weight; });
  }

  /// f(lanes, material) for each material of which something is ticked.
  template <class F>
  void for_each_ticked(const LaneMask& on, const Vertices& v, F&& f) const {
    if constexpr (L > 0)
      for (LaneMask left = on; any(left);) {
        const int index = v.material[std::countr_zero(left.bits())];
        const LaneMask lanes = left & (v.material == index);
        left &= !lanes;
        if (p_.materials[index].count > 0) f(lanes, p_.materials[index]);
      }
  }

  const Prepared<L>& p_;
  std::vector<Kind> kinds_;  ///< of the materials
  /// The values of the materials with a white base colour; `plain_whites_`: without derivatives.
  std::vector<Principled<PathScalar<L>>> whites_;
  std::vector<Principled<float>> plain_whites_;
};

}  // namespace selenite
