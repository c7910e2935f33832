// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fit/problem/photo.h"
#include "fit/problem/uniform_fields.h"
#include "fit/solver/field_adam.h"
#include "fit/solver/field_gauss_newton.h"
#include "fit/problem/fields.h"
#include "fit/problem/loss.h"
#include "fit/solver/optimiser.h"
#include "fit/phases/alternative_minima.h"
#include "fit/phases/multi_start.h"
#include "fit/problem/settings.h"
#include "fit/problem/unknowns.h"
#include "fit/phases/refinement.h"

namespace selenite {

/// One row of a fit's history: the state after `iteration` steps.
struct HistoryRow {
  int iteration = 0;
  Vector values;
  double loss = 0;        ///< mean over the cameras, at the samples of a step
  double validation = 0;  ///< the same, unbiased, fixed seed, more samples; NaN: not done
  double validation_standard_error = 0;
  Color<double> mean_bias;                 ///< render minus photo, mean over the cameras
  std::vector<Color<double>> field_means;  ///< of the voxels of each field
  void members(SavedState& state);
};

/// What a fit is doing: looking around, stepping, looking again at what it has found.
enum class Phase { kMultiStart, kDescent, kRefinement };

enum class StopReason { kNone, kIterations, kConverged, kTolerance, kCancelled, kDropped, kError };
const char* phase_text(Phase phase);
/// A few words, as shown to users and written to result.json.
const char* stop_text(StopReason reason);

struct FitResult {
  Vector last;
  /// The newest values whose validation is not worse than the smallest one by more than its noise.
  /// Smallest alone would be a lottery: one bright path can outweigh the whole residual.
  Vector best;
  /// The fields that belong to `last` and `best`; shared, for they may be large.
  std::shared_ptr<const FieldValues> fields_last, fields_best;
  int best_iteration = 0;
  double best_validation = 0;
  double best_validation_standard_error = 0;
  int iterations = 0;  ///< steps done
  StopReason stopped = StopReason::kNone;
  std::string message;       ///< why, where `stopped` does not say it all
  std::int64_t samples = 0;  ///< paths traced, validation included
  std::int64_t dropped = 0;  ///< of them left out because they were not finite
  double cpu_seconds = 0;    ///< of the renders
  Phase phase = Phase::kDescent;
  double phase_fraction = 0;  ///< of the search, or of the refinement
  MultiStartResult search;
  TrustReport report;
  std::vector<HistoryRow> history;
};

/// Fits unknowns of a scene to photos, step by step in the caller's thread. Results depend on the
/// seed only, not on the number of threads.
///
/// The constructor checks everything and reports all problems at once, one line each:
/// InvalidArgument, or UnknownName when names that do not exist are the only problem.
class Fit {
 public:
  Fit(Scene scene, std::vector<Photo> photos, const std::vector<UnknownParameter>& unknowns,
      FitSettings settings);
  Fit(const Fit&) = delete;  // the optimiser refers to members
  Fit& operator=(const Fit&) = delete;

  /// One portion of the search, or one iteration: renders, records, steps, and validates when it is
  /// due. False when the fit is over. A cancelled step leaves values and history as they were before
  /// it and ends the fit.
  bool step(Progress* progress = nullptr);
  /// Everything that changes from step to step: a fit with the same arguments that is restored from
  /// it takes the same steps to the last bit. Between two steps only, and only where `can_be_saved`.
  std::string saved();
  /// Not during the search, which is short and which a new fit does in the same way, nor once the
  /// answer has been verified.
  bool can_be_saved() const {
    return !multi_start_ && trials_.empty() && !tried_ && !alternative_minima_ && refined_alternatives_ == 0;
  }
  /// Before the first step. InvalidArgument when it is damaged or of a fit with other arguments.
  void restore(std::string_view saved);
  /// So far; complete once `step` has returned false.
  const FitResult& result() const { return result_; }

  const Vector& values() const { return x_; }
  const Unknowns& unknowns() const { return unknowns_; }
  const Fields& fields() const { return fields_; }
  const std::vector<Photo>& photos() const { return photos_; }
  const FitSettings& settings() const { return settings_; }
  /// Those of the settings, or half of them where the rest goes into a longer look at the answer: where
  /// voxels are stepped together with scalars (`FieldGaussNewton`), looks at frozen values bring more.
  int all_iterations() const;
  const std::string& optimiser_name() const { return optimiser_name_; }
  /// Newest picture of each photo; empty before the first. Shared, never changed afterwards.
  const std::vector<std::shared_ptr<const Picture>>& previews() const { return previews_; }

 private:
  struct Validation {
    double loss = 0, unbiased = 0, variance = 0;
    std::vector<float> parts;  ///< of `unbiased`, pixel by pixel, all photos
    Color<double> bias;
    void members(SavedState& state);
  };

  Scene scene_at(const Vector& x, const FieldValues& fields) const {
    return fields_.scene_with(unknowns_.scene_with(scene_, x), fields);
  }
  void begin_multi_start(const OptimiserKind& kind, const std::vector<UnknownParameter>& wanted);
  bool run_multi_start(Progress* progress);
  bool iterate(Progress* progress);
  bool refine(Progress* progress);
  bool compare_alternatives(Progress* progress);
  void choose_minimum();
  void report_alternatives();
  void note_refinement(double fraction);
  bool stop_after_iterations();
  /// What is rendered at a vector of values.
  struct Subject {
    const Problem& problem;
    const Reparametrization* reparametrization;  ///< of differences; none: all are carried
    std::function<Scene(const Vector&)> scene_at;
  };
  Subject subject(const FieldValues& fields) const;
  RenderAt renderer(Subject subject, Progress* progress);
  /// See `render_derivatives`.
  Film derivatives(const Subject& subject, const Vector& x, const Photo& photo, int spp,
                   std::uint64_t seed, Purpose purpose, Differences which, Progress* progress);
  /// What moves in an iteration: scalars and fields together, or in turns.
  struct Block {
    bool scalars, fields;
    bool first;  ///< of its kind since the others moved
  };
  Block block(int iteration) const;
  bool is_scalar_block(int iteration) const;
  /// How many iterations before this one, or in all, moved what `member` says.
  int count_iterations(bool Block::*member, int iterations) const;
  std::vector<FieldStep> field_steps() const;
  void smooth(const Block& now);
  /// With roughnesses that are no larger than what looks sharp.
  Vector at_low_roughness(Vector x) const;
  bool is_low_roughness(const Vector& x) const;
  static bool is_equivalent(const Validation& sharp, const Validation& blurred);
  /// False where there is nothing to try.
  bool begin_trials();
  bool compare_trials(Progress* progress);
  /// Where an image is fitted after a search, the IOR of what refracts sharply is looked for before each
  /// turn of the scalars, in place of steps by derivatives.
  bool searches_ior() const;
  /// The components that are looked for so.
  std::vector<int> sharp_refractions(const Vector& x) const;
  /// With those where they suit the photos best.
  Vector ior_line_search(Vector x, Progress* progress);
  /// Adds the gradient by the fields to `gradients`, if it is their turn.
  Observation observe(const Vector& x, const FieldValues& fields, int index, const Block& block,
                      std::vector<std::vector<double>>& gradients, FieldGaussNewton* newton,
                      Progress* progress);
  Validation validate(const Vector& x, const FieldValues& fields, int spp, Progress* progress);
  Validation validate(const Vector& x, const FieldValues& fields, Progress* progress) {
    return validate(x, fields, settings_.chosen_validation_spp(), progress);
  }
  /// Of two that are about as good, to the sharp one: see `is_equivalent`. Not where voxels are stepped with
  /// the scalars: there the last of both are the nearest, and a sharp body is tried at them.
  bool gives_way_to_best(const Vector& x, const Validation& validation) const;
  bool may_give_way_to_best(const Vector& x) const;
  void note_validation(HistoryRow& row, const Validation& validation);
  /// By more than so many standard errors of the difference, pixel against pixel: the seeds are the
  /// same, so most of the noise is common to both.
  static bool is_worse(const Validation& one, const Validation& than, double sigmas);
  /// All iterations are done, or the values have settled.
  bool is_over() const;
  /// Settles on the optimiser's answer, validates it, and ends the fit or has it verified.
  bool finish(Progress* progress);
  /// Records `x`, whose validation that is, as the final state. True where it became the best one:
  /// where `told` that it is, by more samples than a validation's, it does.
  bool accept(const Vector& x, const Validation& validation, bool accepted = false);
  bool wants_refinement() const;
  void start_refinement();
  void refine_from(const Vector& x, const Optimiser* optimiser);
  bool stop(StopReason reason, std::string message = {});
  bool too_many_dropped();
  bool within_tolerance() const;
  std::string fingerprint() const;
  void members(SavedState& state);
  RenderSettings render_settings(const Photo& photo, int spp, std::uint64_t seed) const;
  void count(const Film& film, const Photo& photo);

  Scene scene_;
  std::vector<Photo> photos_;
  Unknowns unknowns_;
  Fields fields_;
  FitSettings settings_;
  const Loss& loss_;
  SlotLayout layout_;
  Problem problem_;
  std::string optimiser_name_;
  std::unique_ptr<Optimiser> optimiser_;
  Purpose purpose_ = Purpose::kGradient;        ///< of the derivatives of an iteration
  std::unique_ptr<Reparametrization> reparametrization_;    ///< of differences; none: all are carried
  std::unique_ptr<UniformFields> uniform_;            ///< what the search is about beside fields
  std::unique_ptr<MultiStart> multi_start_;              ///< until it is over
  std::vector<Vector> others_;                  ///< that the search refined and left
  std::unique_ptr<Refinement> refinement_;  ///< from the end of the iterations on
  std::unique_ptr<AlternativeMinima> alternative_minima_;              ///< from the end of the refinement on
  struct Refined {
    Vector x;
    TrustReport report;
  };
  Refined refined_;               ///< by the newest refinement
  std::optional<Refined> accepted_;  ///< once it has been compared with alternatives
  std::vector<Vector> pending_;     ///< alternatives that stood and have not been verified
  std::vector<Refined> equivalent_;   ///< those that were, and that nothing tells from the answer
  int refined_alternatives_ = 0;
  FieldAdam field_adam_;
  std::unique_ptr<FieldGaussNewton> field_gauss_newton_;  ///< once a search is over: of few voxels
  /// Values of the scalars that are compared before a turn of theirs.
  struct Trial {
    Vector x;
    Validation validation;
  };
  std::vector<Trial> trials_;        ///< until one of them has been taken
  std::optional<Validation> tried_;  ///< of that, until the turn has begun
  bool alternates_ = false;
  bool searched_ = false;  ///< beside fields
  Vector x_;
  FieldValues field_values_;
  FieldValues field_means_;  ///< of a turn so far
  FitResult result_;
  Validation smallest_, best_;  ///< of `best`; without parts: none yet
  std::string first_dropped_;
  std::vector<std::shared_ptr<const Picture>> previews_;
};

}  // namespace selenite
