// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "fit/inference/informative_pixels.h"
#include "fit/phases/multi_start.h"
#include "fit/inference/confidence_intervals.h"

namespace selenite {

/// Looks again at the answer of a fit, with fresh seeds and frozen values, and says how sure it is.
///
/// All samples of a look are for the same values, so its step and its covariance
/// H^-1 Cov(g) H^-1 need no assumption about the way that led there. Cov(g) is summed from the
/// residuals themselves, pixel by pixel: the noise of the photos is in it without being known. The
/// answer moves by that step; where it is more than noise the look is repeated from there, and if the
/// last step still is, its length is an error beside the noise: it may have gone too far, or half of
/// the way. The first looks take few samples: they are the way to where the next one begins, and where
/// the last step is mostly their noise it is weighed against them by the samples of both. What may
/// be known badly at the end, as its slope vanishes near there, is looked at once more from beside
/// (beside.h), and where that leads elsewhere there is one look more.
///
/// Beside fields there are three looks, and each has a second part: a closer one at the pixels that tell
/// most (`InformativePixels`). The differences of the first look, more than its own samples, tell which they are.
class Refinement {
 public:
  /// `problem` must outlive it. Takes instruments from `optimiser` where there is one that has some.
  /// `fields`: unknown too, and must outlive it. They go along with the values, so that `render` has to
  /// show them where they stand by then; nothing is looked at from beside, and a roughness that looks
  /// sharp is left as it is.
  Refinement(const Problem& problem, const Optimiser* optimiser, Vector x, std::uint64_t seed,
               int spp, int iteration_spp, FieldGaussNewton* fields = nullptr);
  /// The next photo of a pass; false when it was the last of the last.
  bool step(const RenderAt& render);
  double fraction() const;
  const Vector& values() const { return x_; }
  /// After the last step: the answer is not `values` but `x`, for what they were found by does not
  /// hold that far. How far they are apart is an error beside the noise.
  void accept(const Vector& x);
  const TrustReport& report() const { return report_; }
  /// Of the residuals of each photo, by what was seen of their noise.
  std::vector<Eigen::VectorXf> weights() const;

 private:
  Observation derivatives(int purpose, int portion, int spp, std::size_t photo_index, const Photo& photo,
                          const RenderAt& render) const;
  void gather_first_jacobians(const RenderAt& render);
  /// The derivatives of this photo that go with residuals of `spp` samples.
  void gather(int spp, const RenderAt& render);
  bool is_left_out(int k) const;
  bool is_roughness(int k) const;
  void select_informative();
  /// The next photo where it is in informative.
  bool measure_informative(const RenderAt& render);
  void end_with_fields();
  void end_pass();
  double reach_of(const Estimate& now) const;
  void apply(const Estimate& now);
  /// Goes on with a look from `x`, which gathers instruments of its own.
  void expand_at_offset(const Vector& x);
  void end_offset();
  /// One more look, from where that has led.
  void refine_after_offset();
  /// `way`, in `Reparametrization`, is an error beside the noise of the answer x.
  void widen(const Vector& way, const Vector& x);
  /// What is known of x.
  void report_components(const Estimate& now, const Vector& x);
  int purpose() const;
  int pass_spp(int pass) const;
  double noise_of_step() const;

  const Problem* problem_;
  GaussNewton gauss_newton_;
  bool has_jacobians_;
  NormalEquations found_;  ///< of this pass so far
  Vector u_;        ///< of the last pass, in `Reparametrization`
  OtherPasses others_;
  std::size_t photo_ = 0;  ///< the next of this pass; beyond the last: those in focus
  Vector x_;
  std::uint64_t seed_;
  int spp_, iteration_spp_;
  FieldGaussNewton* fields_;
  std::vector<GaussNewton::PhotoEquations> photo_equations_;  ///< in this pass so far, where there are fields
  InformativePixels informative_;
  bool over_ = false;
  /// What belongs to the answer, while a look is taken from beside it.
  struct Suspended {
    GaussNewton gauss_newton;
    NormalEquations found;
    Vector u, x;
  };
  std::optional<Suspended> suspended_;
  bool after_offset_ = false;  ///< this look begins where one from beside has led
  TrustReport report_;
};

}  // namespace selenite
