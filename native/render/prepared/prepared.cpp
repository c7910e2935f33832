// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/prepared/prepared.h"

#include <algorithm>
#include <cmath>

#include "math/error.h"

namespace selenite {
namespace {

/// Free paths per radius as which an unknown medium counts where there is none.
constexpr float kThin = 0.2f;
/// The least rate at which free paths in an unknown density end, as a share of the largest.
constexpr float kLeastShare = 0.1f;

double luminance(const Color<double>& c) { return 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b; }

/// -1 if it is none of them.
int number_of(std::span<const FieldRef> fields, const FieldRef& ref) {
  const auto found = std::find(fields.begin(), fields.end(), ref);
  return found == fields.end() ? -1 : static_cast<int>(found - fields.begin());
}

/// All numbers of a material, field by field, three for a colour.
std::vector<double> flatten(const MaterialParameters<double>& values) {
  std::vector<double> flat;
  struct Visit {
    std::vector<double>& flat;
    void operator()(const Parameter&, double& x) const { flat.push_back(x); }
    void operator()(const Parameter&, Color<double>& c) const {
      for (int i = 0; i < 3; ++i) flat.push_back(c[i]);
    }
  };
  MaterialParameters<double> copy = values;
  MaterialParameters<double>::fields(copy, Visit{flat});
  return flat;
}

/// Copies the numbers of a material into path scalars and seeds those that carry a derivative.
template <int L>
struct Seed {
  using T = PathScalar<L>;
  const std::vector<double>& flat;
  const std::vector<std::vector<int>>& local;  ///< per field: local slots, -1 or none if not ticked
  std::size_t at = 0;
  std::size_t field = 0;

  T scalar(int slot) {
    const auto value = static_cast<float>(flat[at++]);
    if constexpr (L > 0)
      if (slot >= 0) return T::variable(value, slot);
    return T(value);
  }
  void operator()(const Parameter&, T& x) {
    const auto& slots = local[field++];
    x = scalar(slots.empty() ? -1 : slots[0]);
  }
  void operator()(const Parameter&, Color<T>& c) {
    const auto& slots = local[field++];
    for (int i = 0; i < 3; ++i)
      c[i] = scalar(slots.empty() ? -1 : slots[slots.size() == 1 ? 0 : i]);
  }
};

template <class T>
bool emits(const Principled<T>& m) {
  const auto power = m.emission_color * m.emission_strength;
  return max_channel(value_of(power)) > 0 || has_slope(power);
}

/// Probabilities of lights of some flux: half by power, half evenly, so that a weak lamp close by is
/// not starved.
std::vector<float> shares(const std::vector<double>& flux) {
  double total = 0;
  int active = 0;
  for (const double f : flux) {
    total += f;
    active += f > 0;
  }
  std::vector<float> found;
  for (const double f : flux)
    found.push_back(f > 0 ? static_cast<float>(0.5 * f / total + 0.5 / active) : 0);
  return found;
}

}  // namespace

template <int L>
Prepared<L>::Prepared(const Scene& s, const SlotLayout& layout, std::span<const FieldRef> fields)
    : scene(s),
      geometry(*s.geometry),
      slots(fields.empty() ? static_cast<int>(layout.slots.size()) : kTaped),
      lamp_slots_(s.appearance.lights.size()) {
  prepare_slots(layout);
  prepare_roulette(layout);
  prepare_materials(layout, fields);
  prepare_emitters();
  prepare_choice();
  prepare_seals();
  prepare_media_bounds();
  if (L > 0) prepare_plain();
}

template <int L>
void Prepared<L>::prepare_slots(const SlotLayout& layout) {
  slot_room = slots;
  int first = 0;  // slot of this owner
  for (int i = 0; i < static_cast<int>(layout.slots.size()); ++i) {
    const ParameterRef& ref = layout.slots[i].parameter;
    if (!ref.same_owner(layout.slots[first].parameter)) first = i;
    if ((i - first) % kSlotStep == 0) slot_room = std::max(slot_room, i + kSlotStep);
    if (ref.kind == OwnerKind::kMaterial) continue;
    OwnerSlots& owner = ref.kind == OwnerKind::kLight ? lamp_slots_[ref.owner] : world_slots_;
    owner.first = first;
    (layout.slots[i].component < 0 ? owner.color : owner.intensity) = owner.count++;
  }
}

template <int L>
void Prepared<L>::prepare_roulette(const SlotLayout& layout) {
  constexpr double kShare = 0.1;
  if (L == kTaped) roulette_scales[0] = kShare;
  for (std::size_t i = 0; i < layout.slots.size() && i < roulette_scales.size(); ++i) {
    const ParameterRef& ref = layout.slots[i].parameter;
    const Parameter& description = scene.description(ref);
    const std::vector<double> values = scene.get(ref);
    double size = 1;
    if (description.coordinate == Coordinate::kLog || description.coordinate == Coordinate::kBlur) {
      // By the logarithm of what has a unit, so that the unit of length decides nothing, and of
      // roughness, by which derivatives grow as it becomes small. From a value
      // of 0 light comes by its derivative alone: then that keeps the path.
      size = *std::max_element(values.begin(), values.end());
      if (!(size > 0)) size = description.fit_upper;
    }
    roulette_scales[i] = static_cast<float>(kShare * size);
  }
}

template <int L>
void Prepared<L>::prepare_materials(const SlotLayout& layout, std::span<const FieldRef> unknown) {
  const auto& fields = parameter_table(OwnerKind::kMaterial);
  for (std::size_t m = 0; m < scene.appearance.materials.size(); ++m) {
    const Material& material = scene.appearance.materials[m];
    PreparedMaterial<L> prepared;
    prepared.flavour = material.flavour;
    prepared.maps = &material.maps;
    std::vector<std::vector<int>> local(fields.size());
    if constexpr (L > 0) {
      for (int i = 0; i < static_cast<int>(layout.slots.size()); ++i) {
        const ParameterRef& ref = layout.slots[i].parameter;
        if (ref.kind != OwnerKind::kMaterial || ref.owner != static_cast<int>(m)) continue;
        if (prepared.count == 0) prepared.first = i;
        local[ref.field].push_back(prepared.count++);
      }
    }
    const std::vector<double> flat = flatten(material.values);
    Seed<L> seed{flat, local};
    MaterialParameters<PathScalar<L>>::fields(prepared.values, seed);
    prepared.transparent = value_of(prepared.values.alpha) < 1 || has_slope(prepared.values.alpha);
    for (const FieldMap& map : material.maps)
      prepared.transparent = prepared.transparent || fields[map.field].name == "alpha";
    any_transparent = any_transparent || prepared.transparent;
    const auto& under = prepared.values.subsurface_weight;
    bool subsurface = value_of(under) > 0 || has_slope(under);
    for (const FieldMap& map : material.maps)
      subsurface = subsurface || fields[map.field].name == "subsurface_weight";
    const auto index = static_cast<int>(m);
    if (subsurface) prepare_inside(index);
    prepared.albedo_field = number_of(unknown, GridRef{index, GridKind::kAlbedo});
    prepared.density_field = number_of(unknown, GridRef{index, GridKind::kDensity});
    prepared.base_color_field = number_of(unknown, ImageRef{index});
    if (prepared.base_color_field >= 0) prepared.base_color_map = &scene.image({index});
    prepare_medium(material, prepared);
    materials.push_back(prepared);
  }
  exit.values.specular_level = PathScalar<L>(0);
  exit.values.base_color = Color<PathScalar<L>>(PathScalar<L>(1));
  static const std::vector<FieldMap> none;
  exit.maps = &none;
}

template <int L>
void Prepared<L>::prepare_medium(const Material& source, PreparedMaterial<L>& material) {
  const auto& sigma_t = material.values.extinction;
  if (source.albedo_grid) material.albedo_grid = &source.albedo_grid;
  if (source.density_grid) material.density_grid = &source.density_grid;
  float densest = source.density_grid ? source.density_grid.grid->maximum() : 1;
  const float radius = geometry.radius(), most = max_channel(value_of(sigma_t));
  const bool unknown = material.density_field >= 0;
  if (unknown && most > 0) {
    // A grid that is empty everywhere still has its derivative: it counts as thin for its size.
    const double side = std::cbrt(1 / std::abs(source.density_grid.to_unit.determinant()));
    material.least_density =
        std::max(kLeastShare * densest, 2 * kThin / (static_cast<float>(side) * most));
    material.density_unit = densest = std::max(densest, material.least_density);
  }
  material.has_medium = densest > 0 && (max_channel(value_of(sigma_t)) > 0 || has_slope(sigma_t));
  if (!material.has_medium) return;
  any_medium = true;
  material.sigma_s = sigma_t * material.values.albedo;
  material.rate = value_of(sigma_t);
  // A ticked extinction of 0 still has a derivative, of light that would be scattered once.
  const float least = radius > 0 ? kThin / (radius * densest) : 0;
  if (has_slope(sigma_t))
    material.rate = map(material.rate, [least](float r) { return std::max(r, least); });
  const float middling = source.density_grid ? source.density_grid.grid->mean() : 1.0f;
  material.typical_rate = material.rate * std::max(middling, material.least_density);
  // Twice the extinction where it is ticked: as many null collisions as real ones at the densest
  // place. Their number then adds as much variance to the derivative as the free path itself has.
  const bool loose = has_slope(sigma_t) || unknown;
  material.majorant = max_channel(material.rate) * densest * (loose ? 2.0f : 1.0f);
}

template <int L>
void Prepared<L>::prepare_inside(int material) {
  const auto& instances = geometry.instances();
  for (std::size_t i = 0; i < instances.size(); ++i) {
    const auto& slots_of_mesh = instances[i].materials;
    if (std::find(slots_of_mesh.begin(), slots_of_mesh.end(), material) != slots_of_mesh.end())
      geometry.prepare_inside(static_cast<int>(i));
  }
}

template <int L>
void Prepared<L>::prepare_emitters() {
  std::vector<double> weight(materials.size(), 0);
  bool any = false;
  for (std::size_t m = 0; m < materials.size(); ++m) {
    const auto& values = scene.appearance.materials[m].values;
    if (!emits(materials[m].values)) continue;
    // A ticked emission of 0 is sampled too: its derivative is not 0.
    weight[m] = std::max(luminance(values.emission_color) * values.emission_strength, 1e-3);
    materials[m].strong_emitter =
        max_channel(values.emission_color) * values.emission_strength > 0.5;
    any = true;
  }
  if (!any) return;
  std::vector<double> cumulative;
  const auto& instances = geometry.instances();
  for (std::size_t i = 0; i < instances.size(); ++i) {
    const Mesh& mesh = geometry.meshes()[instances[i].mesh];
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const int m = instances[i].materials[mesh.material_slots[t]];
      if (weight[m] == 0) continue;
      const auto [a, b, c] = geometry.corners(static_cast<int>(i), static_cast<int>(t));
      const double flux = weight[m] * length(cross(b - a, c - a)) / 2;
      emitter_flux_ += flux;
      if (materials[m].strong_emitter) strong_flux_ += flux;
      triangles_.push_back({static_cast<int>(i), static_cast<int>(t), m});
      cumulative.push_back(emitter_flux_);
    }
  }
  for (std::size_t m = 0; m < materials.size(); ++m)
    if (weight[m] > 0 && emitter_flux_ > 0)
      materials[m].emitter_density = static_cast<float>(weight[m] / emitter_flux_);
  for (double x : cumulative) triangle_cdf_.push_back(static_cast<float>(x / emitter_flux_));
}

template <int L>
void Prepared<L>::prepare_seals() {
  std::vector<Box> lights;
  for (const Light& light : scene.appearance.lights)
    if (light.kind != LightKind::kSun) lights.push_back(light.bounds());
  const auto& instances = geometry.instances();
  const auto has = [&](std::size_t instance, const auto& wanted) {
    return std::any_of(instances[instance].materials.begin(), instances[instance].materials.end(),
                       [&](int m) { return wanted(materials[m]); });
  };
  for (std::size_t i = 0; i < instances.size(); ++i)
    if (has(i, [](const auto& m) { return m.emitter_density > 0; }))
      lights.push_back(geometry.bounds(static_cast<int>(i)));
  for (std::size_t m = 0; m < materials.size(); ++m) {
    PreparedMaterial<L>& material = materials[m];
    if (material.transparent) continue;
    material.sealed = true;
    for (std::size_t i = 0; i < instances.size(); ++i) {
      if (!has(i, [&](const auto& other) { return &other == &material; })) continue;
      const Box box = geometry.bounds(static_cast<int>(i));
      // Another material on the same object may be a window.
      const bool window = has(i, [](const auto& other) { return other.transparent; });
      const bool lit = std::any_of(lights.begin(), lights.end(),
                                   [&](const Box& light) { return light.overlaps(box); });
      if (window || lit || !geometry.closed(static_cast<int>(i))) material.sealed = false;
    }
  }
}

template <int L>
void Prepared<L>::prepare_media_bounds() {
  for (int i = 0; i < static_cast<int>(geometry.instances().size()); ++i) {
    const auto& own = geometry.instances()[i].materials;
    if (!std::any_of(own.begin(), own.end(), [&](int m) { return materials[m].has_medium; }))
      continue;
    media_bounds_.push_back(geometry.bounds(i));
    if (!geometry.closed(i)) boundless_medium_ = true;
  }
}

template <int L>
void Prepared<L>::prepare_plain() {
  const std::vector<std::vector<int>> none(parameter_table(OwnerKind::kMaterial).size());
  for (std::size_t m = 0; m < materials.size(); ++m) {
    PreparedMaterial<L>& material = materials[m];
    const Material& from = scene.appearance.materials[m];
    material.plain = material.count == 0 && from.maps.empty() && !material.transparent &&
                     !(material.emitter_density > 0) && !(from.values.subsurface_weight > 0);
    if (!material.plain) continue;
    const std::vector<double> flat = flatten(from.values);
    Seed<0> seed{flat, none};
    Principled<float>::fields(material.plain_values, seed);
  }
}

template <int L>
void Prepared<L>::prepare_choice() {
  const auto& lights = scene.appearance.lights;
  const float radius = geometry.radius();
  std::vector<double> flux;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const bool ticked = lamp_slots_[i].intensity >= 0 || lamp_slots_[i].color >= 0;
    flux.push_back(std::max<double>(lights[i].flux(radius), ticked ? 1e-6 : 0));
  }
  flux.push_back(emitter_flux_ * 2 * kPi<double>);  // both sides emit
  const World& world = scene.appearance.world;
  double sky = 0;
  if (world.map) {
    const bool ticked = world_slots_.intensity >= 0 || world_slots_.color >= 0;
    sky = std::max(luminance(world.values.color) * world.values.strength *
                       world.map->mean_luminance() * square(kPi<double>) * square(radius),
                   ticked ? 1e-6 : 0);
  }
  flux.push_back(sky);

  probability_ = shares(flux);
  double sum = 0;
  for (const float p : probability_) cdf_.push_back(static_cast<float>(sum += p));
  flux[mesh_source()] = strong_flux_ * 2 * kPi<double>;
  cycles_probability_ = shares(flux);
}

template <int L>
typename Prepared<L>::Choice Prepared<L>::choose(float u) const {
  const auto it = std::upper_bound(cdf_.begin(), cdf_.end(), u);
  if (it == cdf_.end()) return {};
  const auto i = static_cast<std::size_t>(it - cdf_.begin());
  const std::size_t lamps = scene.appearance.lights.size();
  const Source source = i < lamps ? Source::kLamp : (i == lamps ? Source::kMesh : Source::kWorld);
  return {source, static_cast<int>(i), probability_[i]};
}

template <int L>
const typename Prepared<L>::EmissiveTriangle& Prepared<L>::choose_triangle(float u) const {
  const auto it = std::upper_bound(triangle_cdf_.begin(), triangle_cdf_.end(), u);
  return triangles_[std::min<std::size_t>(it - triangle_cdf_.begin(), triangles_.size() - 1)];
}

template struct PreparedMaterial<0>;
template struct PreparedMaterial<1>;
template struct PreparedMaterial<2>;
template struct PreparedMaterial<4>;
template struct PreparedMaterial<8>;
template struct PreparedMaterial<16>;
template class Prepared<0>;
template class Prepared<1>;
template class Prepared<2>;
template class Prepared<4>;
template class Prepared<8>;
template class Prepared<16>;

}  // namespace selenite
