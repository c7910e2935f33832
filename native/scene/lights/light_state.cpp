// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/lights/light_state.h"

#include <algorithm>
#include <bit>
#include <set>

#include "math/fault.h"
#include "math/hash.h"

namespace selenite {
namespace {

using Lights = std::vector<Light>;

/// The numbers of the lights that a name stands for.
std::vector<std::size_t> named(const Lights& lights, const std::string& name) {
  std::vector<std::size_t> by_object, by_lamp;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    if (lights[i].place() == name) by_object.push_back(i);
    if (lights[i].name == name) by_lamp.push_back(i);
  }
  return by_object.empty() ? by_lamp : by_object;
}

std::string quoted(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "'" : ", '") + name + "'";
  return text.empty() ? "none" : text;
}

std::string places_of(const Lights& lights) {
  std::vector<std::string> names;
  for (const Light& light : lights)
    if (std::ranges::find(names, light.place()) == names.end()) names.push_back(light.place());
  return quoted(names);
}

/// One for each light of the scene: whether it is on.
std::vector<char> on_of(const Lights& lights,
                        const std::optional<std::vector<std::string>>& lamps) {
  std::vector<char> on(lights.size(), lamps ? 0 : 1);
  if (!lamps) return on;
  for (const std::string& name : *lamps)
    for (const std::size_t i : named(lights, name)) on[i] = 1;
  return on;
}

}  // namespace

void LightState::check(const Scene& scene, const std::string& who) const {
  const Lights& lights = scene.appearance.lights;
  std::vector<std::string> unknown;
  const auto note = [&](const std::string& name) {
    if (named(lights, name).empty() && std::ranges::find(unknown, name) == unknown.end())
      unknown.push_back(name);
  };
  if (lamps) std::ranges::for_each(*lamps, note);
  for (const Place& place : places) note(place.lamp);
  if (!unknown.empty())
    throw NotFound(who,
                   (unknown.size() == 1 ? "lamp " + quoted(unknown) + " is not in the scene"
                                        : "lamps " + quoted(unknown) + " are not in the scene"),
                   "lamps: " + places_of(lights));
  std::set<std::size_t> moved;
  for (const Place& place : places) {
    const std::vector<std::size_t> found = named(lights, place.lamp);
    if (found.size() > 1)
      throw Refused(who,
                    "lamp '" + place.lamp + "' stands at " + std::to_string(found.size()) +
                        " places, so one matrix cannot move it",
                    "name one of its objects, or make its instances real");
    if (!moved.insert(found.front()).second)
      throw Refused(who, "lamp '" + place.lamp + "' is moved twice", "give one matrix");
  }
  try {
    (void)applied_to(scene);
  } catch (const Refused& error) {
    throw Refused(std::vector{error.faults().front().within(who)});
  }
}

Scene LightState::applied_to(Scene scene) const {
  Lights& lights = scene.appearance.lights;
  const std::vector<char> on = on_of(lights, lamps);
  for (std::size_t i = 0; i < lights.size(); ++i) lights[i].on = lights[i].on && on[i];
  for (const Place& place : places)
    for (const std::size_t i : named(lights, place.lamp)) {
      lights[i].to_world = place.to_world;
      if (place.radiance_scale) lights[i].radiance_scale = *place.radiance_scale;
      lights[i].prepare(scene.geometry ? scene.geometry->origin() : Vec3d{});
    }
  scene.appearance.world.on = scene.appearance.world.on && world;
  return scene;
}

bool LightState::shows(const Scene& scene, const ParameterRef& ref) const {
  const Lights& lights = scene.appearance.lights;
  switch (ref.kind) {
    case OwnerKind::kMaterial:
      return true;
    case OwnerKind::kLight: {  // at any of its places
      const std::vector<char> on = on_of(lights, lamps);
      const std::string name = scene.owner_name(ref);
      for (std::size_t i = 0; i < lights.size(); ++i)
        if (lights[i].name == name && lights[i].on && on[i]) return true;
      return false;
    }
    case OwnerKind::kWorld:
      return world && scene.appearance.world.on;
  }
  return true;
}

std::uint64_t LightState::fingerprint() const {
  std::uint64_t sum = mix64(lamps ? lamps->size() + 1 : 0);
  const auto add = [&](std::uint64_t part) { sum = mix64(sum ^ part); };
  if (lamps)
    for (const std::string& name : *lamps) add(hash64(name));
  add(world ? 1 : 2);
  for (const Place& place : places) {
    add(hash64(place.lamp));
    for (const auto& row : place.to_world.m)
      for (const double number : row) add(std::bit_cast<std::uint64_t>(number));
    add(std::bit_cast<std::uint64_t>(place.radiance_scale.value_or(-1)));
  }
  return sum;
}

}  // namespace selenite
