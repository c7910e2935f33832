// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include <optional>
#include <utility>

#include "math/fault.h"
#include "module/arrays.h"
#include "module/bindings.h"
#include "scene/scene_builder.h"

namespace py = pybind11;
using namespace pybind11::literals;

namespace selenite {
namespace {

constexpr std::pair<const char*, RayKind> kNames[] = {
    {"camera", kCameraRay},          {"diffuse", kDiffuseRay},
    {"glossy", kGlossyRay},          {"transmission", kTransmissionRay},
    {"volume_scatter", kScatterRay}, {"shadow", kShadowRay}};

std::vector<std::string> all_names() {
  std::vector<std::string> names;
  for (const auto& [name, kind] : kNames) names.emplace_back(name);
  return names;
}

ObjectFacts facts_of(const py::dict& values, const std::string& who) {
  const auto three = [&](const char* name) {
    return color_of(values[name].cast<Array<double>>(), who + ": facts: " + name);
  };
  const Color<double> location = three("location");
  return {Vec3f(Vec3d{location.r, location.g, location.b}), Colorf(three("color")),
          values["alpha"].cast<float>(), values["index"].cast<float>(),
          values["random"].cast<float>()};
}

template <class List>
auto& at(List& list, int index, const char* what) {
  if (index < 0 || index >= static_cast<int>(list.size()))
    throw Refused("", std::string(what) + " " + std::to_string(index) + " was not added");
  return list[index];
}

}  // namespace

RayKinds kinds_of(const std::string& who, const std::vector<std::string>& names) {
  RayKinds kinds = 0;
  for (const std::string& name : names) {
    RayKinds kind = 0;
    std::string known;
    for (const auto& [called, value] : kNames) {
      if (name == called) kind = value;
      known += (known.empty() ? "" : ", ") + std::string(called);
    }
    if (!kind) throw NotFound(who, "visible_to has '" + name + "', which is none of " + known);
    kinds |= kind;
  }
  return kinds;
}

void bind_visibility(py::class_<SceneBuilder>& builder) {
  builder
      .def(
          "add_object",
          [](SceneBuilder& b, const std::string& name, int mesh, const Array<double>& matrix,
             std::vector<int> materials, const std::vector<std::string>& visible_to, bool holdout,
             int lit_set, int shadow_set, std::uint64_t lit, const std::optional<py::dict>& facts) {
            const std::string who = "Object '" + name + "'";
            Instance object;
            object.name = name;
            object.mesh = mesh;
            object.to_world = transform_of(matrix, who + ": matrix");
            object.materials = std::move(materials);
            object.visible_to = kinds_of(who, visible_to);
            object.holdout = holdout;
            object.lit_set = lit_set;
            object.shadow_set = shadow_set;
            object.links.lit = lit;
            if (facts) object.facts = facts_of(*facts, who);
            return b.add_object(std::move(object));
          },
          "name"_a, "mesh"_a, "matrix"_a, "materials"_a, py::kw_only(),
          "visible_to"_a = all_names(), "holdout"_a = false, "lit_set"_a = 0, "shadow_set"_a = 0,
          "lit"_a = LinkedSets::kAll, "facts"_a = py::none(),
          "An instance of a mesh; materials[i] for material slot i. visible_to: rays that see it, "
          "of "
          "camera, diffuse, glossy, transmission, volume_scatter, shadow. lit_set, shadow_set: its "
          "sets of light and shadow linking, [0, 64); lit: bits of the lit_sets that its own "
          "emission shines on. facts: what a shader may ask about it, {location: (3,), color: "
          "(3,), "
          "alpha, index, random}. ValueError: out of range. KeyError: unknown name.")
      .def(
          "set_light_visibility",
          [](SceneBuilder& b, int light, const std::vector<std::string>& visible_to,
             bool casts_shadows, bool met_by_rays, int max_bounces, std::uint64_t lit,
             std::uint64_t shading) {
            Light& lamp = at(b.appearance.lights, light, "Light");
            lamp.visible_to = kinds_of("Light '" + lamp.name + "': ", visible_to);
            lamp.casts_shadows = casts_shadows;
            lamp.met_by_rays = met_by_rays;
            lamp.max_bounces = max_bounces;
            lamp.links = {lit, shading};
          },
          "light"_a, "visible_to"_a, py::kw_only(), "casts_shadows"_a, "met_by_rays"_a,
          "max_bounces"_a, "lit"_a = LinkedSets::kAll, "shading"_a = LinkedSets::kAll,
          "The same of a lamp. lit, shading: bits of the lit_sets that it shines on, and of the "
          "shadow_sets that cast its shadows.")
      .def(
          "set_light_object",
          [](SceneBuilder& b, int light, const std::string& object) {
            at(b.appearance.lights, light, "Light").object = object;
          },
          "light"_a, "object"_a, "The object that places a lamp; else it is called as the lamp.")
      .def(
          "set_world_visibility",
          [](SceneBuilder& b, const std::vector<std::string>& visible_to, int max_bounces,
             bool transparent_film, double film_roughness) {
            World& world = b.appearance.world;
            world.visible_to = kinds_of("World: ", visible_to);
            world.max_bounces = max_bounces;
            world.transparent_film = transparent_film;
            world.film_roughness = film_roughness;
          },
          "visible_to"_a, py::kw_only(), "max_bounces"_a, "transparent_film"_a, "film_roughness"_a,
          "The same of the world, after `set_world`. film_roughness: up to which glass shows no "
          "world on a transparent film either; negative: it does.");
}

}  // namespace selenite
