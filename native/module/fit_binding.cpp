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

Stage make_stage(const std::string& name, std::vector<std::string> parameters,
                 std::vector<std::string> fields, const Scene& scene, std::vector<Photo> photos,
                 const py::dict& settings) {
  return {name,  std::move(parameters), std::move(fields),
          scene, std::move(photos),     settings_of(settings)};
}

py::dict values_dict(const Unknowns& unknowns, const Vector& x) {
  py::dict values;
  for (std::size_t i = 0; i < unknowns.names().size(); ++i)
    values[py::str(unknowns.names()[i])] = unknowns.values_of(static_cast<int>(i), x);
  return values;
}

py::dict values_dict(const RunPoint& point) {
  py::dict values;
  for (const auto& [name, numbers] : point.scalars) values[py::str(name)] = numbers;
  return values;
}

/// Float32 by name: (nz, ny, nx, channels) of a grid, (height, width, 3) of an image.
py::dict fields_dict(const RunUnknowns& unknowns, const RunPoint& point) {
  py::dict arrays;
  for (const auto& [name, values] : point.fields) {
    py::array_t<float> array(unknowns.shape(name));
    for (Eigen::Index i = 0; i < values.size(); ++i)
      array.mutable_data()[i] = static_cast<float>(values[i]);
    arrays[py::str(name)] = array;
  }
  return arrays;
}

std::string stopped_because(StopReason reason, const std::string& message) {
  std::string text = stop_text(reason);
  if (reason == StopReason::kDropped) text += ": " + message;
  return text;
}

py::dict state_dict(const FitJob& job) {
  const FitState s = job.state();
  return py::dict(
      "running"_a = s.running, "done"_a = s.done, "error"_a = s.error, "stopped"_a = s.stopped,
      "stopped_because"_a = stopped_because(s.stopped, s.message), "stage"_a = s.stage,
      "iteration"_a = s.iteration, "own_iteration"_a = s.own_iteration,
      "iterations"_a = s.iterations, "phase"_a = phase_text(s.phase),
      "phase_fraction"_a = s.phase_fraction, "loss"_a = s.loss, "validation"_a = s.validation,
      "validation_standard_error"_a = s.validation_standard_error, "seconds"_a = s.seconds,
      "seconds_left"_a = s.seconds_left, "values"_a = values_dict(s.values));
}

/// The stages that have begun, the newest last.
std::vector<const EndedStage*> stages_of(const RunResult& run) {
  std::vector<const EndedStage*> stages;
  for (const auto& one : run.ended) stages.push_back(one.get());
  stages.push_back(&run.newest);
  return stages;
}

/// One array per column: (k,), (k, 3) for the bias, (k, width) for each parameter. Iterations count
/// over all stages; a stage's first row has the number of the last one of the stage before it. What
/// a stage does not fit keeps its value.
py::dict history_dict(const FitJob& job, const RunResult& run) {
  const std::vector<const EndedStage*> stages = stages_of(run);
  py::ssize_t k = 0;
  for (const EndedStage* one : stages) k += std::ssize(one->result.history);
  py::array_t<int> stage(k), iteration(k);
  py::array_t<double> loss(k), validation(k), error(k), bias({k, py::ssize_t{3}});
  RunPoint point = job.unknowns().start();
  std::vector<py::array_t<double>> columns, means;
  for (const auto& [name, numbers] : point.scalars)
    columns.emplace_back(std::vector<py::ssize_t>{k, std::ssize(numbers)});
  std::vector<Color<double>> mean;
  for (const auto& [name, values] : point.fields) {
    means.emplace_back(std::vector<py::ssize_t>{k, 3});
    mean.push_back(job.unknowns().mean(name, values));
  }
  py::ssize_t i = 0;
  int done = 0, number = 0;
  for (const EndedStage* one : stages) {
    ++number;
    const std::vector<std::string>& fields = one->problem->fields().names();
    for (const HistoryRow& row : one->result.history) {
      stage.mutable_at(i) = number;
      iteration.mutable_at(i) = done + row.iteration;
      loss.mutable_at(i) = row.loss;
      validation.mutable_at(i) = row.validation;
      error.mutable_at(i) = row.validation_standard_error;
      for (int c = 0; c < 3; ++c) bias.mutable_at(i, c) = row.mean_bias[c];
      RunPoint at{point.scalars, {}};
      at.take(*one->problem, row.values, {});
      for (std::size_t j = 0; j < columns.size(); ++j)
        for (std::size_t c = 0; c < at.scalars[j].second.size(); ++c)
          columns[j].mutable_at(i, static_cast<py::ssize_t>(c)) = at.scalars[j].second[c];
      for (std::size_t f = 0; f < means.size(); ++f) {
        const auto own = std::ranges::find(fields, point.fields[f].first);
        const Color<double>& there =
            own == fields.end() ? mean[f]
                                : row.field_means[static_cast<std::size_t>(own - fields.begin())];
        for (int c = 0; c < 3; ++c) means[f].mutable_at(i, c) = there[c];
      }
      ++i;
    }
    done += one->result.iterations;
    point.take(*one->problem, one->result.best, *one->result.fields_best);
    for (std::size_t f = 0; f < means.size(); ++f)
      mean[f] = job.unknowns().mean(point.fields[f].first, point.fields[f].second);
  }
  py::dict values, of_fields;
  for (std::size_t j = 0; j < columns.size(); ++j)
    values[py::str(point.scalars[j].first)] = columns[j];
  for (std::size_t f = 0; f < means.size(); ++f)
    of_fields[py::str(point.fields[f].first)] = means[f];
  py::dict found("iteration"_a = iteration, "loss"_a = loss, "validation"_a = validation,
                 "validation_standard_error"_a = error, "mean_bias"_a = bias, "values"_a = values,
                 "field_means"_a = of_fields);
  if (job.stages().size() > 1) found["stage"] = stage;
  return found;
}

py::dict search_dict(const MultiStartResult& r) {
  return py::dict("points"_a = r.points, "moved"_a = r.moved, "start_loss"_a = r.start_loss,
                  "loss"_a = r.loss, "standard_error"_a = r.standard_error);
}

/// Per parameter lists over its components; {} where nothing was verified.
py::dict report_dict(const FitProblem& problem, const TrustReport& report) {
  const Unknowns& unknowns = problem.unknowns();
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
    for (const int p : one.photos) photos.append(problem.photos()[static_cast<std::size_t>(p)].id);
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

py::dict captures_dict(const FitProblem& problem, const std::vector<PhotoReport>& reports) {
  py::dict found;
  for (std::size_t i = 0; i < reports.size(); ++i) {
    const Photo& photo = problem.photos()[i];
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

/// What `stages` says of one of them.
py::dict stage_dict(const Stage& stage, const EndedStage& one, StopReason stopped) {
  const FitResult& r = one.result;
  return py::dict("name"_a = stage.name, "parameters"_a = stage.parameters,
                  "iterations"_a = r.iterations, "spp"_a = stage.settings.spp,
                  "height"_a = stage.photos.front().height, "best_iteration"_a = r.best_iteration,
                  "stopped_because"_a = stopped_because(stopped, r.message),
                  "samples"_a = r.samples, "seconds"_a = one.seconds,
                  "cpu_seconds"_a = r.cpu_seconds,
                  "values"_a = values_dict(one.problem->unknowns(), r.best));
}

py::dict result_dict(const FitJob& job) {
  const RunResult run = job.result();
  const FitState s = job.state();
  const EndedStage& newest = run.newest;
  const FitResult& r = newest.result;
  RunPoint best = *run.point, last = *run.point;
  best.take(*newest.problem, r.best, *r.fields_best);
  last.take(*newest.problem, r.last, *r.fields_last);
  for (RunPoint* point : {&best, &last})
    job.unknowns().fill_waiting(*point, job.stages(), run.ended.size() + 1);
  int before = 0;
  RenderCounts sum = r;
  for (const auto& one : run.ended) {
    before += one->result.iterations;
    sum.samples += one->result.samples;
    sum.dropped += one->result.dropped;
    sum.cpu_seconds += one->result.cpu_seconds;
  }
  const MultiStartResult& search = stages_of(run).front()->result.search;
  py::dict found(
      "values_last"_a = values_dict(last), "values_best"_a = values_dict(best),
      "fields_last"_a = fields_dict(job.unknowns(), last),
      "fields_best"_a = fields_dict(job.unknowns(), best),
      "best_iteration"_a = before + r.best_iteration, "best_validation"_a = r.best_validation,
      "best_validation_standard_error"_a = r.best_validation_standard_error,
      "captures"_a = captures_dict(*newest.problem, r.photos),
      "start_validation"_a = r.start_validation, "kept_start"_a = r.kept_start,
      "model_error"_a =
          py::dict("relative"_a = r.model_error.relative, "absolute"_a = r.model_error.absolute,
                   "shift"_a = r.model_error.shift),
      "iterations"_a = before + r.iterations, "stopped"_a = s.stopped,
      "stopped_because"_a = stopped_because(s.stopped, s.message), "error"_a = s.error,
      "optimiser"_a = newest.optimiser, "samples"_a = sum.samples, "seconds"_a = s.seconds,
      "cpu_seconds"_a = sum.cpu_seconds, "dropped"_a = sum.dropped,
      "search"_a = search_dict(search), "report"_a = report_dict(*newest.problem, r.report),
      "history"_a = history_dict(job, run));
  if (job.stages().size() > 1) {
    py::list stages;
    for (std::size_t i = 0; i < run.ended.size(); ++i)
      stages.append(stage_dict(job.stages()[i], *run.ended[i], run.ended[i]->result.stopped));
    stages.append(stage_dict(job.stages()[run.ended.size()], newest, s.stopped));
    found["stages"] = stages;
  }
  return found;
}

py::object preview_array(const FitJob& job, int index) {
  const std::shared_ptr<const Picture> picture = job.preview(index);
  if (!picture) return py::none();
  const Photo& photo = job.result().newest.problem->photos()[static_cast<std::size_t>(index)];
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

  py::enum_<StopReason>(m, "StopReason", "Why a fit, or a stage of it, has ended.")
      .value("NONE", StopReason::kNone)
      .value("ITERATIONS", StopReason::kIterations)
      .value("CONVERGED", StopReason::kConverged)
      .value("TOLERANCE", StopReason::kTolerance)
      .value("CANCELLED", StopReason::kCancelled)
      .value("DROPPED", StopReason::kDropped)
      .value("ERROR", StopReason::kError);
  py::class_<Stage>(m, "Stage", R"(A part of a fit that finds some of its unknowns.

Args:
    name: as shown.
    parameters: names of the unknowns that it fits, as "Body:roughness".
    fields: names of the fit's grids and images that are in its scene; the others wait for one colour.
    scene, photos, settings: as of Fit.)")
      .def(py::init(&make_stage), "name"_a, "parameters"_a, "fields"_a, "scene"_a, "photos"_a,
           "settings"_a);

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
      .def(
          py::init([](const std::vector<UnknownParameter>& unknowns, std::vector<Stage> stages) {
            const py::gil_scoped_release release;
            return std::make_unique<FitJob>(unknowns, std::move(stages));
          }),
          "unknowns"_a, py::kw_only(), "stages"_a,
          R"(In stages: each starts at the best values of the one before it; only the first searches,
only the last is refined. unknowns: of the run, each in one stage at least.)")
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
      .def(
          "state", &state_dict,
          R"(Cheap, at any time: dict {running, done, error, stopped (a StopReason), stopped_because, phase
("multi-start", "descent", "refinement"), phase_fraction, stage (from 0), iteration, iterations (of
all stages), own_iteration (of the stage), loss, validation, validation_standard_error, seconds,
seconds_left (NaN: unknown yet), values
{"Body:roughness": [..]}}. A failure of the fit is reported here, never raised.)")
      .def("preview", &preview_array, "photo_index"_a,
           "Newest picture of a photo, (h, w, 3) float32, or None before the first.")
      .def(
          "history",
          [](const FitJob& job, bool of_stage) {
            RunResult run = job.result();
            if (of_stage) run.ended.clear();
            return history_dict(job, run);
          },
          "of_stage"_a = false,
          "That of `result` alone, at any time: what plots want, without a copy of the fields;\n"
          "of_stage: of the stage that runs.")
      .def(
          "result", &result_dict,
          R"(dict {values_last, values_best, fields_last, fields_best, best_iteration, best_validation,
best_validation_standard_error, captures {photo: {residual_rms, unexplained, and of a free gain: gain (r, g, b), gain_interval_90, of one that is aligned: shift (x, y in pixels, roll in radians)}}, start_validation, kept_start, model_error {relative, absolute, shift},
iterations, stopped (a StopReason), stopped_because, error, optimiser, samples, seconds,
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
final state, its loss taken from the validation render. Of a fit in stages also stage (k,), from 1.
stages: of a fit in stages, list of dict {name, parameters, iterations, spp, height, best_iteration,
stopped_because, samples, seconds, cpu_seconds, values}; losses and report are those of the last
one.)");
}

}  // namespace selenite
