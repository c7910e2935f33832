// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <variant>

#include "fit/photo/photo.h"
#include "fit/problem/unknowns.h"
#include "module/arrays.h"
#include "module/bindings.h"
#include "module/float_array.h"
#include "module/light_state_binding.h"
#include "module/one_of.h"

namespace py = pybind11;
using namespace pybind11::literals;

namespace selenite {
namespace {

using Triple = std::array<double, 3>;

/// Pixels and weights, (height, width, 3) and (height, width) float32.
void take_pixels(Photo& photo, const py::object& reference, const py::object& weight) {
  const std::string who = "Photo '" + photo.id + "'";
  const FloatArray pixels = float_array(reference, who + ": reference");
  if (pixels.ndim() != 3 || pixels.shape(2) != 3)
    throw Refused(who, "reference has shape " + shape_text(pixels),
                  "it must be (height, width, 3)");
  photo.height = static_cast<int>(pixels.shape(0));
  photo.width = static_cast<int>(pixels.shape(1));
  photo.reference = colors_of(pixels);
  if (weight.is_none()) return;
  const FloatArray weights = float_array(weight, who + ": weight");
  if (weights.ndim() != 2 || weights.shape(0) != photo.height || weights.shape(1) != photo.width)
    throw Refused(who, "weight has shape " + shape_text(weights),
                  "it must be (" + std::to_string(photo.height) + ", " +
                      std::to_string(photo.width) + ") as the reference");
  photo.weight.assign(weights.data(), weights.data() + weights.size());
}

/// Aspect, width, height, and of a crop its window.
FrameTuple tuple_of(const PhotoFrame& frame) {
  const FrameWindow& w = frame.window;
  if (w.left == 0 && w.top == 0 && w.right == 1 && w.bottom == 1)
    return WholeFrame{frame.aspect, frame.width, frame.height};
  return std::tuple{frame.aspect, frame.width, frame.height,
                    std::array{w.left, w.top, w.right, w.bottom}};
}

Photo make_photo(const std::string& camera, const py::object& reference, const py::object& weight,
                 const std::optional<std::array<int, 2>>& size, const std::string& id,
                 const FrameTuple& frame, const py::object& lights, const Triple& gain,
                 const std::string& free_gain, bool align, const Triple& alignment,
                 const py::object& coverage) {
  if (reference.is_none() == !size)
    throw Refused("Photo '" + (id.empty() ? camera : id) + "'",
                  "give its pixels, reference, or its size, (width, height)");
  Photo photo;
  photo.camera = camera;
  if (size) {
    photo.width = (*size)[0];
    photo.height = (*size)[1];
  }
  photo.id = id.empty() ? camera : id;
  if (!size) take_pixels(photo, reference, weight);
  photo.frame = frame_of(frame);
  if (!lights.is_none()) photo.lights = light_state_of(lights, "Photo '" + photo.id + "': lights");
  photo.values.gain = {gain[0], gain[1], gain[2]};
  photo.gain_freedom = one_of<GainFreedom>(
      "Photo '" + photo.id + "': free_gain", free_gain,
      {{"none", GainFreedom::kNone}, {"scalar", GainFreedom::kScalar}, {"rgb", GainFreedom::kRgb}});
  if (!coverage.is_none()) {
    const FloatArray shares = float_array(coverage, "Photo '" + photo.id + "': coverage");
    photo.coverage.assign(shares.data(), shares.data() + shares.size());
  }
  photo.align = align;
  photo.alignment = {alignment[0], alignment[1], alignment[2]};
  return photo;
}

UnknownParameter make_unknown(const std::string& owner, const std::string& parameter,
                              double minimum, double maximum,
                              const std::variant<double, std::vector<double>>& start,
                              double learning_rate) {
  const auto* one = std::get_if<double>(&start);
  return {owner,   parameter, one ? std::vector{*one} : std::get<std::vector<double>>(start),
          minimum, maximum,   learning_rate};
}

}  // namespace

void bind_photo(py::module_& m) {
  py::class_<Photo>(m, "Photo", R"(A photo at working size, and how it was taken.

Args:
    camera: of any number of photos.
    reference, weight: (h, w, 3) float32 linear radiance, row 0 at the top, and (h, w) float32 >= 0
        or None for 1. Pixels that are not finite must have weight 0.
    size: (width, height) in place of pixels, where only a picture is asked for.
    id: unique in a fit; "" for the camera's name.
    frame: (aspect, width, height) where a picture is compared with a photo of so many pixels that an
        area filter brought to its size; aspect is that of all that the camera takes, width /
        height; 0: no photo. A fourth entry (left, top, right, bottom) is what the picture shows of
        it, in [0, 1]: a crop.
    lights: as for Scene.with_lights; None: as in the scene.
    gain: factor on what the camera renders, linear Rec. 709. free_gain: "none", "scalar" or "rgb",
        a factor on it that a fit finds.
    alignment: of the camera, in pixels of this size to the right and down, and radians about its
        axis. align: whether a fit finds a small one, from there on.
    coverage: (h, w) float32, the share of each pixel that shows the object whose vertices are
        fitted, or None where nobody knows.
Raises:
    ValueError: a shape, a type or a light state.)")
      .def(py::init(&make_photo), "camera"_a, "reference"_a = py::none(), "weight"_a = py::none(),
           py::kw_only(), "size"_a = py::none(), "id"_a = "", "frame"_a = FrameTuple{},
           "lights"_a = py::none(), "gain"_a = Triple{1, 1, 1}, "free_gain"_a = "none",
           "align"_a = false, "alignment"_a = Triple{}, "coverage"_a = py::none())
      .def_readonly("id", &Photo::id)
      .def_readonly("camera", &Photo::camera)
      .def_property_readonly("reference",
                             [](const Photo& p) -> py::object {
                               if (p.reference.empty()) return py::none();
                               return picture_array(p.reference, p.width, p.height);
                             })
      .def_property_readonly("weight",
                             [](const Photo& p) {
                               py::array_t<float> weights({p.height, p.width});
                               std::fill_n(weights.mutable_data(), weights.size(), 1.f);
                               std::ranges::copy(p.weight, weights.mutable_data());
                               return weights;
                             })
      .def_property_readonly("frame", [](const Photo& p) { return tuple_of(p.frame); })
      .def_property_readonly(
          "size",
          [](const Photo& p) {
            return std::array{p.width, p.height};
          },
          "(width, height)")
      .def_property_readonly("gain",
                             [](const Photo& p) {
                               return Triple{p.values.gain.r, p.values.gain.g, p.values.gain.b};
                             })
      .def_property_readonly("alignment", [](const Photo& p) {
        return Triple{p.alignment.x, p.alignment.y, p.alignment.roll};
      });
  py::class_<UnknownParameter>(m, "Unknown", R"(A parameter that a fit finds.

Args:
    owner: a material, a lamp, an object or "World".
    parameter: a name of the owner's table, or "albedo_grid", "density_grid", "vertex_colors" of an
        object, "environment", or that of an image, as "base_color_texture": every value of that grid,
        mesh or image, as it holds them (in sRGB if encoded).
    minimum, maximum: of every component, or of every value of the field.
    start: one number or three; a field starts at the scene's, without one.
    learning_rate: the step of Adam, in units of the values.)")
      .def(py::init(&make_unknown), "owner"_a, "parameter"_a, "minimum"_a, "maximum"_a,
           "start"_a = std::vector<double>{}, "learning_rate"_a = 0.03)
      .def_readonly("owner", &UnknownParameter::owner)
      .def_readonly("parameter", &UnknownParameter::parameter)
      .def_readonly("start", &UnknownParameter::start)
      .def_readonly("minimum", &UnknownParameter::minimum)
      .def_readonly("maximum", &UnknownParameter::maximum)
      .def_readonly("learning_rate", &UnknownParameter::learning_rate);
}

}  // namespace selenite
