// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/numpy.h>

#include <cstdint>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "fit/run/fit_job.h"

namespace selenite {

/// A running fit as Python sees it: what the job tells, and its values as a dict.
struct FitProgress {
  FitState state;
  std::string stopped_because;
  pybind11::dict values;
};

/// Of one parameter, lists over its components.
struct ParameterConfidence {
  std::vector<double> standard_error;
  std::vector<std::pair<double, double>> interval_90;
  std::vector<bool> determined;
  std::vector<std::optional<std::string>> at_bound, correlated_with;
  std::vector<double> samples_factor;
};

/// A WeakDirection with names in place of numbers.
struct NamedDirection {
  double deviation = 0;
  std::vector<std::string> components, captures;
};

/// A TrustReport with names in place of numbers.
struct NamedReport {
  pybind11::dict parameters;  ///< name -> ParameterConfidence; empty where nothing was verified
  int passes = 0, spp = 0;
  Misfit misfit;
  std::vector<pybind11::dict> alternative_minima;
  std::vector<std::string> ambiguous;
  std::vector<NamedDirection> weak_directions;
};

/// A PhotoReport with what was free alone.
struct FoundPhoto {
  double residual_rms = 0, unexplained = 0;
  std::optional<std::tuple<double, double, double>> shift, gain;
  std::optional<std::vector<std::pair<double, double>>> gain_interval_90;
};

/// Rows of all stages, an array for each column.
struct FitHistory {
  pybind11::array_t<int> iteration;
  pybind11::array_t<double> loss, validation, validation_standard_error, mean_bias;
  pybind11::dict values, field_means;
  std::optional<pybind11::array_t<int>> stage;  ///< of a fit in stages
};

/// A stage that has begun.
struct FoundStage {
  std::string name;
  std::vector<std::string> parameters;
  int iterations = 0, spp = 0, height = 0, best_iteration = 0;
  std::string stopped_because;
  std::int64_t samples = 0;
  double seconds = 0, cpu_seconds = 0;
  pybind11::dict values;
};

/// All that a fit has found so far.
struct FoundFit {
  pybind11::dict values_last, values_best, fields_last, fields_best;
  int best_iteration = 0;
  double best_validation = 0, best_validation_standard_error = 0, start_validation = 0;
  pybind11::dict captures;  ///< id -> FoundPhoto
  bool kept_start = false;
  ModelError model_error;
  int iterations = 0;
  StopReason stopped = StopReason::kNone;
  std::string stopped_because, optimiser;
  std::vector<Fault> faults;
  RenderCounts counts;
  double seconds = 0;
  MultiStartResult search;
  pybind11::dict patterns;  ///< name of a field -> FieldPattern
  ShapeSteps shape_steps;   ///< of all stages
  NamedReport report;
  FitHistory history;
  std::optional<std::vector<FoundStage>> stages;
};

FitProgress progress_of(const FitJob& job);
/// of_stage: of the stage that runs alone.
FitHistory history_of(const FitJob& job, bool of_stage);
/// fields: with `fields_last` and `fields_best`, else these are empty.
FoundFit found_by(const FitJob& job, bool fields);

}  // namespace selenite
