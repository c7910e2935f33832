// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "fit/phases/field_refinement.h"
#include "fit/state/phase.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "RoughnessProfileOptions".
struct RoughnessProfileOptions {
  double factor = 1.2;    ///< from one roughness to the next
  double least = 0.1;     ///< the first one at least: lower ones look alike
  int passes = 8;         ///< of the light at each
  int light_samples = 2;  ///< of a pass, in units of an iteration's
  double kept = 0.8;      ///< share of the residuals that a pass keeps: the light has moved since
  int samples = 4;        ///< by which they are compared, in units of a validation's
  /// By which a roughness must explain the photos worse to be the last.
  double sigmas = kCertainSigmas;
};

/// Where the world's image is unknown: the largest roughness that explains the photos as well as the best
/// one, each beside the light that suits it (profile likelihood).
///
/// Blurred light on a sharp body looks like sharp light on a blurring one, and pixels of the world's
/// image are wider than the reflection of a glossy body. Photos hence bound a roughness from above, and
/// hardly from below. The prior of the image prefers smooth light, so that steps lead to sharp bodies:
/// under any other light they would be wrong by their mirror images. Of explanations in which all blur is
/// the light's or all is the body's, the joint estimate of both picks the former (Levin et al. 2009,
/// "Understanding and evaluating blind deconvolution algorithms").
class RoughnessProfile final : public Phase {
 public:
  /// refinement: whose Jacobians are taken over. Null where there is nothing to do.
  static std::unique_ptr<RoughnessProfile> of(const FitRun& run, const FieldRefinement& refinement);
  /// One whose state is about to be read.
  explicit RoughnessProfile(const FitRun& run);

  static void plan(RenderPlan& plan);
  PhaseKind kind() const override { return PhaseKind::kRoughnessProfile; }
  bool step(FitRun& run) override;
  double fraction() const override;
  void members(SavedState& state) override;

  /// Whether a larger roughness has been chosen.
  bool moved() const { return moved_; }
  const GaussNewton& instruments() const { return instruments_; }
  /// The solver of the light beside the values that have been chosen.
  const FieldGaussNewton& fields() const { return chosen_.fields; }

 private:
  struct Candidate {
    Vector scalars;
    FieldGaussNewton fields;
    void members(SavedState& state) { state(scalars, fields); }
  };
  RoughnessProfile(const FitRun& run, const FieldGaussNewton& fields, GaussNewton instruments,
                   std::vector<int> components);
  bool is_clearly_worse(const Validation& found) const;
  /// Begins the next roughness of the present component, or of the next one; false after the last.
  bool begin_next();
  void solve_light(FitRun& run);

  RoughnessProfileOptions options_;
  const FitProblem* problem_;
  GaussNewton instruments_;      ///< of the refinement, for the next one
  std::vector<int> components_;  ///< the roughnesses among the scalars
  std::size_t which_ = 0;        ///< of them
  Candidate chosen_, tried_;
  Validation smallest_, validation_;  ///< of all, and of those that have been chosen
  int pass_ = 0;                      ///< of the roughness that is tried
  int tries_ = 0;                     ///< the values of the refinement are the first
  bool moved_ = false;
};

}  // namespace selenite
