// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "fit/run/fit_job.h"
#include "math/error.h"
#include "module/bindings.h"
#include "module/fit_arguments.h"

namespace py = pybind11;
using namespace pybind11::literals;

namespace selenite {
namespace {

std::unique_ptr<FitJob> make_fit(const Scene& scene, std::vector<Photo> photos,
                                 const std::vector<UnknownParameter>& unknowns,
                                 const py::dict& settings) {
  const FitSettings with = settings_of(settings);
  const py::gil_scoped_release release;
  return std::make_unique<FitJob>(scene, std::move(photos), unknowns, with);
}

py::dict values_dict(const Unknowns& unknowns, const Vector& x) {
  py::dict values;
  for (std::size_t i = 0; i < unknowns.names().size(); ++i)
    values[py::str(unknowns.names()[i])] = unknowns.values_of(static_cast<int>(i), x);
  return values;
}

/// Float32 by name: (nz, ny, nx, channels) of a grid, (height, width, 3) of an image.
py::dict fields_dict(const Fields& fields, const FieldValues& values) {
  py::dict arrays;
  for (std::size_t f = 0; f < fields.names().size(); ++f) {
    py::array_t<float> array(fields.shape(f));
    for (Eigen::Index i = 0; i < values[f].size(); ++i)
      array.mutable_data()[i] = static_cast<float>(values[f][i]);
    arrays[py::str(fields.names()[f])] = array;
  }
  return arrays;
}

py::dict state_dict(const FitJob& job) {
  const FitState s = job.state();
  return py::dict(
      "running"_a = s.running, "done"_a = s.done, "error"_a = s.error,
      "stopped_because"_a = s.stopped_because, "iteration"_a = s.iteration,
      "iterations"_a = s.iterations, "phase"_a = s.phase, "phase_fraction"_a = s.phase_fraction,
      "loss"_a = s.loss, "validation"_a = s.validation,
      "validation_standard_error"_a = s.validation_standard_error, "seconds"_a = s.seconds,
      "seconds_left"_a = s.seconds_left, "values"_a = values_dict(job.unknowns(), s.values));
}

/// One array per column: (k,), (k, 3) for the bias, (k, width) for each parameter.
py::dict history_dict(const FitJob& job, const std::vector<HistoryRow>& rows) {
  const auto k = static_cast<py::ssize_t>(rows.size());
  py::array_t<int> iteration(k);
  py::array_t<double> loss(k), validation(k), error(k), bias({k, py::ssize_t{3}});
  const auto& components = job.unknowns().components();
  std::vector<py::array_t<double>> columns;
  for (std::size_t i = 0; i < job.unknowns().names().size(); ++i) {
    const auto width = job.unknowns().values_of(static_cast<int>(i), job.unknowns().start()).size();
    columns.emplace_back(std::vector<py::ssize_t>{k, static_cast<py::ssize_t>(width)});
  }
  for (py::ssize_t i = 0; i < k; ++i) {
    const HistoryRow& row = rows[static_cast<std::size_t>(i)];
    iteration.mutable_at(i) = row.iteration;
    loss.mutable_at(i) = row.loss;
    validation.mutable_at(i) = row.validation;
    error.mutable_at(i) = row.validation_standard_error;
    for (int c = 0; c < 3; ++c) bias.mutable_at(i, c) = row.mean_bias[c];
    for (std::size_t j = 0; j < components.size(); ++j)
      columns[static_cast<std::size_t>(components[j].parameter)].mutable_at(
          i, components[j].index) = row.values[static_cast<Eigen::Index>(j)];
  }
  py::dict values;
  for (std::size_t i = 0; i < columns.size(); ++i)
    values[py::str(job.unknowns().names()[i])] = columns[i];
  py::dict means;
  for (std::size_t f = 0; f < job.fields().names().size(); ++f) {
    py::array_t<double> column({k, py::ssize_t{3}});
    for (py::ssize_t i = 0; i < k; ++i)
      for (int c = 0; c < 3; ++c)
        column.mutable_at(i, c) = rows[static_cast<std::size_t>(i)].field_means[f][c];
    means[py::str(job.fields().names()[f])] = column;
  }
  return py::dict("iteration"_a = iteration, "loss"_a = loss, "validation"_a = validation,
                  "validation_standard_error"_a = error, "mean_bias"_a = bias, "values"_a = values,
                  "field_means"_a = means);
}

py::dict search_dict(const MultiStartResult& r) {
  return py::dict("points"_a = r.points, "moved"_a = r.moved, "start_loss"_a = r.start_loss,
                  "loss"_a = r.loss, "standard_error"_a = r.standard_error);
}

/// Per parameter lists over its components; {} where nothing was verified.
py::dict report_dict(const FitJob& job, const TrustReport& report) {
  const Unknowns& unknowns = job.unknowns();
  py::dict parameters;
  for (std::size_t i = 0; i < unknowns.names().size() && !report.components.empty(); ++i) {
    py::list errors, intervals, determined, bounds, correlated;
    for (std::size_t k = 0; k < unknowns.components().size(); ++k) {
      if (unknowns.components()[k].parameter != static_cast<int>(i)) continue;
      const Confidence& one = report.components[k];
      errors.append(one.standard_error);
      intervals.append(std::vector<double>(one.interval.begin(), one.interval.end()));
      determined.append(one.determined);
      bounds.append(one.at_bound == AtBound::kMinimum   ? py::object(py::str("minimum"))
                    : one.at_bound == AtBound::kMaximum ? py::object(py::str("maximum"))
                                                        : py::none());
      correlated.append(
          one.correlated_with < 0
              ? py::none()
              : py::object(py::str(
                    unknowns.components()[static_cast<std::size_t>(one.correlated_with)].name)));
    }
    parameters[py::str(unknowns.names()[i])] = py::dict(
        "standard_error"_a = errors, "interval_90"_a = intervals, "determined"_a = determined,
        "at_bound"_a = bounds, "correlated_with"_a = correlated);
  }
  py::list alternatives, ambiguous;
  for (const Vector& x : report.alternatives) alternatives.append(values_dict(unknowns, x));
  for (const int k : report.ambiguous)
    ambiguous.append(unknowns.components()[static_cast<std::size_t>(k)].name);
  py::list weak;
  for (const WeakDirection& one : report.weak) {
    py::list components, photos;
    for (const int k : one.components)
      components.append(unknowns.components()[static_cast<std::size_t>(k)].name);
    for (const int p : one.photos) photos.append(job.photos()[static_cast<std::size_t>(p)].id);
    weak.append(py::dict("deviation"_a = one.deviation, "components"_a = components,
                         "captures"_a = photos));
  }
  return py::dict("parameters"_a = parameters, "passes"_a = report.passes,
                  "weak_directions"_a = weak, "alternative_minima"_a = alternatives,
                  "ambiguous"_a = ambiguous,
                  "misfit"_a = py::dict("value"_a = report.misfit.value,
                                        "standard_error"_a = report.misfit.standard_error,
                                        "explained"_a = report.misfit.explained));
}

py::dict captures_dict(const FitJob& job, const std::vector<PhotoReport>& reports) {
  py::dict found;
  for (std::size_t i = 0; i < reports.size(); ++i) {
    const Photo& photo = job.photos()[i];
    const auto& [gain, error, alignment, rms, unexplained] = reports[i];
    py::dict one("residual_rms"_a = rms, "unexplained"_a = unexplained);
    if (photo.align) one["shift"] = py::make_tuple(alignment.x, alignment.y, alignment.roll);
    if (photo.gain_freedom != GainFreedom::kNone) {
      py::list interval;
      for (int c = 0; c < 3; ++c) {
        const double wide = std::exp(kQuantile90 * error[c] / gain[c]);
        interval.append(py::make_tuple(gain[c] / wide, gain[c] * wide));
      }
      one["gain"] = py::make_tuple(gain.r, gain.g, gain.b);
      one["gain_interval_90"] = interval;
    }
    found[py::str(photo.id)] = one;
  }
  return found;
}

py::dict result_dict(const FitJob& job) {
  const FitResult r = job.result();
  const FitState s = job.state();
  return py::dict(
      "values_last"_a = values_dict(job.unknowns(), r.last),
      "values_best"_a = values_dict(job.unknowns(), r.best),
      "fields_last"_a = fields_dict(job.fields(), *r.fields_last),
      "fields_best"_a = fields_dict(job.fields(), *r.fields_best),
      "best_iteration"_a = r.best_iteration, "best_validation"_a = r.best_validation,
      "best_validation_standard_error"_a = r.best_validation_standard_error,
      "captures"_a = captures_dict(job, r.photos), "start_validation"_a = r.start_validation,
      "kept_start"_a = r.kept_start,
      "model_error"_a =
          py::dict("relative"_a = r.model_error.relative, "absolute"_a = r.model_error.absolute,
                   "shift"_a = r.model_error.shift),
      "iterations"_a = r.iterations, "stopped_because"_a = s.stopped_because, "error"_a = s.error,
      "optimiser"_a = job.optimiser_name(), "samples"_a = r.samples, "seconds"_a = s.seconds,
      "cpu_seconds"_a = r.cpu_seconds, "dropped"_a = r.dropped, "search"_a = search_dict(r.search),
      "report"_a = report_dict(job, r.report), "history"_a = history_dict(job, r.history));
}

py::object preview_array(const FitJob& job, int index) {
  const std::shared_ptr<const Picture> picture = job.preview(index);
  if (!picture) return py::none();
  const Photo& photo = job.photos()[static_cast<std::size_t>(index)];
  py::array_t<float> array({photo.height, photo.width, 3});
  std::memcpy(array.mutable_data(), picture->data(), picture->size() * sizeof(Colorf));
  return array;
}

/// Copied without the GIL, as it may be large.
py::object taken_state(FitJob& job) {
  const std::shared_ptr<const std::string> saved = job.take_state();
  if (!saved) return py::none();
  auto bytes = py::reinterpret_steal<py::object>(
      PyBytes_FromStringAndSize(nullptr, static_cast<py::ssize_t>(saved->size())));
  if (!bytes) throw py::error_already_set();
  char* to = PyBytes_AsString(bytes.ptr());
  {
    const py::gil_scoped_release release;
    std::copy(saved->begin(), saved->end(), to);
  }
  return bytes;
}

py::list loss_table() {
  py::list rows;
  for (const Loss& loss : losses())
    rows.append(py::dict("name"_a = std::string(loss.name), "title"_a = std::string(loss.title),
                         "help"_a = std::string(loss.help), "least_spp"_a = loss.least_spp));
  return rows;
}

py::list optimiser_table() {
  py::list rows;
  for (const OptimiserKind& kind : optimisers())
    rows.append(py::dict("name"_a = std::string(kind.name), "help"_a = std::string(kind.help),
                         "least_spp"_a = kind.least_spp));
  return rows;
}

}  // namespace

void bind_fit(py::module_& m) {
  m.def("losses", &loss_table, "The losses: list of dict {name, title, help, least_spp}.");
  m.def("optimisers", &optimiser_table, "The optimisers: list of dict {name, help, least_spp}.");

  // The destructor waits for the fit's thread to reach the end of a tile: not with the GIL held.
  py::class_<FitJob>(m, "Fit", py::release_gil_before_calling_cpp_dtor(),
                     R"(A fit of scene parameters to photos, in a native thread of its own.

Args:
    scene: copied; later changes of the argument do not matter.
    photos: list of Photo.
    unknowns: list of Unknown; a search moves an albedo grid or an image of one colour as a whole, and
        its first step is four times as long, the last one of an image a quarter.
    settings: dict; what is left out keeps its default: loss "robust" (see losses()), optimiser
        "auto" (see optimisers()), iterations 100, most_iterations 0 (up to where scalars that have
        not converged go on; 0: no farther), spp 4, tolerance 0.001 (0: never), seed 0,
        depth 0 (no limit), threads 0 (all cores), accumulate True (one step for all cameras),
        validation_interval 5 (beside grids and images after a search: where turns begin),
        validation_spp 0 (twice spp, at least 16), search "auto" (with
        Gauss-Newton; beside grids and images where each holds one colour, one is of albedos or base
        colours, and there are up to 12 numbers with these as three; or "on", "off"), refinement
        "auto" (with up to 12 unknowns and no grid or image; or "on", "off"),
        refinement_spp 0 (as many as the iterations took, at least 64), finite_differences True (differences
        of pictures in place of derivatives: by IOR, in Gauss-Newton steps by roughness and
        extinction too).
Raises:
    ValueError, KeyError: all problems at once, one line each; nothing is started.)")
      .def(py::init(&make_fit), "scene"_a, "photos"_a, "unknowns"_a, "settings"_a = py::dict())
      .def("start", &FitJob::start, "Starts the thread. ValueError when started before.")
      .def("cancel", &FitJob::cancel, "Asks it to stop; polled per tile. What was found stays.")
      .def("join", &FitJob::join, py::call_guard<py::gil_scoped_release>(), "Waits for the end.")
      .def("request_state", &FitJob::request_state,
           "Asks for the whole state after the iteration that runs; see take_state.")
      .def("take_state", &taken_state,
           "The state that was asked for, as bytes, once it is there; else None.")
      .def(
          "restore",
          [](FitJob& job, const py::bytes& saved, double seconds) {
            job.restore(std::string_view(saved), seconds);
          },
          "state"_a, "seconds"_a = 0.0,
          R"(Before start: goes on from the state of a fit with the same arguments, to the same bits
as that one would have had. seconds: what it had taken.

Raises:
    ValueError: the bytes are damaged, or of a fit with other arguments or another version.)")
      .def("state", &state_dict,
           R"(Cheap, at any time: dict {running, done, error, stopped_because, phase ("multi-start",
"descent", "refinement"), phase_fraction, iteration, iterations, loss, validation, validation_standard_error,
seconds, seconds_left (NaN: unknown yet), values
{"Body:roughness": [..]}}. A failure of the fit is reported here, never raised.)")
      .def("preview", &preview_array, "photo_index"_a,
           "Newest picture of a photo, (h, w, 3) float32, or None before the first.")
      .def(
          "history", [](const FitJob& job) { return history_dict(job, job.result().history); },
          "That of `result` alone, at any time: what plots want, without a copy of the fields.")
      .def(
          "result", &result_dict,
          R"(dict {values_last, values_best, fields_last, fields_best, best_iteration, best_validation,
best_validation_standard_error, captures {photo: {residual_rms, unexplained, and of a free gain: gain (r, g, b), gain_interval_90, of one that is aligned: shift (x, y in pixels, roll in radians)}}, start_validation, kept_start, model_error {relative, absolute, shift},
iterations, stopped_because, error, optimiser, samples, seconds,
cpu_seconds, dropped, search, report, history}. Best are the newest values whose loss, in a render with fixed
seed and more samples, is not worse than the smallest one by more than its noise.
fields: {"Body:albedo_grid": (nz, ny, nx, channels) float32}.
search: {points (0: none), moved, start_loss, loss, standard_error}.
report: {parameters: {"Body:roughness": {standard_error, interval_90, determined, at_bound ("minimum",
"maximum", None), correlated_with}}, each a list by component; passes (0: no refinement); misfit:
{value, standard_error, explained}; alternative_minima: values far from the best that explain the photos as well,
each {"Body:roughness": [..]}; ambiguous: components ("Body:base_color[1]") determined but for them; weak_directions: what makes up for
what, the widest first, each {deviation: standard deviation along it in ranges, components, captures: whose
gains follow it}}.
history: iteration (k,), loss (k,), validation (k,) and its standard error (NaN where not done),
mean_bias (k, 3) render minus photo, field_means {"Body:albedo_grid": (k, 3)}, values {"Body:roughness": (k, width)}; the last row is the
final state, its loss taken from the validation render.)");
}

}  // namespace selenite
