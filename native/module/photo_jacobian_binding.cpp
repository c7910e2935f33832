// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include <cstring>

#include "fit/inference/fisher_information.h"
#include "module/arrays.h"
#include "module/bindings.h"

namespace py = pybind11;
using namespace pybind11::literals;

namespace selenite {
namespace {

py::array_t<double> vector_array(const Vector& v) {
  return py::array_t<double>(static_cast<py::ssize_t>(v.size()), v.data());
}

/// (n, height, width, 3)
py::array_t<float> jacobian_array(const Jacobian& jacobian, const PhotoJacobian& seen) {
  py::array_t<float> out({static_cast<py::ssize_t>(jacobian.cols()), py::ssize_t{seen.height},
                          py::ssize_t{seen.width}, py::ssize_t{3}});
  std::memcpy(out.mutable_data(), jacobian.data(),
              static_cast<std::size_t>(jacobian.size()) * sizeof(float));
  return out;
}

py::dict reparametrization_dict(const Scene& scene, const std::vector<UnknownParameter>& asked) {
  const Unknowns unknowns(scene, asked);
  const Reparametrization reparametrization(unknowns);
  py::list names;
  for (const Component& component : unknowns.components()) names.append(component.name);
  return py::dict(
      "names"_a = names, "slope"_a = vector_array(reparametrization.slope(unknowns.start())),
      "range"_a = vector_array(reparametrization.maximum() - reparametrization.minimum()));
}

py::array_t<float> variance_array(const PhotoJacobian& seen) {
  py::array_t<float> out({seen.height, seen.width, 3});
  std::memcpy(out.mutable_data(), seen.variance.data(),
              static_cast<std::size_t>(seen.variance.size()) * sizeof(float));
  return out;
}

py::array_t<int> first_hits(const Scene& scene, const Array<double>& starts,
                            const Array<double>& ends) {
  const auto from = rows<Vec3d>(starts, "starts"), to = rows<Vec3d>(ends, "ends");
  if (from.size() != to.size())
    throw Refused(
        "first_hits",
        std::to_string(from.size()) + " starts and " + std::to_string(to.size()) + " ends",
        "give as many of both");
  py::array_t<int> found(static_cast<py::ssize_t>(from.size()));
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Vec3d way = to[i] - from[i];
    const double distance = length(way);
    if (!(distance > 0) || !std::isfinite(distance))
      throw Refused("first_hits",
                    "start and end " + std::to_string(i) + " are not two different finite points");
    const Ray ray{Vec3f(from[i] - scene.geometry->origin()), Vec3f(way / distance), 0,
                  static_cast<float>(distance)};
    const std::optional<Hit> hit = scene.geometry->intersect(ray, kCameraRay);
    found.mutable_at(static_cast<py::ssize_t>(i)) = hit ? hit->instance : -1;
  }
  return found;
}

}  // namespace

void bind_photo_jacobian(py::module_& m) {
  m.def("first_hits", &first_hits, "scene"_a, "starts"_a, "ends"_a,
        R"((n, 3) and (n, 3) world points -> (n,) int: the object, counted as in Scene.objects, that
a camera at the start sees first before the end; -1: none. ValueError: a start is its end, or the
shapes differ.)");
  m.def(
      "reparametrization", &reparametrization_dict, "scene"_a, "unknowns"_a,
      R"(The reparametrization in which a fit steps: dict of {names: ["Body:ior"], slope: d value / d
coordinate at the values, range: between the bounds}, each by component.

unknowns: list of Unknown, at the values that they start at. Raises ValueError, KeyError.)");
  py::class_<PhotoJacobian>(m, "PhotoJacobian", R"(What a camera shows of the unknowns at their
values: image and variance (of one sample), (height, width, 3); jacobian_a, jacobian_b, (n, height,
width, 3), d picture / d coordinate by component over even and odd samples; spp; dropped; not_finite:
names of components.)")
      .def_property_readonly("image",
                             [](const PhotoJacobian& seen) {
                               return picture_array(seen.mean, seen.width, seen.height);
                             })
      .def_property_readonly("variance", &variance_array)
      .def_property_readonly("jacobian_a",
                             [](const PhotoJacobian& seen) {
                               return jacobian_array(instrumental_variables(seen).plain().a.slopes,
                                                     seen);
                             })
      .def_property_readonly("jacobian_b",
                             [](const PhotoJacobian& seen) {
                               return jacobian_array(instrumental_variables(seen).plain().b.slopes,
                                                     seen);
                             })
      .def_readonly("dropped", &PhotoJacobian::dropped)
      .def_property_readonly("spp", &PhotoJacobian::spp)
      .def("join", &PhotoJacobian::join, "other"_a,
           "Adds the samples of another one of the same camera, unknowns and size.")
      .def_readonly("not_finite", &PhotoJacobian::not_finite);
}

}  // namespace selenite
