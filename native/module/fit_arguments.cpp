// SPDX-License-Identifier: GPL-3.0-or-later
#include "module/fit_arguments.h"

#include "module/named.h"

namespace py = pybind11;

namespace selenite {
FitSettings settings_of(const py::handle& object) {
  const Named named(
      object, "settings",
      {"loss", "optimiser", "iterations", "most_iterations", "spp", "tolerance", "seed", "depth",
       "threads", "accumulate", "validation_interval", "validation_spp", "search", "refinement",
       "refinement_spp", "precision", "prior", "finite_differences"});
  FitSettings settings;
  named.take("loss", settings.loss);
  named.take("optimiser", settings.optimiser);
  named.take("iterations", settings.iterations);
  named.take("most_iterations", settings.most_iterations);
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
  named.take("precision", settings.precision);
  named.take("prior", settings.prior);
  return settings;
}

}  // namespace selenite
