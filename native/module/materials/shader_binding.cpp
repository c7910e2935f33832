// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include <limits>
#include <optional>

#include "module/arrays.h"
#include "module/bindings.h"
#include "scene/scene.h"
#include "scene/shader/evaluate.h"

namespace py = pybind11;
using namespace pybind11::literals;

namespace selenite {
namespace {

/// Radius of a pixel of a camera at a distance: what Bump takes its differences over.
float footprint_of(const PixelCamera& pixels, float x, float y, float distance) {
  const Ray here = pixels.ray(x, y), right = pixels.ray(x + 1, y), down = pixels.ray(x, y + 1);
  const auto way = [&](const Ray& other) {
    return length(other.origin - here.origin) + length(other.direction - here.direction) * distance;
  };
  return (way(right) + way(down)) / 2;
}

/// Numbers of one material's registers at the pixels that show it: (height, width, registers, 3),
/// NaN elsewhere. T: double, or its dual with one slot, for the derivative by one constant.
template <class T>
py::array_t<double> register_picture(const Scene& scene, int material, const Camera& camera,
                                     int width, int height, int constant, const float* places) {
  const Material& m = scene.appearance.materials.at(static_cast<std::size_t>(material));
  const int count = m.shader->registers();
  py::array_t<double> out({height, width, count, 3});
  double* at = out.mutable_data();
  std::fill(at, at + out.size(), std::numeric_limits<double>::quiet_NaN());
  std::vector<Color<T>> constants, registers(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < m.constants.size(); ++i) {
    Color<T> c(m.constants[i]);
    if constexpr (!std::is_floating_point_v<T>)
      if (static_cast<int>(i) == constant)
        c = map(m.constants[i], [](double x) { return T::variable(x, 0); });
    constants.push_back(c);
  }
  const PixelCamera pixels(camera, width, height);
  const CameraPlace seen_from = CameraPlace::of(camera);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x, at += 3 * count) {
      const float* place = places ? places + 2 * (y * width + x) : nullptr;
      const float px = place ? place[0] : static_cast<float>(x) + 0.5f;
      const float py = place ? place[1] : static_cast<float>(y) + 0.5f;
      const Ray ray = pixels.ray(px, py);
      const auto hit = scene.geometry->intersect(ray, kCameraRay);
      if (!hit) continue;
      ShadingPoint point;
      point.geometry = scene.geometry.get();
      point.hit = *hit;
      point.surface = scene.geometry->surface(*hit);
      if (point.surface.material != material) continue;
      point.wi = -ray.direction;
      point.path.length = hit->t - ray.t_min;
      point.camera = &seen_from;
      point.footprint = footprint_of(pixels, px, py, hit->t);
      evaluate<T>(*m.shader, point, constants, registers);
      for (int r = 0; r < count; ++r)
        for (int c = 0; c < 3; ++c) {
          const T& number = registers[static_cast<std::size_t>(r)][c];
          if constexpr (std::is_floating_point_v<T>)
            at[3 * r + c] = static_cast<double>(number);
          else
            at[3 * r + c] = number.d[0];
        }
    }
  return out;
}

/// What arrives at each closure of a material, (height, width, 3) for each input, seen by a camera.
py::list shader_values(const Scene& scene, const std::string& material, const std::string& camera,
                       int width, int height, const std::string& by,
                       const std::optional<Array<float>>& places) {
  if (places) require_shape(*places, "places", {height, width, 2});
  const float* at = places ? places->data() : nullptr;
  const int index = scene.material(material);
  const Material& m = scene.appearance.materials[static_cast<std::size_t>(index)];
  if (!m.shader) throw Refused("", "Material '" + material + "' has no shader", "give it one");
  const Camera& seen = scene.camera(camera);
  const int constant = by.empty() ? -1 : shader_constant(scene.find(material, by).field);
  const py::array_t<double> all =
      by.empty()
          ? register_picture<double>(scene, index, seen, width, height, -1, at)
          : register_picture<Dual<double, 1>>(scene, index, seen, width, height, constant, at);
  py::list closures;
  for (const ShaderClosure& closure : m.shader->closures) {
    py::dict inputs;
    const auto picture = [&](int r) -> py::object {
      if (r < 0) return py::none();
      return all[py::make_tuple(py::ellipsis(), r, py::slice(0, 3, 1))];
    };
    const auto parameters = closure_parameters(closure.kind);
    for (std::size_t i = 0; i < parameters.size(); ++i)
      inputs[py::str(std::string(parameters[i].name))] = picture(closure.inputs[i]);
    const auto kind = std::string(kClosureNames[static_cast<std::size_t>(closure.kind)]);
    closures.append(
        py::dict("kind"_a = kind, "inputs"_a = inputs, "weight"_a = picture(closure.weight),
                 "normal"_a = picture(closure.normal), "tangent"_a = picture(closure.tangent)));
  }
  return closures;
}

}  // namespace

void bind_shaders(py::class_<Scene>& scene) {
  scene
      .def("shader_values", &shader_values, "material"_a, "camera"_a, "width"_a, "height"_a,
           "by"_a = "", "places"_a = py::none(),
           "What a material's shader gives each of its closures at the centres of pixels: "
           "[{kind, inputs: {name: (h,w,3)}, weight, normal, tangent}], NaN where another material "
           "is seen. "
           "`by`: a constant by which all is differentiated instead. `places` (h,w,2): other "
           "places, in pixels from the top left.")
      .def(
          "shader_constants",
          [](const Scene& s, const std::string& material) {
            py::list rows;
            const Material& m =
                s.appearance.materials[static_cast<std::size_t>(s.material(material))];
            if (m.shader)
              for (const ShaderConstant& constant : m.shader->constants) {
                py::dict row = parameter_row(constant.parameter);
                row["owner"] = "material";
                row["width"] = constant.width;
                rows.append(row);
              }
            return rows;
          },
          "material"_a, "The constants of a material's shader, in the form of `parameters`.");
}

}  // namespace selenite
