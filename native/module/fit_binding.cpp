// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cmath>
#include <cstring>

#include "fit/run/fit_job.h"
#include "fit/run/schedule.h"
#include "math/error.h"
#include "module/bindings.h"
#include "module/float_array.h"

namespace py = pybind11;
using namespace pybind11::literals;

namespace selenite {
namespace {

/// A dict of named values: an unknown key is an error, so that a misspelt one is not ignored.
class Named {
 public:
  Named(const py::handle& object, std::string what, std::vector<const char*> keys)
      : what_(std::move(what)), keys_(std::move(keys)) {
    if (!py::isinstance<py::dict>(object)) throw py::value_error(what_ + " must be a dict");
    values_ = py::reinterpret_borrow<py::dict>(object);
    for (const auto& [key, value] : values_) {
      const std::string name = py::str(key);
      if (std::find(keys_.begin(), keys_.end(), name) == keys_.end())
        throw py::value_error(what_ + ": key '" + name + "' is unknown; the keys are " + listed());
    }
  }
  bool has(const char* key) const { return values_.contains(key) && !values_[key].is_none(); }
  py::object get(const char* key) const {
    if (!has(key))
      throw py::value_error(what_ + ": '" + key + "' is missing; the keys are " + listed());
    return values_[key];
  }
  template <class T>
  T as(const char* key) const {
    try {
      return get(key).cast<T>();
    } catch (const py::cast_error&) {
      throw py::value_error(what_ + ": " + key + " = " + std::string(py::repr(values_[key])) +
                            " has the wrong type or is out of range");
    }
  }
  template <class T>
  void take(const char* key, T& value) const {
    if (has(key)) value = as<T>(key);
  }

 private:
  std::string listed() const {
    std::string text;
    for (const char* key : keys_) text += (text.empty() ? "" : ", ") + std::string(key);
    return text;
  }
  std::string what_;
  std::vector<const char*> keys_;
  py::dict values_;
};

Photo photo_of(const py::handle& object, std::size_t index) {
  const std::string what = "photos[" + std::to_string(index) + "]";
  const Named named(object, what, {"id", "camera", "reference", "weight", "frame"});
  Photo photo;
  photo.camera = named.as<std::string>("camera");
  named.take("id", photo.id);
  if (named.has("frame")) photo.frame = frame_of(named.as<FrameTuple>("frame"));
  const FloatArray reference = float_array(named.get("reference"), what + ": reference");
  if (reference.ndim() != 3 || reference.shape(2) != 3)
    throw py::value_error(what + ": reference has shape " + shape_text(reference) +
                          "; it must be (height, width, 3)");
  photo.height = static_cast<int>(reference.shape(0));
  photo.width = static_cast<int>(reference.shape(1));
  photo.reference.resize(static_cast<std::size_t>(photo.height) * photo.width);
  static_assert(sizeof(Colorf) == 3 * sizeof(float));
  std::memcpy(static_cast<void*>(photo.reference.data()), reference.data(),
              photo.reference.size() * sizeof(Colorf));
  if (!named.has("weight")) return photo;
  const FloatArray weight = float_array(named.get("weight"), what + ": weight");
  if (weight.ndim() != 2 || weight.shape(0) != photo.height || weight.shape(1) != photo.width)
    throw py::value_error(what + ": weight has shape " + shape_text(weight) + "; it must be (" +
                          std::to_string(photo.height) + ", " + std::to_string(photo.width) +
                          ") as the reference");
  photo.weight.assign(weight.data(), weight.data() + weight.size());
  return photo;
}

UnknownParameter unknown_of(const py::handle& object, std::size_t index) {
  const Named named(object, "unknowns[" + std::to_string(index) + "]",
                    {"owner", "parameter", "start", "minimum", "maximum", "learning_rate"});
  UnknownParameter unknown;
  unknown.owner = named.as<std::string>("owner");
  unknown.parameter = named.as<std::string>("parameter");
  named.take("learning_rate", unknown.learning_rate);
  unknown.minimum = named.as<double>("minimum");
  unknown.maximum = named.as<double>("maximum");
  if (Fields::is_field(unknown) && !named.has("start")) return unknown;
  const py::object start = named.get("start");
  if (py::isinstance<py::float_>(start) || py::isinstance<py::int_>(start))
    unknown.start = {named.as<double>("start")};
  else
    unknown.start = named.as<std::vector<double>>("start");
  return unknown;
}

FitSettings settings_of(const py::handle& object) {
  const Named named(object, "settings",
                    {"loss", "optimiser", "iterations", "spp", "tolerance", "seed", "depth",
                     "threads", "accumulate", "validation_interval", "validation_spp", "search",
                     "refinement", "refinement_spp", "finite_differences"});
  FitSettings settings;
  named.take("loss", settings.loss);
  named.take("optimiser", settings.optimiser);
  named.take("iterations", settings.iterations);
  named.take("spp", settings.spp);
  named.take("tolerance", settings.tolerance);
  named.take("seed", settings.seed);
  named.take("depth", settings.depth);
  named.take("threads", settings.threads);
  named.take("accumulate", settings.accumulate);
  named.take("validation_interval", settings.validation_interval);
  named.take("validation_spp", settings.validation_spp);
  named.take("finite_differences", settings.finite_differences);
  named.take("search", settings.search);
  named.take("refinement", settings.refinement);
  named.take("refinement_spp", settings.refinement_spp);
  return settings;
}

std::unique_ptr<FitJob> make_fit(const Scene& scene, const py::list& photos,
                                 const py::list& unknowns, const py::dict& settings) {
  std::vector<Photo> taken;
  for (const auto& one : photos) taken.push_back(photo_of(one, taken.size()));
  std::vector<UnknownParameter> wanted;
  for (const auto& one : unknowns) wanted.push_back(unknown_of(one, wanted.size()));
  return std::make_unique<FitJob>(scene, std::move(taken), wanted, settings_of(settings));
}

/// photos: (camera, width, height) each.
py::list schedule_list(const Scene& scene,
                       const std::vector<std::tuple<std::string, int, int>>& photos,
                       const py::list& unknowns, const py::dict& settings) {
  std::vector<Photo> sizes;
  for (const auto& [camera, width, height] : photos)
    sizes.push_back(photo_of_size(camera, width, height));
  std::vector<UnknownParameter> wanted;
  for (const auto& one : unknowns) wanted.push_back(unknown_of(one, wanted.size()));
  FitProblem problem(scene, std::move(sizes), wanted, settings_of(settings));
  const Strategy strategy(problem);
  py::list plan;
  for (const PlannedRenders& one : schedule(problem, strategy))
    plan.append(py::dict("phase"_a = phase_text(one.phase), "pixels"_a = one.pixels,
                         "spp"_a = one.spp, "renders"_a = one.renders,
                         "derivatives"_a = carried_text(one.carried)));
  return plan;
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
py::dict report_dict(const Unknowns& unknowns, const TrustReport& report) {
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
  return py::dict("parameters"_a = parameters, "passes"_a = report.passes,
                  "alternative_minima"_a = alternatives, "ambiguous"_a = ambiguous,
                  "misfit"_a = py::dict("value"_a = report.misfit.value,
                                        "standard_error"_a = report.misfit.standard_error,
                                        "explained"_a = report.misfit.explained));
}

py::dict result_dict(const FitJob& job) {
  const FitResult r = job.result();
  const FitState s = job.state();
  return py::dict("values_last"_a = values_dict(job.unknowns(), r.last),
                  "values_best"_a = values_dict(job.unknowns(), r.best),
                  "fields_last"_a = fields_dict(job.fields(), *r.fields_last),
                  "fields_best"_a = fields_dict(job.fields(), *r.fields_best),
                  "best_iteration"_a = r.best_iteration, "best_validation"_a = r.best_validation,
                  "best_validation_standard_error"_a = r.best_validation_standard_error,
                  "iterations"_a = r.iterations, "stopped_because"_a = s.stopped_because,
                  "error"_a = s.error, "optimiser"_a = job.optimiser_name(),
                  "samples"_a = r.samples, "seconds"_a = s.seconds, "cpu_seconds"_a = r.cpu_seconds,
                  "dropped"_a = r.dropped, "search"_a = search_dict(r.search),
                  "report"_a = report_dict(job.unknowns(), r.report),
                  "history"_a = history_dict(job, r.history));
}

py::object preview_array(const FitJob& job, int index) {
  const std::shared_ptr<const Picture> picture = job.preview(index);
  if (!picture) return py::none();
  const Photo& photo = job.photos()[static_cast<std::size_t>(index)];
  py::array_t<float> array({photo.height, photo.width, 3});
  std::memcpy(array.mutable_data(), picture->data(), picture->size() * sizeof(Colorf));
  return array;
}

py::list loss_table() {
  py::list rows;
  for (const Loss& loss : losses())
    rows.append(py::dict("name"_a = std::string(loss.name), "help"_a = std::string(loss.help),
                         "least_spp"_a = loss.least_spp));
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
  m.def("losses", &loss_table, "The losses: list of dict {name, help, least_spp}.");
  m.def("optimisers", &optimiser_table, "The optimisers: list of dict {name, help, least_spp}.");

  m.def("schedule", &schedule_list, "scene"_a, "photos"_a, "unknowns"_a, "settings"_a,
        R"(What a fit will render: list of dict {phase ("multi-start", "descent", "refinement",
"comparison"), pixels (of all photos), spp, renders (on average), derivatives ("none", "scalars",
"fields")}. photos: list of (camera, width, height); the rest as for Fit.)");
  // The destructor waits for the fit's thread to reach the end of a tile: not with the GIL held.
  py::class_<FitJob>(m, "Fit", py::release_gil_before_calling_cpp_dtor(),
                     R"(A fit of scene parameters to photos, in a native thread of its own.

Args:
    scene: copied; later changes of the argument do not matter.
    photos: list of dict {id: str, unique, or None for the camera's name; camera: str, of any number
        of photos; reference: (h, w, 3) float32 linear radiance, row 0 at the top; weight: (h, w)
        float32 >= 0 or None; frame (aspect, width, height): as for `render`}. Pixels that are not
        finite must have weight 0.
    unknowns: list of dict {owner, parameter, start: (1,) or (3,), minimum, maximum, learning_rate
        (0.03)}; the bounds hold for every component. The parameters "albedo_grid" and
        "density_grid" of a material are every value of that grid, "base_color_texture" every texel
        of that image, as the image holds it (in sRGB if it is encoded): they start at the scene's,
        without `start` (a search moves an albedo grid or an image of one colour as a whole), and
        the rate is in units of their values: the length of a step; after a search the first is four
        times as long, and the last one of an image a quarter.
    settings: dict; what is left out keeps its default: loss "dual-buffer" (see losses()), optimiser
        "auto" (see optimisers()), iterations 100, spp 4, tolerance 0.001 (0: never), seed 0,
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
      .def(
          "take_state",
          [](FitJob& job) -> py::object {
            const std::shared_ptr<const std::string> saved = job.take_state();
            return saved ? py::object(py::bytes(*saved)) : py::none();
          },
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
          "result", &result_dict,
          R"(dict {values_last, values_best, fields_last, fields_best, best_iteration, best_validation,
best_validation_standard_error, iterations, stopped_because, error, optimiser, samples, seconds,
cpu_seconds, dropped, search, report, history}. Best are the newest values whose loss, in a render with fixed
seed and more samples, is not worse than the smallest one by more than its noise.
fields: {"Body:albedo_grid": (nz, ny, nx, channels) float32}.
search: {points (0: none), moved, start_loss, loss, standard_error}.
report: {parameters: {"Body:roughness": {standard_error, interval_90, determined, at_bound ("minimum",
"maximum", None), correlated_with}}, each a list by component; passes (0: no refinement); misfit:
{value, standard_error, explained}; alternative_minima: values far from the best that explain the photos as well,
each {"Body:roughness": [..]}; ambiguous: components ("Body:base_color[1]") determined but for them}.
history: iteration (k,), loss (k,), validation (k,) and its standard error (NaN where not done),
mean_bias (k, 3) render minus photo, field_means {"Body:albedo_grid": (k, 3)}, values {"Body:roughness": (k, width)}; the last row is the
final state, its loss taken from the validation render.)");
}

}  // namespace selenite
