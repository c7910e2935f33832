// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/problem/settings.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fit/problem/loss.h"
#include "fit/problem/problem_list.h"

namespace selenite {

int FitSettings::chosen_validation_spp() const {
  constexpr int kLeast = 16, kTimes = 2;
  return validation_spp > 0 ? validation_spp : std::max(kLeast, kTimes * spp);
}

int FitSettings::chosen_refinement_spp() const {
  constexpr int kLeast = 64;
  return refinement_spp > 0 ? refinement_spp : std::max(kLeast, iterations * spp);
}

void FitSettings::check() const {
  ProblemList problems;
  const auto require = [&](const char* name, double value, double lowest, double highest) {
    if (value >= lowest && value <= highest) return;  // false for NaN
    problems.add(name, " = ", value, " must lie in [", lowest, ", ", highest, "]");
  };
  require("iterations", iterations, 1, 1e6);
  require("spp", spp, 1, 65536);
  require("tolerance", tolerance, 0, 1e9);
  require("depth", depth, 0, 1e6);
  require("threads", threads, 0, 4096);
  require("validation_interval", validation_interval, 1, 1e6);
  require("validation_spp", validation_spp, 0, 65536);
  if (validation_spp == 1) require("validation_spp", validation_spp, 2, 65536);
  require("refinement_spp", refinement_spp, 0, 65536);
  if (refinement_spp == 1) require("refinement_spp", refinement_spp, 2, 65536);
  for (const auto& [name, value] :
       {std::pair{"search", search}, std::pair{"refinement", refinement}})
    if (value != "on" && value != "off" && value != "auto")
      problems.add(name, " = '", value, "' is unknown; choose one of auto, on, off");
  problems.collect([&] {
    const Loss& chosen = find_loss(loss);
    if (spp >= 1 && spp < chosen.least_spp)
      problems.add("loss = '", loss, "' needs spp of at least ", chosen.least_spp, ", not ", spp,
                   "; it multiplies different samples of a pixel");
  });
  problems.raise();
}

}  // namespace selenite
