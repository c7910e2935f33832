// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include "fit/objective/photo_weights.h"
#include "fit/problem/reparametrization.h"
#include "fit/problem/saved_state.h"
#include "fit/solver/damped_step.h"
#include "fit/solver/damping_control.h"
#include "fit/solver/instrumental_variables.h"
#include "fit/solver/optimiser.h"
#include "fit/solver/recursive_least_squares.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "GaussNewtonOptions". Lengths are in longest steps
/// (`Reparametrization::cap`).
struct GaussNewtonOptions {
  DampingOptions damping{};
  DampedStepOptions step{};
  PixelWeightsOptions weights{};
  InstrumentalVariablesOptions instruments{};
  double least_jacobian_kept = 0.3;  ///< share of the Jacobian sums that every step keeps
  /// Equations count with this power of their iteration's number. Early ones were made far from the
  /// answer, where pictures change by other slopes: with equal weights errors fall as t^-0.65 only.
  double aging = 1;
  /// Steps without derivatives, while fields move: share of the equations that is kept, as those before
  /// are about other fields, and the least damping.
  double follow_kept = 0.8, follow_damping = 1;
  /// From this iteration on the longest step shrinks as 1 / iteration. The way that is left stays
  /// unlimited (harmonic series), but noise cannot move a settled fit so far that it forgets.
  double shrink_from = 10;
  std::size_t averaged = 8;         ///< iterates in the mean that is the estimate
  int least_iterations = 10;        ///< before a fit may converge
  double converged = kLinearShare;  ///< largest remaining distance at convergence
};

/// Instrumental Gauss-Newton for few unknowns.
///
/// A step by noisy Jacobians multiplies noise by noise and loses most samples. Here residuals of fresh
/// half-buffers meet instruments Z: Jacobians of the other halves, accumulated over iterations, clipped
/// and filtered. Whatever the errors of Z are, E[Z^T w (I - photo)] is zero at the solution: they slow
/// the way and leave its end. All iterations together are one recursive least squares problem in
/// `Reparametrization`; directions that are still noise do not move.
///
/// It minimises what the loss of the fit is, by the weights of `PhotoWeights`. Source: docs/method/optimisation.md, "Instrumental Gauss-Newton".
class GaussNewton final : public ResidualOptimiser {
 public:
  explicit GaussNewton(const Problem& problem, const GaussNewtonOptions& options = {});
  Vector step(const Vector& x, std::span<const Observation> seen) override;
  /// Roughnesses stay: fields take up what blur would be needed for, until all derivatives are new.
  Vector step_by_residuals(const Vector& x, std::span<const Observation> seen) override;
  Vector estimate(const Vector& x) const override;
  void reset_equations() override;
  void reset_everything() override;
  bool converged() const override { return converged_; }
  std::unique_ptr<Optimiser> clone() const override { return std::make_unique<GaussNewton>(*this); }
  void members(SavedState& state) override;

  // For refinement passes at fixed values.

  /// What one render of a photo says about the values, with the instruments that have been gathered.
  struct WeightedResidual {
    Halves residual;
    InstrumentalVariables::Set z;
    Eigen::VectorXf weight;
    void members(SavedState& state) { state(residual, z, weight); }
  };
  struct PhotoEquations {
    WeightedResidual whole;
    /// Some of its pixels, by samples of their own; see `InformativePixels`.
    std::optional<WeightedResidual> informative{};
    /// The residual of the whole without the prior of a free gain, where there is one.
    std::optional<Halves> of_photo{};
    /// By what its errors exceed the residuals of the whole; empty: 1. Made at the end of a pass, of which no state
    /// is kept.
    Eigen::VectorXf widening{};
    void members(SavedState& state) { state(whole, informative, of_photo); }
  };
  /// `derivatives` at x join the sums; `weight`: their samples in units of those of an iteration.
  void gather(const Vector& x, const Observation& derivatives, double weight);
  /// Those of photo i; `residual` is a render of its own with other seeds.
  PhotoEquations equations(std::size_t i, const Film& residual) const;
  /// A residual of photo i that is in equations; instruments of others may use its picture. `weight`: as
  /// of `gather`.
  void gather_picture(std::size_t i, const Halves& residual, double weight);
  const Reparametrization& reparametrization() const { return reparametrization_; }
  const PhotoWeights& weights() const { return own_weights_ ? *own_weights_ : *problem_->weights; }

  // The parts of a step, for `JointGaussNewton`. Each `step` calls them in this order.

  /// Begins an iteration; returns the residuals of its renders.
  std::vector<Halves> begin_step(std::span<const Observation> seen);
  DampingControl& damping() { return damping_; }
  const DampingControl& damping() const { return damping_; }
  /// Share of the iterations that is over. Those beyond the planned ones begin anew: they are made
  /// where values are still far, and a low damping lets these jump.
  double done() const {
    const int planned = problem_->iterations;
    const int over =
        problem_->goes_on && iteration_ > planned ? (iteration_ - 1) % planned + 1 : iteration_;
    return over / static_cast<double>(planned);
  }
  /// The Jacobians of the renders at x join the instruments, photo by photo: those of all take more memory
  /// than the instruments. Returns the share of the older ones that is kept.
  double add_jacobians(const Vector& x, std::span<const Observation> seen);
  /// Whether there are instruments of all photos.
  bool has_instruments() const;
  InstrumentalVariables::Set instruments(std::size_t i,
                                         Denoising denoising = Denoising::kFilter) const;
  /// The iteration's equations join the sums. Throws as `step`.
  void join(const Measurement& now, const Vector& u, double keep);
  /// From `u` in `Reparametrization`, within the limits of this iteration.
  DampedStep bounded_step(const Vector& u, bool fix_roughness = false) const;
  /// Ends an iteration; returns the values to which the step leads.
  Vector end_step(const Vector& u, const DampedStep& step, std::span<const Observation> seen,
                  double jacobian_kept);

 private:
  /// Forgets what the weights of residuals had a part in, if they have changed.
  void follow_weights();
  Measurement measure(std::span<const Observation> seen, const std::vector<Halves>& halves) const;

  const Problem* problem_;
  GaussNewtonOptions options_;
  Reparametrization reparametrization_;
  std::optional<PhotoWeights> own_weights_;         ///< where the problem has none
  int weights_version_ = 0;                         ///< by which losses and instruments are
  std::vector<InstrumentalVariables> instruments_;  ///< of each photo
  RecursiveLeastSquares equations_;
  DampingControl damping_;
  int iteration_ = 0;
  bool converged_ = false;
  std::deque<Vector> accepted_;  ///< the newest iterates, in `Reparametrization`
};

}  // namespace selenite
