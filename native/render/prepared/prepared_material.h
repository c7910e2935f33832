// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include "model/bsdf.h"
#include "render/derivatives/throughput.h"
#include "render/film/slots.h"
#include "render/prepared/prepared_shader.h"
#include "scene/scene.h"

namespace selenite {

/// float without derivatives, or a dual with L local slots.
template <int L>
using PathScalar = std::conditional_t<L == 0, float, Dual<float, L == 0 ? 1 : L>>;

/// The medium behind a surface: what it scatters, and the rates at which free paths in it are drawn.
template <int L>
struct PreparedMedium {
  bool has_medium = false;  ///< else nothing here counts
  Color<PathScalar<L>> sigma_s;
  Colorf rate;
  Colorf typical_rate;  ///< `rate` at a middling density, for weights
  float majorant = 0;   ///< above the rate of every channel everywhere; see GridFlight
  const PlacedGrid* albedo_grid = nullptr;   ///< none: the constant
  const PlacedGrid* density_grid = nullptr;  ///< none: 1 everywhere
  /// Numbers of the fields of unknowns that the grids are, if they are.
  int albedo_field = -1, density_field = -1;
  /// Of an unknown density: free paths are drawn as if it were at least `least_density`, for where
  /// it is 0 its derivative is not; a shift counts in `density_unit`.
  float least_density = 0, density_unit = 0;

  Colorf rate_at(const Vec3f& p) const {
    return density_grid ? rate * std::max(density_grid->at(p).r, least_density) : rate;
  }
};

/// A map of a material that is unknown.
struct UnknownMap {
  const FieldMap* map;  ///< null: colours that a shader looks up
  int slot;             ///< the first of the local slots of what it gives
  int count;            ///< of these: 1, or 3 where every channel depends on every number
  int field = -1;       ///< of its image; -1: any colours of the mesh, -2 - i: unknown_colors[i]
};
/// Colours of a mesh that are unknown.
struct UnknownColors {
  int mesh;
  const std::string* attribute;
  int field;
};

/// Slots of a material.
struct OwnSlots {
  int first = 0;  ///< slot of the layout that its first local slot is; the others follow
  int count = 0;  ///< local slots in use
};

/// A material with its ticked parameters seeded as independent variables.
template <int L>
struct PreparedMaterial : PreparedMedium<L>, OwnSlots {
  MaterialParameters<PathScalar<L>> values;
  Flavour flavour;
  /// Only reflects or refracts, the same everywhere, and nothing of it is ticked: its bsdf is
  /// evaluated without derivatives.
  bool plain = false;
  Principled<float> plain_values;
  /// No light can be seen from inside of it: its surface is closed and faces outwards, lets no shadow
  /// ray pass, and every light is outside of the boxes around its objects.
  bool sealed = false;
  bool transparent = false;  ///< lets rays pass straight through (alpha below 1, or ticked)
  bool emissive = false;     ///< light sampling picks points on it
  /// In place of the Principled BSDF of `values`; null: that.
  std::shared_ptr<const PreparedShader<PathScalar<L>>> shader;
  const std::vector<FieldMap>* maps = nullptr;
  const MeshColors* mesh_colors = nullptr;
  std::vector<UnknownMap> unknown_maps;
  std::vector<UnknownColors> unknown_colors;  ///< what those of `unknown_maps` without a field show
  bool unknown_emission = false;              ///< by one of `unknown_maps`

  /// sigma_t at a point of the medium.
  Color<PathScalar<L>> extinction_at(const Vec3f& p) const {
    return this->density_grid ? values.extinction * this->density_grid->at(p).r : values.extinction;
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
  bool is_recorded() const { return is_taped(L) && !unknown_maps.empty(); }
  /// The throughput takes what the surface scatters at a hit.
  template <class X>
  void attenuate(const Geometry& geometry, const Hit& hit, const Color<X>& c,
                 Throughput<L>& beta) const {
    if constexpr (is_taped(L))
      if (is_recorded()) return record(geometry, hit, c, beta);
    beta.multiply(factor(c));
  }
  /// The same of light that passes straight through, on which few maps have an effect.
  template <class X>
  void pass(const Geometry& geometry, const Hit& hit, const Color<X>& c,
            Throughput<L>& beta) const {
    if constexpr (is_taped(L))
      if (is_recorded() && has_slope(c)) return record(geometry, hit, c, beta);
    beta.multiply(factor(c));
  }
  template <class X>
  void record(const Geometry& geometry, const Hit& hit, const Color<X>& c,
              Throughput<L>& beta) const requires(is_taped(L)) {
    const Factor<L> f = factor(c);
    std::array<FieldSlope, L> slopes;
    const int count = slopes_of(geometry, hit, f, slopes);
    if (count > 0)
      beta.multiply_recorded(f.value, slopes.data(), count);
    else
      beta.multiply(f);
  }
  /// Puts what the surface emits on the tape, by its share of the pixel.
  void record_emission(const Geometry& geometry, const Hit& hit, const Factor<L>& emitted,
                       const Colorf& share, const Throughput<L>& beta, Radiance<L>& radiance) const
      requires(is_taped(L)) {
    if (!unknown_emission) return;
    std::array<FieldSlope, L> slopes;
    const int count = slopes_of(geometry, hit, emitted, slopes);
    for (int i = 0; i < count; ++i) {
      const Colorf derivative = share * slopes[static_cast<std::size_t>(i)].slope;
      beta.tape->add_leaf(derivative, slopes[static_cast<std::size_t>(i)].place);
      radiance.slope.add(0, derivative);
    }
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
  /// How a factor depends on what unknown maps give at a hit; returns their number.
  int slopes_of(const Geometry& geometry, const Hit& hit, const Factor<L>& f,
                std::array<FieldSlope, L>& slopes) const;
};

/// Derivatives of a material that its unknown maps need.
int map_slots(const Scene& scene, std::span<const FieldRef> fields, int material);

/// Of a field among those that are unknown; -1 if it is none of them.
int field_number(std::span<const FieldRef> fields, const FieldRef& ref);

/// The materials of a scene, except what needs its lights: `emissive`, `sealed` and `plain`. `fields`:
/// grids, images and colours of meshes that are unknown. Readies the geometry for walks below a surface.
template <int L>
std::vector<PreparedMaterial<L>> prepare_materials(const Scene& scene, const SlotLayout& layout,
                                                   std::span<const FieldRef> fields);
/// White and Lambertian.
template <int L>
PreparedMaterial<L> white_material();
/// Works out what a material that is `plain` looks like, and whether it is.
template <int L>
void prepare_plain(const Material& from, PreparedMaterial<L>& material);

}  // namespace selenite
