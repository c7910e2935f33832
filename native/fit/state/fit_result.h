// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "fit/evaluate/photo_evaluator.h"
#include "fit/evaluate/validation.h"
#include "fit/inference/confidence_intervals.h"
#include "fit/objective/residual_model.h"

namespace selenite {

/// One row of a fit's history: the state after `iteration` steps.
struct HistoryRow {
  int iteration = 0;
  Vector values;
  double loss = 0;        ///< mean over the photos, at the samples of a step
  double validation = 0;  ///< the same, unbiased, fixed seed, more samples; NaN: not done
  double validation_standard_error = 0;
  Color<double> mean_bias;                 ///< render minus photo, mean over the photos
  std::vector<Color<double>> field_means;  ///< of the voxels of each field
  void members(SavedState& state) {
    state(iteration, values, loss, validation, validation_standard_error, mean_bias, field_means);
  }
};

/// What a multi-start has found; losses are of small pictures in Gauss-Newton's first weights, without the
/// bias of noise and without detail that is noise.
struct MultiStartResult {
  int points = 0;             ///< evaluated, the start included; 0: there was no multi-start
  bool moved = false;         ///< whether the fit goes on elsewhere than at the start
  double start_loss = 0;      ///< at the user's values
  double loss = 0;            ///< where the fit goes on
  double standard_error = 0;  ///< of `loss` minus `start_loss`
};

enum class PhaseKind {
  kMultiStart,
  kDescent,
  kRefinement,
  kComparison,
  kRoughnessProfile,
  kParts,
  kShape
};
/// As shown to users: "multi-start", "descent" (of vertices too), "refinement", "comparison",
/// "parts".
const char* phase_text(PhaseKind phase);

enum class StopReason { kNone, kIterations, kConverged, kTolerance, kCancelled, kDropped, kError };
/// A few words, as shown to users and written to result.json.
const char* stop_text(StopReason reason);

/// Steps of vertices that had to be shortened.
struct ShapeSteps {
  int turning = 0;       ///< a face would have turned over
  int intersecting = 0;  ///< surfaces would have gone through each other
  int given_up = 0;      ///< of both: they were dropped
};

/// What a field says of the residuals, as shares of their squares.
struct FieldPattern {
  double explained = 0;  ///< of those beside one value at all places; NaN: not known
  double left = 0;       ///< of those at the end: what photos agree on that it does not show
};

struct FitResult : RenderCounts {
  Vector last;
  /// The newest values whose validation is not worse than the smallest one by more than its noise.
  /// Smallest alone would be a lottery: one bright path can outweigh the whole residual.
  Vector best;
  /// The fields that belong to `last` and `best`; shared, for they may be large.
  std::shared_ptr<const FieldValues> fields_last, fields_best;
  int best_iteration = 0;
  double best_validation = 0;  ///< NaN: none yet
  double best_validation_standard_error = 0;
  std::vector<PhotoReport> photos;  ///< at `best`; empty while the fit runs
  double start_validation = 0;      ///< of the user's values, by the same weights; NaN: none
  ModelError model_error{};         ///< that the residuals show, by the newest weights
  bool kept_start = false;          ///< `best` is the start, as nothing better was found
  int iterations = 0;               ///< steps done
  StopReason stopped = StopReason::kNone;
  std::string message;  ///< why, where `stopped` does not say it all
  PhaseKind phase = PhaseKind::kDescent;
  double phase_fraction = 0;  ///< of the phase
  MultiStartResult search;
  ShapeSteps shape_steps;
  std::vector<FieldPattern> patterns;  ///< one a field
  TrustReport report;
  std::vector<HistoryRow> history;

  void members(SavedState& state);
};

}  // namespace selenite
