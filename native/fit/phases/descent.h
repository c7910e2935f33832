// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "fit/objective/photo_agreement.h"
#include "fit/phases/low_roughness_restart.h"
#include "fit/solver/field_adam.h"
#include "fit/solver/joint_gauss_newton.h"

namespace selenite {

struct DescentOptions {
  /// Standard errors by which a block may not end worse than the best values: it begins with few
  /// equations, which may lead it far astray, and then begins anew from the best.
  double revert_sigmas = 2;
  int tolerance_window = 3;  ///< validations whose mean is compared with the tolerance
  /// After a multi-start: the first step of a field and the last one of an image, in learning rates.
  double first_rate = 4, last_rate = 0.25;
  /// Pixels of the photos that together determine a texel, first and last, and the largest share of an
  /// image over which its gradient is smoothed.
  double first_spread = 800, last_spread = 8, largest_spread = 1.0 / 80;
  /// Share that an iteration of Adam keeps of earlier residuals and noise.
  double kept = 0.8;
  double newest = 0.3;  ///< share of the last step in the mean that ends a block of an image
};

/// The iterations of a fit: each renders the photos, steps scalars, fields or both, and validates where it
/// is due.
class Descent final : public Phase {
 public:
  explicit Descent(const FitRun& run, DescentOptions options = {});

  static void plan(RenderPlan& plan);
  PhaseKind kind() const override { return PhaseKind::kDescent; }
  bool step(FitRun& run) override;
  double fraction() const override;
  void members(SavedState& state) override;

  /// For the refinement, at the end of the descent: a copy would double the memory of the fit. Null where the
  /// scalars were not stepped by Gauss-Newton, or together with fields.
  std::unique_ptr<GaussNewton> hand_over_gauss_newton();
  /// Null where voxels are not stepped together with scalars.
  const JointGaussNewton* joint() const { return joint_.get(); }

 private:
  /// Fields that Adam steps. Its moments are as large as all fields twice.
  struct FieldsByAdam {
    FieldAdam adam;
    PhotoAgreement agreement;
    explicit FieldsByAdam(const Fields& fields) : adam(fields), agreement(fields) {}
  };
  /// What an iteration makes of the photos and hands to the run when all of it has succeeded.
  struct Next;

  bool iterate(FitRun& run);
  /// Null where the scalars are not stepped by Gauss-Newton.
  const GaussNewton* gauss_newton() const;
  void observe(FitRun& run, std::size_t photo, const Block& block, Next& next) const;
  /// How a photo is rendered in this iteration.
  Evaluation of_step(const FitRun& run, std::size_t photo) const;
  /// The same with the derivatives that a step of the scalars takes.
  Evaluation with_derivatives(const FitRun& run, const Evaluation& how) const;
  bool steps_scalars(const Block& block) const;
  void observe_photos(FitRun& run, const Block& block, HistoryRow& row, Next& next) const;
  double kept() const;
  void watch(const Progress* progress, const Next& next);
  void step_all(const Block& block, bool reverted, Next& next);
  void step_fields(Next& next) const;
  bool begin_restart(const FitRun& run);
  bool is_over(const FitRun& run) const;
  bool finish(FitRun& run);
  bool within_tolerance(const FitRun& run) const;
  std::vector<FieldStep> field_steps(const FitRun& run) const;
  void smooth_images(FitRun& run, const Block& block);

  const FitProblem* problem_;
  const Strategy* strategy_;
  DescentOptions options_;
  BlockSchedule blocks_;
  std::unique_ptr<Optimiser> optimiser_;     ///< of the scalars; null: `joint_`
  std::optional<FieldsByAdam> by_adam_;      ///< of fields by Adam; nothing: `joint_` steps them
  std::unique_ptr<JointGaussNewton> joint_;  ///< of fields together with scalars
  FieldValues field_means_;                  ///< of a block so far
  LowRoughnessRestart restart_;
  int done_ = 0;
  bool weighed_ = false;  ///< the weights are those of the end
};

}  // namespace selenite
