// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "module/arrays.h"
#include "module/bindings.h"
#include "render/shape/shape_gradient.h"

namespace py = pybind11;
using namespace pybind11::literals;

namespace selenite {
namespace {

/// The scene's mesh of an object, in its own space.
py::array_t<float> vertices(const Scene& scene, const std::string& object) {
  const int instance = movable_object(scene, object);
  const Geometry& geometry = *scene.geometry;
  const auto& positions = geometry.meshes()[geometry.instances()[instance].mesh].positions;
  py::array_t<float> own({std::ssize(positions), py::ssize_t{3}});
  for (py::ssize_t v = 0; v < own.shape(0); ++v) {
    const Vec3d p =
        geometry.to_object(instance).point(Vec3d(positions[static_cast<std::size_t>(v)]));
    own.mutable_at(v, 0) = static_cast<float>(p.x);
    own.mutable_at(v, 1) = static_cast<float>(p.y);
    own.mutable_at(v, 2) = static_cast<float>(p.z);
  }
  return own;
}

Scene moved_scene(const Scene& scene, const std::string& object, const Array<float>& positions) {
  const int instance = movable_object(scene, object);
  const Geometry& geometry = *scene.geometry;
  std::vector<Vec3f> placed = rows<Vec3f>(positions, "Object '" + object + "': positions");
  for (Vec3f& p : placed) p = Vec3f(geometry.instances()[instance].to_world.point(Vec3d(p)));
  const Mesh& mesh = geometry.meshes()[geometry.instances()[instance].mesh];
  if (placed.size() != mesh.positions.size())
    throw Refused("Object '" + object + "'",
                  std::to_string(placed.size()) + " positions for " +
                      std::to_string(mesh.positions.size()) + " vertices",
                  "give one for each of them");
  return with_vertices(scene, instance, VertexNormals(mesh), placed);
}

}  // namespace

void bind_vertices(py::class_<Scene>& scene) {
  scene
      .def("vertices", &vertices, "object"_a,
           "(n, 3) float32: the vertices of an object in its own space. Raises KeyError, "
           "ValueError.")
      .def(
          "with_vertices", &moved_scene, "object"_a, "positions"_a,
          R"(This scene with other vertices of an object, (n, 3) in its own space. Corners that share a
normal go on sharing it. Raises KeyError, ValueError.)");
}

}  // namespace selenite
