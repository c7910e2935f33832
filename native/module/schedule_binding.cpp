// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include "fit/run/fit.h"
#include "module/bindings.h"
#include "module/fit_arguments.h"

namespace py = pybind11;
using namespace pybind11::literals;

namespace selenite {
namespace {

/// photos: (id, camera, width, height) each.
py::list schedule_list(const Scene& scene,
                       const std::vector<std::tuple<std::string, std::string, int, int>>& photos,
                       const std::vector<UnknownParameter>& unknowns, const py::dict& settings) {
  std::vector<Photo> sizes;
  for (const auto& [id, camera, width, height] : photos) {
    sizes.push_back(photo_of_size(camera, width, height));
    sizes.back().id = id;
  }
  const FitSettings with = settings_of(settings);
  const auto planned = [&] {
    const py::gil_scoped_release release;
    FitProblem problem(scene, std::move(sizes), unknowns, with);
    return Fit::plan(problem, Strategy(problem));
  }();
  py::list plan;
  for (const PlannedRenders& one : planned)
    plan.append(py::dict("phase"_a = phase_text(one.phase), "pixels"_a = one.pixels,
                         "spp"_a = one.spp, "renders"_a = one.renders,
                         "derivatives"_a = carried_text(one.carried)));
  return plan;
}

py::dict ranges_dict(std::span<const SettingRange> ranges) {
  py::dict rows;
  for (const SettingRange& range : ranges)
    rows[py::str(range.name)] = py::make_tuple(range.lowest, range.highest);
  return rows;
}

}  // namespace

void bind_schedule(py::module_& m) {
  m.def("schedule", &schedule_list, "scene"_a, "photos"_a, "unknowns"_a, "settings"_a,
        R"(What a fit will render: list of dict {phase ("multi-start", "descent", "refinement",
"comparison"), pixels (of all photos), spp, renders (on average), derivatives ("none", "scalars",
"fields", "shape")}. photos: list of (id, camera, width, height); the rest as for Fit.)");
  m.def(
      "refinement_spp",
      [](const py::dict& settings) { return settings_of(settings).chosen_refinement_spp(); },
      "settings"_a, "Samples of a pixel in the last refinement pass of a fit.");
  m.def(
      "setting_ranges",
      [] {
        return py::dict("fit"_a = ranges_dict(fit_ranges()),
                        "render"_a = ranges_dict(render_ranges()));
      },
      R"(What the settings of a fit and of a render may be: dict {"fit", "render"} of dict by name of
(lowest, highest). "pixels" of a render is width times height.)");
  m.attr("few_unknowns") = kFewUnknowns;
}

}  // namespace selenite
