// SPDX-License-Identifier: GPL-3.0-or-later
#include "module/light_state_binding.h"

#include <map>

#include "module/arrays.h"
#include "module/bindings.h"
#include "module/named.h"

namespace selenite {

LightState light_state_of(const py::handle& object, const std::string& what) {
  const Named named(object, what, {"lamps", "world", "places"});
  LightState state;
  if (named.has("lamps")) state.lamps = named.as<std::vector<std::string>>("lamps");
  named.take("world", state.world);
  std::map<std::string, std::pair<Array<double>, std::optional<double>>> places;
  named.take("places", places);
  for (const auto& [lamp, place] : places)
    state.places.push_back(
        {lamp, transform_of(place.first, what + ": matrix of '" + lamp + "'"), place.second});
  return state;
}

void bind_lights(py::class_<Scene>& scene) {
  scene
      .def_property_readonly(
          "light_objects",
          [](const Scene& s) {
            std::vector<std::string> names;
            for (const Light& light : s.appearance.lights) names.push_back(light.place());
            return names;
          },
          "What the lamps are called in a light state, beside `lights`.")
      .def(
          "with_lights",
          [](const Scene& s, const py::dict& lights) {
            const LightState state = light_state_of(lights, "lights");
            state.check(s, "");
            return state.applied_to(s);
          },
          py::arg("lights"),
          "Scene under other lights: {lamps: names of those that are on or None for all, world: "
          "bool, "
          "places: {name: (matrix (4, 4), radiance scale or None)}}. Lamps are called by the "
          "object "
          "that places them, else by the lamp. KeyError: no such lamp. ValueError: a matrix that "
          "no "
          "lamp can have, or one for several places.")
      .def(
          "with_environment",
          [](const Scene& s, const Array<float>& pixels) {
            const EnvironmentMap& image = s.environment();
            require_shape(pixels, "pixels", {image.height(), image.width(), 3});
            return s.with_environment(colors_of(pixels));
          },
          py::arg("pixels"),
          "Scene with other radiance in the world's image, (h, w, 3), row 0 at the top. "
          "ValueError: "
          "no image, one that a colour tints, another size, a number below 0 or not finite.");
}

}  // namespace selenite
