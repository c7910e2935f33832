// SPDX-License-Identifier: GPL-3.0-or-later
#include "module/fit_arguments.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <string_view>

#include "fit/problem/fields.h"
#include "module/bindings.h"
#include "module/float_array.h"
#include "module/light_state_binding.h"
#include "module/named.h"

namespace py = pybind11;

namespace selenite {
namespace {

constexpr std::array<std::string_view, 3> kGainFreedoms{"none", "scalar", "rgb"};

}  // namespace

Photo photo_of(const py::handle& object, std::size_t index) {
  const std::string what = "photos[" + std::to_string(index) + "]";
  std::vector<const char*> keys{"id",    "camera", "reference", "weight",
                                "frame", "lights", "free_gain", "align"};
  for (const Parameter& parameter : photo_parameter_table().rows)
    keys.push_back(parameter.name.data());
  const Named named(object, what, std::move(keys));
  Photo photo;
  photo.camera = named.as<std::string>("camera");
  named.take("id", photo.id);
  named.take("align", photo.align);
  if (named.has("free_gain")) {
    const auto name = named.as<std::string>("free_gain");
    const auto found = std::ranges::find(kGainFreedoms, name);
    if (found == kGainFreedoms.end())
      throw py::value_error(what + ": free_gain = '" + name + "' is not none, scalar or rgb");
    photo.gain_freedom = static_cast<GainFreedom>(found - kGainFreedoms.begin());
  }
  if (named.has("lights")) photo.lights = light_state_of(named.get("lights"), what + ": lights");
  visit_fields(photo.values, [&](const Parameter& parameter, double* first, int width) {
    const char* key = parameter.name.data();  // of a literal: it ends with 0
    if (!named.has(key)) return;
    const auto numbers = named.as<std::vector<double>>(key);
    if (std::ssize(numbers) != width)
      throw py::value_error(what + ": " + key + " has " + std::to_string(numbers.size()) +
                            " values; it takes " + std::to_string(width));
    std::ranges::copy(numbers, first);
  });
  if (named.has("frame")) photo.frame = frame_of(named.as<FrameTuple>("frame"));
  const FloatArray reference = float_array(named.get("reference"), what + ": reference");
  if (reference.ndim() != 3 || reference.shape(2) != 3)
    throw py::value_error(what + ": reference has shape " + shape_text(reference) +
                          "; it must be (height, width, 3)");
  photo.height = static_cast<int>(reference.shape(0));
  photo.width = static_cast<int>(reference.shape(1));
  photo.reference.resize(static_cast<std::size_t>(photo.height) * photo.width);
  static_assert(sizeof(Colorf) == 3 * sizeof(float));
  std::memcpy(static_cast<void*>(photo.reference.data()), reference.data(),
              photo.reference.size() * sizeof(Colorf));
  if (!named.has("weight")) return photo;
  const FloatArray weight = float_array(named.get("weight"), what + ": weight");
  if (weight.ndim() != 2 || weight.shape(0) != photo.height || weight.shape(1) != photo.width)
    throw py::value_error(what + ": weight has shape " + shape_text(weight) + "; it must be (" +
                          std::to_string(photo.height) + ", " + std::to_string(photo.width) +
                          ") as the reference");
  photo.weight.assign(weight.data(), weight.data() + weight.size());
  return photo;
}

UnknownParameter unknown_of(const py::handle& object, std::size_t index) {
  const Named named(object, "unknowns[" + std::to_string(index) + "]",
                    {"owner", "parameter", "start", "minimum", "maximum", "learning_rate"});
  UnknownParameter unknown;
  unknown.owner = named.as<std::string>("owner");
  unknown.parameter = named.as<std::string>("parameter");
  named.take("learning_rate", unknown.learning_rate);
  unknown.minimum = named.as<double>("minimum");
  unknown.maximum = named.as<double>("maximum");
  if (Fields::is_field(unknown) && !named.has("start")) return unknown;
  const py::object start = named.get("start");
  if (py::isinstance<py::float_>(start) || py::isinstance<py::int_>(start))
    unknown.start = {named.as<double>("start")};
  else
    unknown.start = named.as<std::vector<double>>("start");
  return unknown;
}

FitSettings settings_of(const py::handle& object) {
  const Named named(
      object, "settings",
      {"loss", "optimiser", "iterations", "most_iterations", "spp", "tolerance", "seed", "depth",
       "threads", "accumulate", "validation_interval", "validation_spp", "search", "refinement",
       "refinement_spp", "finite_differences"});
  FitSettings settings;
  named.take("loss", settings.loss);
  named.take("optimiser", settings.optimiser);
  named.take("iterations", settings.iterations);
  named.take("most_iterations", settings.most_iterations);
  named.take("spp", settings.spp);
  named.take("tolerance", settings.tolerance);
  named.take("seed", settings.seed);
  named.take("depth", settings.depth);
  named.take("threads", settings.threads);
  named.take("accumulate", settings.accumulate);
  named.take("validation_interval", settings.validation_interval);
  named.take("validation_spp", settings.validation_spp);
  named.take("finite_differences", settings.finite_differences);
  named.take("search", settings.search);
  named.take("refinement", settings.refinement);
  named.take("refinement_spp", settings.refinement_spp);
  return settings;
}

std::vector<UnknownParameter> unknowns_of(const py::list& unknowns) {
  std::vector<UnknownParameter> wanted;
  for (const auto& one : unknowns) wanted.push_back(unknown_of(one, wanted.size()));
  return wanted;
}

}  // namespace selenite
