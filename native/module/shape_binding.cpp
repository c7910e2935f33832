// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cstring>
#include <limits>

#include "fit/shape/shape_job.h"
#include "module/arrays.h"
#include "module/bindings.h"
#include "module/fit_arguments.h"

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

py::dict state_dict(const ShapeJob& job) {
  const ShapeState s = job.state();
  return py::dict(
      "running"_a = s.running, "done"_a = s.done, "error"_a = s.error, "stopped"_a = s.stopped,
      "stopped_because"_a = std::string(stop_text(s.stopped)), "stage"_a = 0,
      "iteration"_a = s.iteration, "own_iteration"_a = s.iteration, "iterations"_a = s.iterations,
      "phase"_a = std::string(phase_text(PhaseKind::kDescent)),
      "phase_fraction"_a = s.iterations > 0 ? static_cast<double>(s.iteration) / s.iterations : 1.0,
      "loss"_a = s.loss, "validation"_a = kNone, "validation_standard_error"_a = kNone,
      "seconds"_a = s.seconds, "seconds_left"_a = s.seconds_left, "values"_a = py::dict());
}

py::dict history_dict(const ShapeJob& job) {
  const std::vector<ShapeRow> rows = job.result()->history;
  const auto k = static_cast<py::ssize_t>(rows.size());
  py::array_t<int> iteration(k);
  py::array_t<double> loss(k), validation(k), error(k), bias({k, py::ssize_t{3}}),
      centre({k, py::ssize_t{3}});
  for (py::ssize_t i = 0; i < k; ++i) {
    const ShapeRow& row = rows[static_cast<std::size_t>(i)];
    iteration.mutable_at(i) = row.iteration;
    loss.mutable_at(i) = row.loss;
    validation.mutable_at(i) = row.loss;
    error.mutable_at(i) = kNone;
    for (int c = 0; c < 3; ++c) bias.mutable_at(i, c) = row.mean_bias[c];
    centre.mutable_at(i, 0) = row.centre.x;
    centre.mutable_at(i, 1) = row.centre.y;
    centre.mutable_at(i, 2) = row.centre.z;
  }
  py::dict centres;
  centres[py::str(name_of(job))] = centre;
  return py::dict("iteration"_a = iteration, "loss"_a = loss, "validation"_a = validation,
                  "validation_standard_error"_a = error, "mean_bias"_a = bias,
                  "values"_a = py::dict(), "field_means"_a = centres);
}

py::dict result_dict(const ShapeJob& job) {
  const std::shared_ptr<const ShapeResult> r = job.result();
  const ShapeState s = job.state();
  py::dict best, last, captures;
  best[py::str(name_of(job))] = vertices_array(r->best);
  last[py::str(name_of(job))] = vertices_array(r->last);
  for (std::size_t i = 0; i < r->residuals.size(); ++i)
    captures[py::str(job.photos()[i].id)] =
        py::dict("residual_rms"_a = r->residuals[i], "unexplained"_a = kNone);
  const double start = r->history.empty() ? kNone : r->history.front().loss;
  return py::dict(
      "values_last"_a = py::dict(), "values_best"_a = py::dict(), "fields_last"_a = last,
      "fields_best"_a = best, "best_iteration"_a = r->best_iteration,
      "best_validation"_a = r->best_loss, "best_validation_standard_error"_a = kNone,
      "captures"_a = captures, "start_validation"_a = start, "kept_start"_a = false,
      "model_error"_a = py::dict("relative"_a = 0.0, "absolute"_a = 0.0, "shift"_a = 0.0),
      "iterations"_a = r->iterations, "stopped"_a = s.stopped,
      "stopped_because"_a = std::string(stop_text(s.stopped)), "error"_a = s.error,
      "optimiser"_a = "large-steps", "samples"_a = r->samples, "seconds"_a = s.seconds,
      "cpu_seconds"_a = r->cpu_seconds, "dropped"_a = 0,
      "search"_a = py::dict("points"_a = 0, "moved"_a = false, "start_loss"_a = start,
                            "loss"_a = start, "standard_error"_a = kNone),
      "report"_a =
          py::dict("parameters"_a = py::dict(), "passes"_a = 0, "weak_directions"_a = py::list(),
                   "alternative_minima"_a = py::list(), "ambiguous"_a = py::list(),
                   "misfit"_a = py::dict("value"_a = kNone, "standard_error"_a = kNone,
                                         "explained"_a = false)),
      "history"_a = history_dict(job));
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
    throw InvalidArgument("Object '" + object + "': " + std::to_string(placed.size()) +
                          " positions for " + std::to_string(mesh.positions.size()) +
                          " vertices; give one for each of them");
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
      .def("state", &state_dict, "As of Fit.")
      .def("preview", &preview_array, "photo_index"_a, "As of Fit.")
      .def(
          "history", [](const ShapeJob& job, bool) { return history_dict(job); },
          "of_stage"_a = false, "As of Fit.")
      .def(
          "result", &result_dict,
          R"(As of Fit, without single values: fields {"Body:vertex_positions": (n, 3) float32}, in the
object's own space.)");
}

}  // namespace selenite
