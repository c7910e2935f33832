// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <cstring>

#include "fit/run/fit_job.h"
#include "math/error.h"
#include "module/bindings.h"
#include "module/fit_arguments.h"
#include "module/fit_result.h"
#include "module/worker_binding.h"

namespace py = pybind11;
using namespace pybind11::literals;

namespace selenite {
namespace {

std::unique_ptr<FitJob> make_fit(const Scene& scene, std::vector<Photo> photos,
                                 const std::vector<UnknownParameter>& unknowns,
                                 const py::dict& settings, const py::object& workers) {
  FitSettings with = settings_of(settings);
  with.workers = workers_of(workers);
  const py::gil_scoped_release release;
  return std::make_unique<FitJob>(scene, std::move(photos), unknowns, with);
}

Stage make_stage(const std::string& name, std::vector<std::string> parameters,
                 std::vector<std::string> fields, const Scene& scene, std::vector<Photo> photos,
                 const py::dict& settings) {
  return {name,  std::move(parameters), std::move(fields),
          scene, std::move(photos),     settings_of(settings)};
}

py::object preview_array(const FitJob& job, int index) {
  const std::shared_ptr<const Picture> picture = job.preview(index);
  if (!picture) return py::none();
  const Photo& photo = job.result().newest.problem->photos()[static_cast<std::size_t>(index)];
  py::array_t<float> array({photo.height, photo.width, 3});
  std::memcpy(array.mutable_data(), picture->data(), picture->size() * sizeof(Colorf));
  return array;
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

  bind_fit_result(m);
  py::class_<Stage>(m, "Stage", R"(A part of a fit that finds some of its unknowns.

Args:
    name: as shown.
    parameters: names of the unknowns that it fits, as "Body:roughness".
    fields: names of the fit's grids and images that are in its scene; the others wait for one colour.
    scene, photos, settings: as of Fit.)")
      .def(py::init(&make_stage), "name"_a, "parameters"_a, "fields"_a, "scene"_a, "photos"_a,
           "settings"_a);

  // The destructor waits for the fit's thread to reach the end of a tile: not with the GIL held.
  py::class_<WrittenState>(m, "WrittenState", "A file with the whole state of a fit.")
      .def_readonly("file", &WrittenState::file)
      .def_readonly("seconds", &WrittenState::seconds, "That it took.");
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
        refinement_spp 0 (as many as the iterations took, at least 64), precision 0 (half of a 90 %
        interval that suffices, as a share of the bounds' distance, or twice that of the value; 0: all
        samples are taken), finite_differences True (differences of pictures in place of derivatives: by IOR, in Gauss-Newton steps by roughness and
        extinction too).
    workers: who renders in place of this process; see StageWorker. Results are the same bit by bit.
Raises:
    ValueError, KeyError: all problems at once, one line each; nothing is started.)")
      .def(py::init(&make_fit), "scene"_a, "photos"_a, "unknowns"_a, "settings"_a = py::dict(),
           py::kw_only(), "workers"_a = py::none())
      .def(
          py::init([](const std::vector<UnknownParameter>& unknowns, std::vector<Stage> stages,
                      const py::object& workers) {
            for (Stage& one : stages) one.settings.workers = workers_of(workers);
            const py::gil_scoped_release release;
            return std::make_unique<FitJob>(unknowns, std::move(stages));
          }),
          "unknowns"_a, py::kw_only(), "stages"_a, "workers"_a = py::none(),
          R"(In stages: each starts at the best values of the one before it; only the first searches,
only the last is refined. unknowns: of the run, each in one stage at least.)")
      .def("start", &FitJob::start, "Starts the thread. ValueError when started before.")
      .def("cancel", &FitJob::cancel, "Asks it to stop; polled per tile. What was found stays.")
      .def("join", &FitJob::join, py::call_guard<py::gil_scoped_release>(), "Waits for the end.")
      .def(
          "request_state", &FitJob::request_state, "file"_a,
          py::call_guard<py::gil_scoped_release>(),
          R"(Asks for the whole state in a file, after the iteration that runs, or now of a fit that has
ended; see take_state.)")
      .def(
          "take_state", &FitJob::take_state,
          R"(The newest state that has been written since the last call, once it is there; else None.

Raises:
    OSError: it cannot be written. The fit goes on.)")
      .def(
          "restore", &FitJob::restore, "file"_a, "seconds"_a = 0.0,
          R"(Before start: goes on from the state of a fit with the same arguments, to the same bits
as that one would have had. seconds: what it had taken.

Raises:
    ValueError: the file is damaged, or of a fit with other arguments or another version.
    OSError: it cannot be read.)")
      .def("progress", &progress_of,
           "Cheap, at any time. A failure of the fit is its `problems`, never raised.")
      .def("preview", &preview_array, "photo_index"_a,
           "Newest picture of a photo, (h, w, 3) float32, or None before the first.")
      .def("history", &history_of, "of_stage"_a = false,
           "That of `result` alone, at any time: what plots want, without a copy of the fields;\n"
           "of_stage: of the stage that runs.")
      .def("result", &found_by, py::kw_only(), "fields"_a = true,
           "What has been found so far, at any time; a copy. fields: with `fields_last` and\n"
           "`fields_best`, else these are empty.");
}

}  // namespace selenite
