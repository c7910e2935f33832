// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/problem/settings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "fit/problem/loss.h"
#include "math/problem_list.h"

namespace selenite {
namespace {

constexpr double kMostSpp = 65536, kMostIterations = 1'000'000;

const auto& ranges() {
  static const std::array table{
      SettingRange{"iterations", "iterations", 1, kMostIterations},
      SettingRange{"most_iterations", "iterations at most", 0, kMostIterations},
      SettingRange{"spp", "samples per pixel", 1, kMostSpp},
      SettingRange{"tolerance", "tolerance", 0, 1e9},
      range_of(render_ranges(), "depth"),
      range_of(render_ranges(), "threads"),
      SettingRange{"validation_interval", "iterations between validations", 1, kMostIterations},
      // 1 is refused: see `check`.
      SettingRange{"validation_spp", "samples per pixel of a validation", 0, kMostSpp},
      SettingRange{"refinement_spp", "samples per pixel of a refinement pass", 0, kMostSpp},
      SettingRange{"precision", "precision", 0, 1},
  };
  return table;
}

}  // namespace

std::span<const SettingRange> fit_ranges() { return ranges(); }

int FitSettings::chosen_validation_spp() const {
  constexpr int kLeast = 16, kTimes = 2;
  return validation_spp > 0 ? validation_spp : std::max(kLeast, kTimes * spp);
}

int FitSettings::chosen_refinement_spp() const {
  constexpr std::int64_t kLeast = 64;
  // A pass over informative pixels takes up to four times as many, and a render only so many.
  constexpr int kTimes = 4;
  if (refinement_spp > 0) return refinement_spp;
  const auto most = static_cast<std::int64_t>(range_of(render_ranges(), "spp").highest) / kTimes;
  return static_cast<int>(std::clamp(std::int64_t{iterations} * spp, kLeast, most));
}

void FitSettings::check() const {
  ProblemList problems;
  const auto require = [&](const char* name, double value, double lowest, double highest) {
    if (value >= lowest && value <= highest) return;  // false for NaN
    problems.add(
        {"", joined(name, " = ", value, " must lie in [", lowest, ", ", highest, "]"), ""});
  };
  const auto in_range = [&](const char* name, double value) {
    const SettingRange& range = range_of(fit_ranges(), name);
    require(name, value, range.lowest, range.highest);
  };
  in_range("iterations", iterations);
  in_range("most_iterations", most_iterations);
  in_range("spp", spp);
  in_range("tolerance", tolerance);
  in_range("depth", depth);
  in_range("threads", threads);
  in_range("validation_interval", validation_interval);
  in_range("validation_spp", validation_spp);
  if (validation_spp == 1) require("validation_spp", validation_spp, 2, kMostSpp);
  in_range("refinement_spp", refinement_spp);
  if (refinement_spp == 1) require("refinement_spp", refinement_spp, 2, kMostSpp);
  in_range("precision", precision);
  for (const auto& [name, value] :
       {std::pair{"search", search}, std::pair{"refinement", refinement}})
    if (value != "on" && value != "off" && value != "auto")
      problems.add(
          {"", joined(name, " = '", value, "' is unknown"), "choose one of auto, on, off"});
  if (prior != "agreement" && prior != "misfit")
    problems.add(
        {"", joined("prior = '", prior, "' is unknown"), "choose one of agreement, misfit"});
  problems.collect([&] {
    const Loss& chosen = find_loss(loss);
    if (spp >= 1 && spp < chosen.least_spp)
      problems.add(
          {"",
           joined("loss = '", loss, "' needs spp of at least ", chosen.least_spp, ", not ", spp),
           "it multiplies different samples of a pixel"});
  });
  problems.raise();
}

}  // namespace selenite
