// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "fit/phases/alternative_minima.h"
#include "fit/phases/descent.h"
#include "fit/phases/field_refinement.h"
#include "fit/phases/multi_start.h"
#include "fit/phases/parts/parts_phase.h"
#include "fit/phases/roughness_profile.h"
#include "fit/phases/starts/alignment_start.h"
#include "fit/phases/starts/light_start.h"
#include "fit/phases/starts/rotation_start.h"

// The phases of a fit beside `Descent`: each drives what computes, and hands on what it has found.
namespace selenite {

class MultiStartPhase final : public Phase {
 public:
  MultiStartPhase(FitRun& run, AlternativeMinima& minima);
  static void plan(RenderPlan& plan);
  PhaseKind kind() const override { return PhaseKind::kMultiStart; }
  bool step(FitRun& run) override;
  void end_early(FitRun& run) override;
  double fraction() const override;
  void members(SavedState& state) override;

 private:
  /// The next portion of the search, or of what follows it; false when nothing is left.
  bool search(FitRun& run);
  void hand_on(FitRun& run);

  std::unique_ptr<RotationStart> rotation_;    ///< null: no rotation is unknown
  std::unique_ptr<LightStart> light_;          ///< null: the light is known
  std::unique_ptr<AlignmentStart> alignment_;  ///< null: no photo is aligned
  PhotoEvaluator evaluator_;                   ///< of the scalars, or of uniform fields
  MultiStart multi_start_;
  bool searching_ = true;  ///< not while photos are aligned
  AlternativeMinima* minima_;
  UniformFields* uniform_;  ///< null: scalars are varied
};

class RefinementPhase final : public Phase {
 public:
  /// optimiser: whose instruments are taken; null: none.
  RefinementPhase(const FitRun& run, AlternativeMinima& minima, const Alternative& from,
                  std::unique_ptr<GaussNewton> optimiser);
  static void plan(RenderPlan& plan);
  PhaseKind kind() const override { return PhaseKind::kRefinement; }
  bool step(FitRun& run) override;
  double fraction() const override { return refinement_.fraction(); }
  void members(SavedState& state) override { state(refinement_); }

 private:
  Refinement refinement_;
  AlternativeMinima* minima_;
};

/// Refinement where voxels are stepped together with scalars. Alternatives would need fields of their own.
class FieldRefinementPhase final : public Phase {
 public:
  FieldRefinementPhase(FitRun& run, FieldGaussNewton fields, std::unique_ptr<GaussNewton> optimiser,
                       bool roughness_known = false);
  const FieldRefinement& refinement() const { return refinement_; }
  static void plan(RenderPlan& plan);
  PhaseKind kind() const override { return PhaseKind::kRefinement; }
  bool step(FitRun& run) override;
  double fraction() const override { return refinement_.fraction(); }
  void members(SavedState& state) override { state(refinement_, gathered_); }

 private:
  /// The derivatives of the next photo by texels, as a pass begins with them.
  void gather_texels(FitRun& run);

  FieldRefinement refinement_;
  std::size_t gathered_ = 0;  ///< photos of this pass whose derivatives by texels are known
};

class ComparisonPhase final : public Phase {
 public:
  ComparisonPhase(std::unique_ptr<MinimaComparison> comparison, AlternativeMinima& minima)
      : comparison_(std::move(comparison)), minima_(&minima) {}
  static void plan(RenderPlan& plan);
  PhaseKind kind() const override { return PhaseKind::kComparison; }
  bool step(FitRun& run) override;
  double fraction() const override { return comparison_->fraction(); }
  void members(SavedState& state) override { state(*comparison_); }

 private:
  std::unique_ptr<MinimaComparison> comparison_;
  AlternativeMinima* minima_;
};

}  // namespace selenite
