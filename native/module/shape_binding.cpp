// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <limits>
#include <utility>

#include "fit/shape/shape_job.h"
#include "module/arrays.h"
#include "module/bindings.h"
#include "module/fit_arguments.h"
#include "module/fit_result.h"

namespace py = pybind11;
using namespace pybind11::literals;

namespace selenite {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::unique_ptr<ShapeJob> make_job(const Scene& scene, std::vector<Photo> photos,
                                   const std::string& object, const py::dict& settings,
                                   double learning_rate, double minimum, double maximum,
                                   double smoothness) {
  const FitSettings with = settings_of(settings);
  const py::gil_scoped_release release;
  return std::make_unique<ShapeJob>(
      scene, std::move(photos),
      UnknownVertices{object, minimum, maximum, learning_rate, smoothness}, with);
}

py::array_t<float> vertices_array(const VertexMatrix& vertices) {
  py::array_t<float> array({static_cast<py::ssize_t>(vertices.rows()), py::ssize_t{3}});
  for (py::ssize_t v = 0; v < array.shape(0); ++v)
    for (py::ssize_t axis = 0; axis < 3; ++axis)
      array.mutable_at(v, axis) = static_cast<float>(vertices(v, axis));
  return array;
}

std::string name_of(const ShapeJob& job) { return job.unknown().object + ":" + kVertexPositions; }

FitProgress progress_of(const ShapeJob& job) {
  const ShapeState s = job.state();
  FitState state;
  state.running = s.running;
  state.done = s.done;
  state.faults = s.faults;
  state.stopped = s.stopped;
  state.phase_fraction = s.iterations > 0 ? static_cast<double>(s.iteration) / s.iterations : 1.0;
  state.iteration = state.own_iteration = s.iteration;
  state.iterations = s.iterations;
  state.loss = s.loss;
  state.validation = state.validation_standard_error = kNone;
  state.seconds = s.seconds;
  state.seconds_left = s.seconds_left;
  return {std::move(state), stop_text(s.stopped), {}};
}

FitHistory history_of(const ShapeJob& job) {
  const std::vector<ShapeRow>& rows = job.result()->history;
  const auto k = static_cast<py::ssize_t>(rows.size());
  py::array_t<int> iteration(k);
  py::array_t<double> loss(k), error(k), bias({k, py::ssize_t{3}}), centre({k, py::ssize_t{3}});
  for (py::ssize_t i = 0; i < k; ++i) {
    const ShapeRow& row = rows[static_cast<std::size_t>(i)];
    iteration.mutable_at(i) = row.iteration;
    loss.mutable_at(i) = row.loss;
    error.mutable_at(i) = kNone;
    for (int c = 0; c < 3; ++c) bias.mutable_at(i, c) = row.mean_bias[c];
    centre.mutable_at(i, 0) = row.centre.x;
    centre.mutable_at(i, 1) = row.centre.y;
    centre.mutable_at(i, 2) = row.centre.z;
  }
  py::dict centres;
  centres[py::str(name_of(job))] = centre;
  return {iteration, loss, loss, error, bias, py::dict(), centres, {}};
}

FoundFit found_by(const ShapeJob& job) {
  const std::shared_ptr<const ShapeResult> r = job.result();
  const ShapeState s = job.state();
  FoundFit found;
  found.fields_last[py::str(name_of(job))] = vertices_array(r->last);
  found.fields_best[py::str(name_of(job))] = vertices_array(r->best);
  found.best_iteration = r->best_iteration;
  found.best_validation = r->best_loss;
  found.best_validation_standard_error = kNone;
  found.start_validation = r->history.empty() ? kNone : r->history.front().loss;
  for (std::size_t i = 0; i < r->residuals.size(); ++i)
    found.captures[py::str(job.photos()[i].id)] = FoundPhoto{r->residuals[i], kNone, {}, {}, {}};
  found.iterations = r->iterations;
  found.stopped = s.stopped;
  found.stopped_because = stop_text(s.stopped);
  found.faults = s.faults;
  found.optimiser = "large-steps";
  found.counts.samples = r->samples;
  found.counts.cpu_seconds = r->cpu_seconds;
  found.seconds = s.seconds;
  found.search.start_loss = found.search.loss = found.start_validation;
  found.search.standard_error = kNone;
  found.report.misfit = {kNone, kNone, false};
  found.history = history_of(job);
  return found;
}

py::object preview_array(const ShapeJob& job, int index) {
  const std::shared_ptr<const Picture> picture = job.preview(index);
  if (!picture) return py::none();
  const Photo& photo = job.photos()[static_cast<std::size_t>(index)];
  return picture_array(*picture, photo.width, photo.height);
}

py::object taken_state(ShapeJob& job) {
  const std::shared_ptr<const std::string> saved = job.take_state();
  return saved ? py::object(py::bytes(*saved)) : py::none();
}

/// The scene's mesh of an object, in its own space.
py::array_t<float> vertices(const Scene& scene, const std::string& object) {
  const int instance = movable_object(scene, object);
  const Geometry& geometry = *scene.geometry;
  const auto& positions = geometry.meshes()[geometry.instances()[instance].mesh].positions;
  VertexMatrix own(static_cast<Eigen::Index>(positions.size()), 3);
  for (Eigen::Index v = 0; v < own.rows(); ++v) {
    const Vec3d p =
        geometry.to_object(instance).point(Vec3d(positions[static_cast<std::size_t>(v)]));
    own.row(v) << p.x, p.y, p.z;
  }
  return vertices_array(own);
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

void bind_shape(py::module_& m) {
  py::class_<ShapeJob>(
      m, "ShapeFit", py::release_gil_before_calling_cpp_dtor(),
      R"(A fit of the vertices of an object to photos, in a native thread of its own.

Args:
    scene, photos: as of Fit; no gain or alignment is free.
    object: its name; its mesh has no other user.
    settings: as of Fit: loss, iterations, spp, seed, depth and threads count.
    learning_rate: largest step, in diagonals of the object's bounding box.
    minimum, maximum: no vertex leaves that box with its ends moved by so many of its sizes.
    smoothness: how large a part of the surface moves together; 0: each vertex for itself.
Raises:
    ValueError, KeyError: all problems at once, one line each; nothing is started.)")
      .def(py::init(&make_job), "scene"_a, "photos"_a, "object"_a, "settings"_a = py::dict(),
           py::kw_only(), "learning_rate"_a = 0.01, "minimum"_a = -0.5, "maximum"_a = 0.5,
           "smoothness"_a = 0.01)
      .def("start", &ShapeJob::start, "As of Fit.")
      .def("cancel", &ShapeJob::cancel, "As of Fit.")
      .def("join", &ShapeJob::join, py::call_guard<py::gil_scoped_release>(), "As of Fit.")
      .def("request_state", &ShapeJob::request_state, "As of Fit.")
      .def("take_state", &taken_state, "As of Fit.")
      .def(
          "restore",
          [](ShapeJob& job, const py::bytes& saved, double seconds) {
            job.restore(std::string_view(saved), seconds);
          },
          "state"_a, "seconds"_a = 0.0, "As of Fit.")
      .def("progress", py::overload_cast<const ShapeJob&>(&progress_of), "As of Fit.")
      .def("preview", &preview_array, "photo_index"_a, "As of Fit.")
      .def(
          "history", [](const ShapeJob& job, bool) { return history_of(job); },
          "of_stage"_a = false, "As of Fit.")
      .def(
          "result", py::overload_cast<const ShapeJob&>(&found_by),
          R"(As of Fit, without single values: fields {"Body:vertex_positions": (n, 3) float32}, in the
object's own space.)");
}

}  // namespace selenite
