// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include <optional>
#include <tuple>

#include "module/arrays.h"
#include "module/bindings.h"
#include "scene/scene_builder.h"

namespace py = pybind11;
using namespace pybind11::literals;

namespace selenite {
namespace {

/// Axis, top of its picture, radius, picture.
using SunTuple = std::tuple<Array<double>, Array<double>, double, Array<float>>;

Vec3d vector_of(const Array<double>& a, const std::string& what) {
  require_shape(a, what, {3});
  return {a.at(0), a.at(1), a.at(2)};
}

std::array<Vec3f, 3> rows_of(const Array<double>& a) {
  require_shape(a, "World: to_map", {3, 3});
  std::array<Vec3f, 3> rows;
  for (int i = 0; i < 3; ++i) rows[i] = Vec3f(Vec3d{a.at(i, 0), a.at(i, 1), a.at(i, 2)});
  return rows;
}

SunDisc sun_of(const SunTuple& sun) {
  const auto& [axis, up, radius, picture] = sun;
  require_shape(picture, "World: picture of its sun",
                {-1, picture.ndim() ? picture.shape(0) : 0, 3});
  return {vector_of(axis, "World: axis of its sun"), vector_of(up, "World: top of its sun"), radius,
          static_cast<int>(picture.shape(0)), colors_of(picture)};
}

std::shared_ptr<const EnvironmentMap> map_of(const Array<float>& image,
                                             const std::optional<SunTuple>& sun) {
  require_shape(image, "World: image", {-1, -1, 3});
  std::optional<SunDisc> disc;
  if (sun) disc = sun_of(*sun);
  return std::make_shared<EnvironmentMap>(static_cast<int>(image.shape(1)),
                                          static_cast<int>(image.shape(0)), colors_of(image), 0.0f,
                                          std::move(disc));
}

void set_world(SceneBuilder& b, const Array<double>& color, double strength,
               const std::optional<Array<float>>& image, const Array<double>& to_map,
               double rotation, const std::optional<SunTuple>& sun) {
  World world;
  world.values = {color_of(color, "World: colour"), strength, rotation};
  world.to_map = rows_of(to_map);
  if (image) world.map = map_of(*image, sun);
  world.check();
  b.appearance.world = world;
}

}  // namespace

void bind_world(py::class_<SceneBuilder>& builder) {
  builder
      .def("set_world", &set_world, "color"_a, "strength"_a, "image"_a = py::none(),
           "to_map"_a = std::vector<std::vector<double>>{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
           "rotation"_a = 0.0, "sun"_a = py::none(),
           "Constant background, or an equirectangular (h,w,3) float32 image, row 0 at the top, "
           "times the colour; map direction = to_map @ world direction, rotated by so many radians "
           "about Z. sun: a disc that is added to the image, as (axis, direction to the top of its "
           "picture, radius in radians, (n,n,3) float32 picture), in the frame of the image.")
      .def(
          "add_backdrop",
          [](SceneBuilder& b, const std::vector<std::string>& seen_by, const Array<float>& image,
             const Array<double>& to_map, bool scaled, const std::optional<SunTuple>& sun) {
            Backdrop seen{kinds_of("World: ", seen_by), map_of(image, sun), rows_of(to_map),
                          scaled};
            b.appearance.world.backdrops.push_back(std::move(seen));
            b.appearance.world.check();
          },
          "seen_by"_a, "image"_a, "to_map"_a, "scaled"_a, "sun"_a = py::none(),
          "What the world is to rays of exactly these kinds, after `set_world`, else as there. "
          "Diffuse and glossy rays that pass a surface are of two kinds. scaled: times colour and "
          "strength of the world.");
}

}  // namespace selenite
