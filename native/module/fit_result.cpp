// SPDX-License-Identifier: GPL-3.0-or-later
#include "module/fit_result.h"

#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>

#include "fit/inference/asked_precision.h"
#include "module/bindings.h"

namespace py = pybind11;
using namespace pybind11::literals;

namespace selenite {
namespace {

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

/// The stages that have begun, the newest last.
std::vector<const EndedStage*> stages_of(const RunResult& run) {
  std::vector<const EndedStage*> stages;
  for (const auto& one : run.ended) stages.push_back(one.get());
  stages.push_back(&run.newest);
  return stages;
}

/// Iterations count over all stages; a stage's first row has the number of the last one of the stage
/// before it. What a stage does not fit keeps its value.
FitHistory history_of(const FitJob& job, const RunResult& run) {
  const std::vector<const EndedStage*> stages = stages_of(run);
  py::ssize_t k = 0;
  for (const EndedStage* one : stages) k += std::ssize(one->result.history);
  py::array_t<int> stage(k), iteration(k);
  py::array_t<double> loss(k), validation(k), error(k), bias({k, py::ssize_t{3}});
  RunPoint point = job.unknowns().scalars_at_start();
  std::vector<py::array_t<double>> columns, means;
  for (const auto& [name, numbers] : point.scalars)
    columns.emplace_back(std::vector<py::ssize_t>{k, std::ssize(numbers)});
  std::vector<std::pair<std::string, Color<double>>> mean = job.unknowns().means_at_start();
  for (std::size_t f = 0; f < mean.size(); ++f) means.emplace_back(std::vector<py::ssize_t>{k, 3});
  py::ssize_t i = 0;
  int done = 0, number = 0;
  for (const EndedStage* one : stages) {
    ++number;
    const Fields& fields = one->problem->fields();
    const auto own = [&](const std::string& name) {
      return std::ranges::find(fields.names(), name) - fields.names().begin();
    };
    for (const HistoryRow& row : one->result.history) {
      stage.mutable_at(i) = number;
      iteration.mutable_at(i) = done + row.iteration;
      loss.mutable_at(i) = row.loss;
      validation.mutable_at(i) = row.validation;
      error.mutable_at(i) = row.validation_standard_error;
      for (int c = 0; c < 3; ++c) bias.mutable_at(i, c) = row.mean_bias[c];
      RunPoint at = point;
      at.take(*one->problem, row.values, {});
      for (std::size_t j = 0; j < columns.size(); ++j)
        for (std::size_t c = 0; c < at.scalars[j].second.size(); ++c)
          columns[j].mutable_at(i, static_cast<py::ssize_t>(c)) = at.scalars[j].second[c];
      for (std::size_t f = 0; f < means.size(); ++f) {
        const auto at_field = static_cast<std::size_t>(own(mean[f].first));
        const Color<double>& there =
            at_field < row.field_means.size() ? row.field_means[at_field] : mean[f].second;
        for (int c = 0; c < 3; ++c) means[f].mutable_at(i, c) = there[c];
      }
      ++i;
    }
    done += one->result.iterations;
    point.take(*one->problem, one->result.best, {});
    for (auto& [name, color] : mean)
      if (const auto f = static_cast<std::size_t>(own(name)); f < fields.names().size())
        color = fields.mean(f, (*one->result.fields_best)[f]);
  }
  py::dict values, of_fields;
  for (std::size_t j = 0; j < columns.size(); ++j)
    values[py::str(point.scalars[j].first)] = columns[j];
  for (std::size_t f = 0; f < means.size(); ++f) of_fields[py::str(mean[f].first)] = means[f];
  FitHistory found{iteration, loss, validation, error, bias, values, of_fields, {}};
  if (job.stages().size() > 1) found.stage = stage;
  return found;
}

std::optional<std::string> bound_text(AtBound bound) {
  switch (bound) {
    case AtBound::kNo:
      return {};
    case AtBound::kMinimum:
      return "minimum";
    case AtBound::kMaximum:
      return "maximum";
  }
  return {};
}

/// `x`: the values that it is about.
NamedReport named(const FitProblem& problem, const TrustReport& report, const Vector& x) {
  const Unknowns& unknowns = problem.unknowns();
  const auto name_of = [&](int component) {
    return unknowns.components()[static_cast<std::size_t>(component)].name;
  };
  NamedReport found{{}, report.passes, report.spp, report.misfit, {}, {}, {}};
  const double precision = problem.settings().precision;
  const Vector factors = precision > 0 && !report.components.empty()
                             ? samples_factors(unknowns, x, report.components, precision)
                             : Vector(Vector::Zero(x.size()));
  for (std::size_t i = 0; i < unknowns.names().size() && !report.components.empty(); ++i) {
    ParameterConfidence all;
    for (std::size_t k = 0; k < unknowns.components().size(); ++k) {
      if (unknowns.components()[k].parameter != static_cast<int>(i)) continue;
      const Confidence& one = report.components[k];
      all.standard_error.push_back(one.standard_error);
      all.interval_90.emplace_back(one.interval[0], one.interval[1]);
      all.determined.push_back(one.determined);
      all.at_bound.push_back(bound_text(one.at_bound));
      all.correlated_with.push_back(
          one.correlated_with < 0 ? std::nullopt : std::optional(name_of(one.correlated_with)));
      all.samples_factor.push_back(factors[static_cast<Eigen::Index>(k)]);
    }
    found.parameters[py::str(unknowns.names()[i])] = all;
  }
  for (const Vector& x : report.alternatives)
    found.alternative_minima.push_back(values_dict(unknowns, x));
  for (const int k : report.ambiguous) found.ambiguous.push_back(name_of(k));
  for (const WeakDirection& one : report.weak) {
    NamedDirection weak{one.deviation, {}, {}};
    for (const int k : one.components) weak.components.push_back(name_of(k));
    for (const int p : one.photos)
      weak.captures.push_back(problem.photos()[static_cast<std::size_t>(p)].id);
    found.weak_directions.push_back(weak);
  }
  return found;
}

py::dict photos_dict(const FitProblem& problem, const std::vector<PhotoReport>& reports) {
  py::dict found;
  for (std::size_t i = 0; i < reports.size(); ++i) {
    const Photo& photo = problem.photos()[i];
    const auto& [gain, error, alignment, rms, unexplained] = reports[i];
    FoundPhoto one{rms, unexplained, {}, {}, {}};
    if (photo.align) one.shift = {alignment.x, alignment.y, alignment.roll};
    if (photo.gain_freedom != GainFreedom::kNone) {
      one.gain = {gain.r, gain.g, gain.b};
      one.gain_interval_90.emplace();
      for (int c = 0; c < 3; ++c) {
        const double wide = std::exp(kQuantile90 * error[c] / gain[c]);
        one.gain_interval_90->emplace_back(gain[c] / wide, gain[c] * wide);
      }
    }
    found[py::str(photo.id)] = one;
  }
  return found;
}

FoundStage found_stage(const Stage& stage, const EndedStage& one, StopReason stopped) {
  const FitResult& r = one.result;
  return {stage.name,
          stage.parameters,
          r.iterations,
          stage.settings.spp,
          stage.photos.front().height,
          r.best_iteration,
          stopped_because(stopped, r.message),
          r.samples,
          one.seconds,
          r.cpu_seconds,
          values_dict(one.problem->unknowns(), r.best)};
}

}  // namespace

FitProgress progress_of(const FitJob& job) {
  FitState state = job.state();
  std::string why = stopped_because(state.stopped, state.message);
  py::dict values = values_dict(state.values);
  return {std::move(state), std::move(why), std::move(values)};
}

FitHistory history_of(const FitJob& job, bool of_stage) {
  RunResult run = job.result();
  if (of_stage) run.ended.clear();
  return history_of(job, run);
}

FoundFit found_by(const FitJob& job, bool fields) {
  const RunResult run = job.result();
  const FitState s = job.state();
  const EndedStage& newest = run.newest;
  const FitResult& r = newest.result;
  FoundFit found;
  // One after the other: the points of large fields take memory.
  const auto take = [&](const Vector& x, const FieldValues& at, py::dict& values,
                        py::dict& arrays) {
    RunPoint point = fields ? *run.point : RunPoint{run.point->scalars, {}};
    point.take(*newest.problem, x, at);
    if (fields) job.unknowns().fill_waiting(point, job.stages(), run.ended.size() + 1);
    values = values_dict(point);
    arrays = fields_dict(job.unknowns(), point);
  };
  take(r.last, *r.fields_last, found.values_last, found.fields_last);
  take(r.best, *r.fields_best, found.values_best, found.fields_best);
  int before = 0;
  RenderCounts sum = r;
  found.shape_steps = r.shape_steps;
  for (const auto& one : run.ended) {
    before += one->result.iterations;
    sum.samples += one->result.samples;
    sum.dropped += one->result.dropped;
    sum.cpu_seconds += one->result.cpu_seconds;
    found.shape_steps.turning += one->result.shape_steps.turning;
    found.shape_steps.intersecting += one->result.shape_steps.intersecting;
    found.shape_steps.given_up += one->result.shape_steps.given_up;
  }
  found.best_iteration = before + r.best_iteration;
  found.best_validation = r.best_validation;
  found.best_validation_standard_error = r.best_validation_standard_error;
  found.start_validation = r.start_validation;
  found.captures = photos_dict(*newest.problem, r.photos);
  found.kept_start = r.kept_start;
  found.model_error = r.model_error;
  found.iterations = before + r.iterations;
  found.stopped = s.stopped;
  found.stopped_because = stopped_because(s.stopped, s.message);
  found.faults = s.faults;
  found.optimiser = newest.optimiser;
  found.counts = sum;
  found.seconds = s.seconds;
  found.search = stages_of(run).front()->result.search;
  for (const EndedStage* stage : stages_of(run))
    for (std::size_t f = 0; f < stage->result.patterns.size(); ++f)
      found.patterns[py::str(stage->problem->fields().names()[f])] = stage->result.patterns[f];
  found.report = named(*newest.problem, r.report, r.best);
  found.history = history_of(job, run);
  if (job.stages().size() > 1) {
    found.stages.emplace();
    for (std::size_t i = 0; i < run.ended.size(); ++i)
      found.stages->push_back(
          found_stage(job.stages()[i], *run.ended[i], run.ended[i]->result.stopped));
    found.stages->push_back(found_stage(job.stages()[run.ended.size()], newest, s.stopped));
  }
  return found;
}

namespace {

void bind_progress(py::module_& m) {
  const auto of = [](auto FitState::*member) {
    return [member](const FitProgress& p) { return p.state.*member; };
  };
  py::class_<FitProgress>(m, "Progress", "How far a fit has come.")
      .def_property_readonly("running", of(&FitState::running))
      .def_property_readonly("done", of(&FitState::done))
      .def_property_readonly("problems", of(&FitState::faults),
                             "Why it failed; empty if it did not.")
      .def_property_readonly("stopped", of(&FitState::stopped))
      .def_readonly("stopped_because", &FitProgress::stopped_because, "In words, for people.")
      .def_property_readonly("stage", of(&FitState::stage), "From 0.")
      .def_property_readonly("iteration", of(&FitState::iteration))
      .def_property_readonly("own_iteration", of(&FitState::own_iteration), "Of the stage.")
      .def_property_readonly("iterations", of(&FitState::iterations), "Of all stages.")
      .def_property_readonly(
          "phase", [](const FitProgress& p) { return phase_text(p.state.phase); },
          R"("multi-start", "descent", "refinement", "comparison", "roughness-profile", "parts".)")
      .def_property_readonly("phase_fraction", of(&FitState::phase_fraction))
      .def_property_readonly("loss", of(&FitState::loss), "The newest; NaN: none yet.")
      .def_property_readonly("validation", of(&FitState::validation))
      .def_property_readonly("validation_standard_error", of(&FitState::validation_standard_error))
      .def_property_readonly("seconds", of(&FitState::seconds))
      .def_property_readonly("seconds_left", of(&FitState::seconds_left), "NaN: not known yet.")
      .def_readonly("values", &FitProgress::values, R"({"Body:roughness": [..]}.)");
}

void bind_report(py::module_& m) {
  py::class_<ParameterConfidence>(m, "ParameterConfidence",
                                  "What the photos say of a parameter: lists over its components.")
      .def_readonly("standard_error", &ParameterConfidence::standard_error)
      .def_readonly("interval_90", &ParameterConfidence::interval_90)
      .def_readonly("determined", &ParameterConfidence::determined)
      .def_readonly("at_bound", &ParameterConfidence::at_bound, R"("minimum", "maximum" or None.)")
      .def_readonly("correlated_with", &ParameterConfidence::correlated_with,
                    "The component that can compensate for it.")
      .def_readonly("samples_factor", &ParameterConfidence::samples_factor,
                    "By which the samples must grow to the asked precision; at most 1: reached; 0: "
                    "none is asked for, or more samples do not help.");
  py::class_<Misfit>(m, "Misfit", "What no value of the unknowns explains.")
      .def_readonly("value", &Misfit::value, "Squared, of the photos' brightness.")
      .def_readonly("standard_error", &Misfit::standard_error)
      .def_readonly("explained", &Misfit::explained, "Within noise.");
  py::class_<NamedDirection>(m, "WeakDirection", "Values that compensate for each other.")
      .def_readonly("deviation", &NamedDirection::deviation,
                    "Standard deviation along it, in ranges.")
      .def_readonly("components", &NamedDirection::components)
      .def_readonly("captures", &NamedDirection::captures, "Ids of those whose gains follow it.");
  py::class_<NamedReport>(m, "TrustReport", "How sure the values are.")
      .def_readonly("parameters", &NamedReport::parameters,
                    "Name -> ParameterConfidence; {} without a refinement.")
      .def_readonly("passes", &NamedReport::passes, "0: there was no refinement.")
      .def_readonly("spp", &NamedReport::spp, "Samples per pixel of the last pass.")
      .def_readonly("misfit", &NamedReport::misfit)
      .def_readonly("alternative_minima", &NamedReport::alternative_minima,
                    "Values far from the best that explain the photos equally well.")
      .def_readonly("ambiguous", &NamedReport::ambiguous,
                    "Components that are determined but for alternative minima.")
      .def_readonly("weak_directions", &NamedReport::weak_directions, "The widest first.");
}

void bind_parts(py::module_& m) {
  py::class_<FieldPattern>(m, "FieldPattern",
                           "What a field says of the residuals, as shares of their squares.")
      .def_readonly("explained", &FieldPattern::explained,
                    "Of those beside one value at all places; NaN: not known.")
      .def_readonly("left", &FieldPattern::left,
                    "Of those at the end: what photos agree on that it does not show.");
  py::class_<FoundPhoto>(m, "FoundPhoto", "What a fit has found of a photo; None: it was given.")
      .def_readonly("residual_rms", &FoundPhoto::residual_rms)
      .def_readonly("unexplained", &FoundPhoto::unexplained, "Share of its brightness.")
      .def_readonly("shift", &FoundPhoto::shift, "Pixels across and down, and roll in radians.")
      .def_readonly("gain", &FoundPhoto::gain)
      .def_readonly("gain_interval_90", &FoundPhoto::gain_interval_90);
  py::class_<FitHistory>(m, "History",
                         R"(Arrays of k rows; the last row is the final state, its loss taken from
the validation render. Not validated: NaN.)")
      .def_readonly("iteration", &FitHistory::iteration, "Over all stages.")
      .def_readonly("loss", &FitHistory::loss)
      .def_readonly("validation", &FitHistory::validation)
      .def_readonly("validation_standard_error", &FitHistory::validation_standard_error)
      .def_readonly("mean_bias", &FitHistory::mean_bias, "(k, 3): render minus photo.")
      .def_readonly("values", &FitHistory::values, "Name -> (k, width).")
      .def_readonly("field_means", &FitHistory::field_means, "Name -> (k, 3).")
      .def_readonly("stage", &FitHistory::stage, "From 1; None without stages.");
  py::class_<FoundStage>(m, "FoundStage", "A stage that has begun.")
      .def_readonly("name", &FoundStage::name)
      .def_readonly("parameters", &FoundStage::parameters)
      .def_readonly("iterations", &FoundStage::iterations)
      .def_readonly("spp", &FoundStage::spp)
      .def_readonly("height", &FoundStage::height)
      .def_readonly("best_iteration", &FoundStage::best_iteration)
      .def_readonly("stopped_because", &FoundStage::stopped_because)
      .def_readonly("samples", &FoundStage::samples)
      .def_readonly("seconds", &FoundStage::seconds)
      .def_readonly("cpu_seconds", &FoundStage::cpu_seconds)
      .def_readonly("values", &FoundStage::values);
  py::class_<MultiStartResult>(m, "Search", "What a multi-start has done.")
      .def_readonly("points", &MultiStartResult::points, "0: there was none.")
      .def_readonly("moved", &MultiStartResult::moved)
      .def_readonly("start_loss", &MultiStartResult::start_loss)
      .def_readonly("loss", &MultiStartResult::loss)
      .def_readonly("standard_error", &MultiStartResult::standard_error);
  py::class_<ShapeSteps>(m, "ShapeSteps", "Steps of vertices that had to be shortened.")
      .def_readonly("turning", &ShapeSteps::turning, "A face would have turned over.")
      .def_readonly("intersecting", &ShapeSteps::intersecting,
                    "Surfaces would have gone through each other.")
      .def_readonly("given_up", &ShapeSteps::given_up, "Of both: they were dropped.");
  py::class_<ModelError>(m, "ModelError", "What the residuals show that no values explain.")
      .def_readonly("relative", &ModelError::relative, "Of a pixel's brightness.")
      .def_readonly("absolute", &ModelError::absolute, "Of the photo's mean.")
      .def_readonly("shift", &ModelError::shift, "Pixels.");
}

}  // namespace

void bind_fit_result(py::module_& m) {
  py::enum_<StopReason>(m, "StopReason", "Why a fit, or a stage of it, has ended.")
      .value("NONE", StopReason::kNone)
      .value("ITERATIONS", StopReason::kIterations)
      .value("CONVERGED", StopReason::kConverged)
      .value("TOLERANCE", StopReason::kTolerance)
      .value("CANCELLED", StopReason::kCancelled)
      .value("DROPPED", StopReason::kDropped)
      .value("ERROR", StopReason::kError);
  bind_progress(m);
  bind_report(m);
  bind_parts(m);
  const auto count = [](auto RenderCounts::*member) {
    return [member](const FoundFit& found) { return found.counts.*member; };
  };
  py::class_<FoundFit>(m, "FitResult", R"(What a fit has found. Best are the newest values whose
loss, in a render with fixed seed and more samples, is not worse than the smallest one by more than
its noise. Losses and report are those of the last stage.)")
      .def_readonly("values_last", &FoundFit::values_last)
      .def_readonly("values_best", &FoundFit::values_best, R"({"Body:roughness": [..]}.)")
      .def_readonly("fields_last", &FoundFit::fields_last)
      .def_readonly("fields_best", &FoundFit::fields_best,
                    R"({"Body:albedo_grid": (nz, ny, nx, channels) float32}.)")
      .def_readonly("best_iteration", &FoundFit::best_iteration)
      .def_readonly("best_validation", &FoundFit::best_validation)
      .def_readonly("best_validation_standard_error", &FoundFit::best_validation_standard_error)
      .def_readonly("start_validation", &FoundFit::start_validation)
      .def_readonly("captures", &FoundFit::captures, "Id -> FoundPhoto; {} while the fit runs.")
      .def_readonly("kept_start", &FoundFit::kept_start)
      .def_readonly("model_error", &FoundFit::model_error)
      .def_readonly("iterations", &FoundFit::iterations)
      .def_readonly("stopped", &FoundFit::stopped)
      .def_readonly("stopped_because", &FoundFit::stopped_because, "In words, for people.")
      .def_readonly("problems", &FoundFit::faults, "Why it failed; empty if it did not.")
      .def_readonly("optimiser", &FoundFit::optimiser)
      .def_property_readonly("samples", count(&RenderCounts::samples))
      .def_property_readonly("dropped", count(&RenderCounts::dropped))
      .def_property_readonly("cpu_seconds", count(&RenderCounts::cpu_seconds))
      .def_readonly("seconds", &FoundFit::seconds)
      .def_readonly("search", &FoundFit::search)
      .def_readonly("shape_steps", &FoundFit::shape_steps)
      .def_readonly("patterns", &FoundFit::patterns, "Name of a field -> FieldPattern.")
      .def_readonly("report", &FoundFit::report)
      .def_readonly("history", &FoundFit::history)
      .def_readonly("stages", &FoundFit::stages, "List of FoundStage; None without stages.");
}

}  // namespace selenite
