// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include "model/bsdf.h"
#include "render/derivatives/throughput.h"

namespace selenite {

/// float without derivatives, or a dual with L local slots.
template <int L>
using PathScalar = std::conditional_t<L == 0, float, Dual<float, L == 0 ? 1 : L>>;

/// A material with its ticked parameters seeded as independent variables.
template <int L>
struct PreparedMaterial {
  MaterialParameters<PathScalar<L>> values;
  Flavour flavour;
  /// Only reflects or refracts, the same everywhere, and nothing of it is ticked: its bsdf is
  /// evaluated without derivatives.
  bool plain = false;
  Principled<float> plain_values;
  int first = 0;  ///< slot of the layout that its first local slot is; the others follow
  int count = 0;  ///< local slots in use
  /// There is a medium behind the surface: what it scatters, and the rates at which free paths in it
  /// are drawn.
  bool has_medium = false;
  Color<PathScalar<L>> sigma_s;
  Colorf rate;
  const PlacedGrid* albedo_grid = nullptr;   ///< none: the constant
  const PlacedGrid* density_grid = nullptr;  ///< none: 1 everywhere
  Colorf typical_rate;                       ///< `rate` at a middling density, for weights
  float majorant = 0;  ///< above the rate of every channel everywhere; see GridFlight
  /// Numbers of the fields of unknowns that grids and base colour are, if they are.
  int albedo_field = -1, density_field = -1, base_color_field = -1;
  /// Of an unknown density: free paths are drawn as if it were at least `least_density`, for where
  /// it is 0 its derivative is not; a shift counts in `density_unit`.
  float least_density = 0, density_unit = 0;
  /// No light can be seen from inside of it: its surface is closed and faces outwards, lets no shadow
  /// ray pass, and every light is outside of the boxes around its objects.
  bool sealed = false;
  bool transparent = false;  ///< lets rays pass straight through (alpha below 1, or ticked)
  const std::vector<FieldMap>* maps = nullptr;
  const FieldMap* base_color_map = nullptr;  ///< of an unknown base colour
  /// Cycles samples meshes as lights from an emission of 0.5 up. Refraction must not be sampled
  /// otherwise: see `Prepared::world_density`.
  bool strong_emitter = false;
  float emitter_density = 0;  ///< per area, by which light sampling picks a point on it

  /// sigma_t at a point of the medium.
  Color<PathScalar<L>> extinction_at(const Vec3f& p) const {
    return density_grid ? values.extinction * density_grid->at(p).r : values.extinction;
  }
  Colorf rate_at(const Vec3f& p) const {
    return density_grid ? rate * std::max(density_grid->at(p).r, least_density) : rate;
  }

  /// A place for the values of one hit, left empty where they are constant.
  using Room = std::optional<Principled<PathScalar<L>>>;
  /// The values at a hit: the constants, or `room` filled from textures and vertex colours.
  const Principled<PathScalar<L>>& at(const Geometry& geometry, const Hit& hit, Room& room) const {
    if (maps->empty()) return values;
    room.emplace(values);
    for (const FieldMap& map : *maps) apply(map, geometry, hit, *room);
    return *room;
  }
  /// Whether what the surface scatters goes on the tape; see `record`.
  bool is_recorded() const { return L == kTaped && base_color_map; }
  /// The throughput takes what the surface scatters at a hit.
  template <class X>
  void attenuate(const Geometry& geometry, const Hit& hit, const Color<X>& c,
                 Throughput<L>& beta) const {
    if constexpr (L == kTaped)
      if (is_recorded()) return record(geometry, hit, c, beta);
    beta.multiply(factor(c));
  }
  template <class X>
  void record(const Geometry& geometry, const Hit& hit, const Color<X>& c,
              Throughput<L>& beta) const requires(L == kTaped) {
    const Factor<L> f = factor(c);
    const FieldSlope slope{{f.slope[0][0], f.slope[1][0], f.slope[2][0]}, base_color_field, 1};
    const Vec2f uv = base_color_map->place(geometry.uv(hit, base_color_map->attribute));
    beta.multiply_recorded(f.value, &slope, 1, {uv.x, uv.y, 0});
  }
  template <class X>
  Factor<L> factor(const Color<X>& c) const {
    Factor<L> f{value_of(c), first, 0};
    if constexpr (L > 0 && std::is_same_v<X, PathScalar<L>>) {
      f.count = count;
      for (int i = 0; i < 3; ++i) std::copy(c[i].d.begin(), c[i].d.end(), f.slope[i].begin());
    }
    return f;
  }

 private:
  void apply(const FieldMap& map, const Geometry& geometry, const Hit& hit,
             Principled<PathScalar<L>>& room) const;
};

/// Everything that one render reads, worked out once from scene and layout: seeded materials, the
/// slots of lamps and world, and the table for choosing a light.
template <int L>
class Prepared {
 public:
  /// `fields`: grids and images that are unknown; in the kernel that keeps a tape, without `layout`.
  Prepared(const Scene& scene, const SlotLayout& layout, std::span<const FieldRef> fields = {});

  const Scene& scene;
  const Geometry& geometry;
  std::vector<PreparedMaterial<L>> materials;
  PreparedMaterial<L>
      exit;  ///< white and Lambertian: where light leaves after subsurface scattering
  int slots;
  int slot_room = 0;  ///< that many with what is added behind the last one
  /// How much a derivative counts beside the value when Russian roulette decides. Measured: a tenth
  /// gives the least variance times time; more keeps paths for derivatives that few of them feel.
  SlotScales roulette_scales{};
  bool any_transparent = false, any_medium = false;

  /// Radiance (delta lamp: irradiance) of a lamp or the world for its shape's factor.
  Factor<L> lamp(int light, float shape) const {
    const LightParameters& p = scene.appearance.lights[light].values;
    return product(p.color, p.power, Colorf(shape), lamp_slots_[light]);
  }
  Factor<L> world(const Colorf& shape) const {
    const WorldParameters& p = scene.appearance.world.values;
    return product(p.color, p.strength, shape, world_slots_);
  }

  enum class Source { kNone, kLamp, kMesh, kWorld };
  struct Choice {
    Source source = Source::kNone;
    int index = 0;
    float probability = 0;
  };
  /// Picks a light; `u` in [0, 1).
  Choice choose(float u) const;
  /// Of choosing a lamp (its index), emissive meshes or the world. `refracted`: as Cycles chooses,
  /// which leaves weak emissive meshes out; see `world_density`.
  float probability(int source, bool refracted = false) const {
    return (refracted ? cycles_probability_ : probability_)[source];
  }
  int mesh_source() const { return static_cast<int>(scene.appearance.lights.size()); }
  int world_source() const { return mesh_source() + 1; }

  // Densities per solid angle by which light sampling would have chosen a direction. They are for the
  // weights of multiple importance sampling, and whatever they are, the weights of both strategies
  // add up to 1. But refraction that only light sampling can reach keeps its own weight
  // (docs/method/rendering.md, "Evaluation of rough refraction"): for a `refracted`
  // direction they are those of Cycles.
  float lamp_density(int lamp, const LightHit& hit, bool refracted) const {
    return hit.density * probability(lamp, refracted);
  }
  float world_density(const Vec3f& direction, bool refracted) const {
    const World& world = scene.appearance.world;
    return (refracted ? world.cycles_density(direction) : world.density(direction)) *
           probability(world_source(), refracted);
  }
  /// Of the point at `d` on an emissive mesh.
  float mesh_density(const PreparedMaterial<L>& m, const Surface& s, const Vec3f& d,
                     bool refracted) const {
    if (refracted && !m.strong_emitter) return 0;
    const float distance2 = dot(d, d);
    const float cosine = std::abs(dot(s.ng, d)) / std::sqrt(distance2);
    return cosine > 0
               ? probability(mesh_source(), refracted) * m.emitter_density * distance2 / cosine
               : 0;
  }

  /// False where there is no medium for sure: outside of the boxes around the bodies that hold one.
  bool media_around(const Vec3f& point) const {
    return boundless_medium_ || std::any_of(media_bounds_.begin(), media_bounds_.end(),
                                            [&](const Box& box) { return box.contains(point); });
  }

  struct EmissiveTriangle {
    int instance, triangle, material;
  };
  /// A point on an emissive triangle, chosen by area and emission.
  const EmissiveTriangle& choose_triangle(float u) const;

 private:
  struct OwnerSlots {
    int first = 0, count = 0;
    int intensity = -1, color = -1;  ///< power or strength; the colour: counted from `first`
  };
  static Factor<L> product(const Color<double>& color, double intensity, const Colorf& shape,
                           const OwnerSlots& slots) {
    const Colorf c(color);
    const auto i = static_cast<float>(intensity);
    Factor<L> f{c * shape * i, slots.first, slots.count};
    if (slots.intensity >= 0) f.set_slope(slots.intensity, c * shape);
    if (slots.color >= 0) f.set_slope(slots.color, shape * i);
    return f;
  }
  void prepare_slots(const SlotLayout& layout);
  void prepare_roulette(const SlotLayout& layout);
  void prepare_materials(const SlotLayout& layout, std::span<const FieldRef> fields);
  void prepare_inside(int material);
  void prepare_medium(const Material& source, PreparedMaterial<L>& material);
  void prepare_emitters();
  void prepare_seals();
  void prepare_media_bounds();
  void prepare_plain();
  void prepare_choice();

  std::vector<Box> media_bounds_;
  bool boundless_medium_ = false;  // a mesh that is open has no box to be outside of
  std::vector<OwnerSlots> lamp_slots_;
  OwnerSlots world_slots_;
  std::vector<float> probability_, cycles_probability_, cdf_;  ///< lamps, meshes, world
  std::vector<EmissiveTriangle> triangles_;
  std::vector<float> triangle_cdf_;
  double emitter_flux_ = 0, strong_flux_ = 0;
};

}  // namespace selenite
