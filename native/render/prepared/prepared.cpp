// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/prepared/prepared.h"

#include <algorithm>

#include "render/prepared/refraction_spread.h"

namespace selenite {
namespace {

int slot_room_of(const SlotLayout& layout, int slots) {
  int room = slots;
  for (int i = 0; i < static_cast<int>(layout.slots.size()); ++i)
    if ((i - layout.first_of_owner(i)) % kSlotStep == 0) room = std::max(room, i + kSlotStep);
  return room;
}

/// How much the derivative by a field counts, which has one slot, or that by a parameter.
constexpr double kRouletteShare = 0.1;

SlotScales roulette_scales_of(const Scene& scene, const SlotLayout& layout, bool taped) {
  SlotScales scales{};
  if (taped) scales[0] = static_cast<float>(kRouletteShare);
  for (std::size_t i = 0; i < layout.slots.size() && i < scales.size(); ++i) {
    const ParameterRef& ref = layout.slots[i].parameter;
    const Parameter& description = scene.description(ref);
    const std::vector<double> values = scene.get(ref);
    double size = 1;
    if (description.scale == Scale::kLog || description.scale == Scale::kRoughness) {
      // By the logarithm of what has a unit, so that the unit of length decides nothing, and of
      // roughness, by which derivatives grow as it becomes small. From a value
      // of 0 light comes by its derivative alone: then that keeps the path.
      size = *std::max_element(values.begin(), values.end());
      if (!(size > 0)) size = description.fit_upper;
    }
    scales[i] = static_cast<float>(kRouletteShare * size);
  }
  return scales;
}

/// Marks the materials of bodies from whose inside no light is seen.
template <int L>
void find_sealed(const Scene& scene, std::vector<PreparedMaterial<L>>& materials) {
  const Geometry& geometry = *scene.geometry;
  std::vector<Box> lights;
  for (const Light& light : scene.appearance.lights)
    if (light.on && light.has_place()) lights.push_back(light.bounds());
  const auto& instances = geometry.instances();
  const auto has = [&](std::size_t instance, const auto& wanted) {
    return std::any_of(instances[instance].materials.begin(), instances[instance].materials.end(),
                       [&](int m) { return wanted(materials[m]); });
  };
  for (std::size_t i = 0; i < instances.size(); ++i)
    if (has(i, [](const auto& m) { return m.emissive; }))
      lights.push_back(geometry.bounds(static_cast<int>(i)));
  for (PreparedMaterial<L>& material : materials) {
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
std::vector<bool> transparency_of(const std::vector<PreparedMaterial<L>>& materials) {
  std::vector<bool> found;
  for (const PreparedMaterial<L>& material : materials) found.push_back(material.transparent);
  return found;
}

/// The lamps that are on.
std::vector<int> lamps_of(const Appearance& appearance) {
  std::vector<int> found;
  for (int i = 0; i < static_cast<int>(appearance.lights.size()); ++i)
    if (appearance.lights[i].on) found.push_back(i);
  return found;
}

Scene with_world_at_rotation_0(Scene scene) {
  scene.appearance.world = scene.appearance.world.at_rotation_0();
  return scene;
}

/// All lights of the scene that are on.
template <int L>
LightSet lights_of(const Scene& scene, const LightRadiance<L>& emitted,
                   const std::vector<PreparedMaterial<L>>& materials) {
  const auto use = [](bool ticked) {
    return ticked ? LightUse::kDifferentiated : LightUse::kSampled;
  };
  const Appearance& appearance = scene.appearance;
  LightSet set;
  for (int i = 0; i < static_cast<int>(appearance.lights.size()); ++i)
    set.lamps.push_back(appearance.lights[i].on ? use(emitted.is_lamp_ticked(i)) : LightUse::kNone);
  for (const PreparedMaterial<L>& material : materials) {
    if (material.shader) {
      const auto m = static_cast<int>(set.materials.size());
      const bool emits = material.shader->may_emit(), moves = material.shader->emission_moves();
      if (emits) set.shaded[m] = mean_emission(scene, m);
      // What a few points show as black counts as well: it may be bright between them.
      set.materials.push_back(emits ? use(moves) : LightUse::kNone);
      continue;
    }
    const auto light = material.values.emission_color * material.values.emission_strength;
    const bool shines = max_channel(value_of(light)) > 0;
    const bool ticked = has_slope(light) || (shines && material.unknown_emission);
    const bool emits = ticked || shines;
    set.materials.push_back(emits ? use(ticked) : LightUse::kNone);
  }
  if (appearance.world.on) set.world = use(emitted.is_world_ticked());
  return set;
}

template <int L>
RefractionSpread boundary_of(const Material& source, const PreparedMaterial<L>& material) {
  if (material.transparent || !material.has_medium || material.shader) return {};
  const Vec3f inward{0, 0, 1};
  const PrincipledBsdf<PathScalar<L>> bsdf(material.values, material.flavour,
                                           {inward, inward, inward, true});
  const auto spread = refraction_spread(bsdf.layers());
  if (!spread) return {};
  // A texture may make it rough, and then no ray refracts as if it were smooth.
  if (spread->width2 == 0 && source.map_of(material_field(&MaterialValues::roughness))) return {};
  return *spread;
}

template <int L>
std::vector<RefractionSpread> boundaries_of(const Appearance& appearance,
                                            const std::vector<PreparedMaterial<L>>& materials) {
  std::vector<RefractionSpread> found;
  for (std::size_t m = 0; m < materials.size(); ++m)
    found.push_back(boundary_of(appearance.materials[m], materials[m]));
  const bool any =
      std::any_of(found.begin(), found.end(), [](const RefractionSpread& b) { return b.eta > 0; });
  return any ? found : std::vector<RefractionSpread>();
}

}  // namespace

template <int L>
Prepared<L>::Prepared(const Scene& s, const SlotLayout& layout, std::span<const FieldRef> fields)
    : scene(with_world_at_rotation_0(s)),
      geometry(*scene.geometry),
      materials(prepare_materials<L>(scene, layout, fields)),
      visibility(scene, transparency_of(materials)),
      exit(white_material<L>()),
      emitted(scene.appearance, layout),
      lights(scene, lights_of(scene, emitted, materials)),
      lamps(lamps_of(scene.appearance)),
      environment_field(field_number(fields, EnvironmentRef{})),
      slots(fields.empty() ? static_cast<int>(layout.slots.size()) : 1),
      slot_room(slot_room_of(layout, slots)),
      roulette_scales(roulette_scales_of(scene, layout, is_taped(L))) {
  for (std::size_t m = 0; m < materials.size(); ++m) {
    PreparedMaterial<L>& material = materials[m];
    material.emissive = lights.samples(static_cast<int>(m));
    any_transparent = any_transparent || material.transparent;
    any_medium = any_medium || material.has_medium;
    any_bump = any_bump || (material.shader && material.shader->has_bump());
    if (L > 0) prepare_plain(scene.appearance.materials[m], material);
  }
  if (!visibility.uneven) {
    find_sealed(scene, materials);
    boundaries = boundaries_of(scene.appearance, materials);
  }
  for (int i = 0; i < static_cast<int>(geometry.instances().size()); ++i) {
    const auto& own = geometry.instances()[i].materials;
    if (std::any_of(own.begin(), own.end(), [&](int m) { return materials[m].has_medium; }))
      media_bounds.include(geometry, i);
  }
  if (boundaries.empty()) return;
  for (const int i : lamps)
    if (scene.appearance.lights[i].aimed.value_or(false) && lights.probability(i) > 0)
      aims.push_back(i);
  if (aims.empty()) boundaries.clear();
}

template struct Prepared<0>;
template struct Prepared<1>;
template struct Prepared<2>;
template struct Prepared<4>;
template struct Prepared<6>;
template struct Prepared<8>;
template struct Prepared<16>;

}  // namespace selenite
