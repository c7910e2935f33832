// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "fit/evaluate/photo_evaluator.h"
#include "fit/inference/informative_pixels.h"
#include "fit/phases/refined_point.h"
#include "fit/solver/joint_gauss_newton.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "FieldRefinementOptions".
struct FieldRefinementOptions {
  std::array<int, 3> shares{4, 2, 1};  ///< of the samples that the passes take
  /// The same beside texels, where scalars come from the multi-start and have a longer way. The last pass is
  /// repeated until its step is small, or until there are so many passes.
  std::array<int, 6> shares_with_texels{8, 8, 8, 4, 2, 1};
  int most_passes_with_texels = 8;
  /// A step of so many longest steps makes texels forget 1 - 1/e of the residuals before it.
  double forget_at = DampingOptions{}.forget_at;
  /// Of the samples of a refinement without fields that the last pass takes: the others are for the
  /// informative pixels.
  int share_of_samples = 5;
  int share_with_texels = 2;  ///< the same, where texels show in few pixels
  int least_of_pass = 32;     ///< samples: with fewer there is nothing to step by
  double converged_sigmas = kCertainSigmas, near = kLinearShare;  ///< as of `RefinementOptions`
  /// Samples of the first pass's derivatives in units of its own, as they select the informative pixels,
  /// and the share that those of the others are.
  int pilot = 2, share_after_pilot = 6;
  /// Samples of an informative pixel, in units of the whole picture's, and the share with derivatives.
  int informative_samples = 20, informative_derivative_share = 5;
  /// Errors beside voxels in units of those that noise, and the linear share of what hardly shows, explain:
  /// twenty fits from different random numbers scatter by so much more. Measured: docs/measurements/fields.md.
  double beyond_noise = 1.5;
  bool roughness_known = false;  ///< by more than these passes see: it stays

  std::span<const int> shares_of(bool texels) const {
    if (texels) return shares_with_texels;
    return shares;
  }
};

/// Three refinement passes, and more beside texels, where voxels are stepped together with scalars. Each has a second part: more
/// samples of the informative pixels (`InformativePixels`), which the first pass's differences select. The
/// fields move along with the scalars. Beside voxels a roughness that looks perfectly sharp is left as it is: how
/// sharp shows in little else than in what these may be wrong about.
class FieldRefinement {
 public:
  /// `problem` must outlive it. `optimiser`: whose instruments are taken; null: none.
  FieldRefinement(const Problem& problem, std::unique_ptr<GaussNewton> optimiser, Vector x,
                  FieldGaussNewton fields, std::uint64_t seed, int spp, int iteration_spp,
                  FieldRefinementOptions options = {});

  /// The next photo of a pass; false when it was the last of the last. Throws what `evaluate` throws.
  bool step(Evaluator& evaluator);
  double fraction() const;
  Point point() const { return {point_.x, fields_.values()}; }
  /// See `RefinedPoint::accept`.
  void accept(const Vector& x) { point_.accept(x); }
  const TrustReport& report() const { return point_.report; }
  bool roughness_known() const { return options_.roughness_known; }
  const GaussNewton& gauss_newton() const { return point_.gauss_newton; }
  const FieldGaussNewton& fields() const { return fields_; }
  FieldGaussNewton& fields() { return fields_; }
  /// Whether a pass begins, and its samples in units of those of an iteration.
  bool begins_pass() const { return !over_ && photo_ == 0; }
  double pass_weight() const {
    return static_cast<double>(pass_spp(point_.report.passes)) / iteration_spp_;
  }
  void members(SavedState& state);

 private:
  Observation derivatives(Evaluator& evaluator, int purpose, int portion, int spp,
                          std::size_t index, const Photo& photo) const;
  void gather_first_jacobians(Evaluator& evaluator);
  void gather(Evaluator& evaluator, int spp);
  void select_informative();
  /// The informative pixels of the next photo.
  bool measure_informative(Evaluator& evaluator);
  void end_pass();
  bool is_left_out(int k) const;
  int purpose() const { return 2 * point_.report.passes; }
  int pass_spp(int pass) const;
  std::span<const int> shares() const { return options_.shares_of(fields_.has_images()); }

  FieldRefinementOptions options_;
  bool has_jacobians_;
  RefinedPoint point_;
  FieldGaussNewton fields_;
  std::size_t photo_ = 0;  ///< the next of this pass; beyond the last: those of informative pixels
  std::uint64_t seed_;
  int spp_, iteration_spp_;
  std::vector<GaussNewton::PhotoEquations> photo_equations_;  ///< of this pass so far
  InformativePixels informative_;
  double residuals_kept_ = 0;  ///< beside texels: the share of those of earlier passes
  bool over_ = false;
};

}  // namespace selenite
