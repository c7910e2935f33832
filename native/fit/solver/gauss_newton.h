// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <deque>
#include <optional>
#include <vector>

#include "fit/problem/reparametrization.h"
#include "fit/solver/instrumental_variables.h"
#include "fit/solver/optimiser.h"

namespace selenite {

/// Instrumental Gauss-Newton for few unknowns.
///
/// A step by noisy Jacobians multiplies noise by noise and throws most samples away. Here residuals
/// of fresh half-buffers meet instruments Z: Jacobians of the other halves, accumulated over
/// iterations, clipped and filtered. Whatever Z's own errors are, E[Z^T w (I - photo)] is zero at the
/// solution, so they slow the way and cannot move its end. All iterations together are one recursive
/// least squares problem in `Reparametrization`; directions that are still noise do not move. It minimises
/// squares weighted by 1 / (noise^2 + (a share of brightness)^2), whatever the fit's (least
/// squares) loss. Source: docs/method/optimisation.md, "Instrumental Gauss-Newton".
class GaussNewton final : public Optimiser {
 public:
  explicit GaussNewton(const Problem& problem);
  Vector step(const Vector& x, std::span<const Observation> seen,
              FieldGaussNewton* fields = nullptr) override;
  Vector step_by_residuals(const Vector& x, std::span<const Observation> seen,
                FieldGaussNewton* fields = nullptr) override;
  Vector estimate(const Vector& x) const override;
  void reset_equations() override;
  void reset_everything() override;
  bool converged() const override { return converged_; }

  /// For a look at frozen values: what one photo says about them, in the weights and with the
  /// instruments that have been gathered.
  struct WeightedResidual {
    Halves residual;
    InstrumentalVariables::Set z;
    Eigen::VectorXf weight;
    void members(SavedState& state) { state(residual, z, weight); }
  };
  struct PhotoEquations {
    WeightedResidual whole;
    std::optional<WeightedResidual> informative{};  ///< some of its pixels, by samples of their own; see `InformativePixels`
    void members(SavedState& state) { state(whole, informative); }
  };
  /// `derivatives` at x join the sums, `weight` being their samples in units of those of an iteration.
  void gather(const Vector& x, const Observation& derivatives, double weight);
  /// Of photo i; `residual` is a render of its own with other seeds.
  PhotoEquations equations(std::size_t i, const Film& residual) const;
  /// Makes the instruments, all photos', those that the fields beside cannot imitate. The fields see
  /// the residuals of the whole photos, and those alone.
  /// Returns as `FieldGaussNewton::separate` does.
  Eigen::MatrixXd eliminate_fields(std::vector<PhotoEquations>& all, FieldGaussNewton& fields) const;
  const Reparametrization& reparametrization() const { return reparametrization_; }
  /// Of the residuals of photo i, 3 numbers a pixel.
  const Eigen::VectorXf& weight(std::size_t i) const { return views_[i].weight; }
  /// The same by the variance of one sample.
  Eigen::VectorXf weight_by(std::size_t i, const Eigen::VectorXf& variance) const;

  std::unique_ptr<Optimiser> clone() const override { return std::make_unique<GaussNewton>(*this); }
  void members(SavedState& state) override;

 private:
  using Matrix = Eigen::MatrixXd;

  /// What belongs to one photo.
  struct View {
    Eigen::VectorXf weight;    ///< per channel of a pixel; sums to about 1 / brightness^2
    Eigen::VectorXf variance;  ///< of one sample, summed over recent iterations
    InstrumentalVariables jacobians;
    void members(SavedState& state);
  };
  /// Sums over pixels of one iteration.
  struct Measurement {
    Matrix normal;      ///< Z^T w J, cross-buffer; not symmetric
    Matrix covariance;  ///< of `gradient`
    Vector gradient;    ///< Z^T w (I - photo)
    Vector strength;    ///< diagonal of Z^T w Z
  };
  /// Adds those of one photo, whose jacobians say `z`.
  static void add(Measurement& sum, const InstrumentalVariables::Set& z, const Eigen::VectorXf& weight,
                  const Halves& halves);
  /// Joins the sums, of which `keep` is kept. Throws as `step`.
  void join(const Measurement& now, const Vector& u, double keep);
  struct NoisyLoss {
    double value = 0, variance = 0;
  };

  void set_first_weights();
  void learn_variance(std::span<const Observation> seen, double keep);
  NoisyLoss weighted_loss(const std::vector<Halves>& halves) const;
  bool worse_than_best(const NoisyLoss& loss) const;
  Measurement measure(std::span<const Observation> seen, const std::vector<Halves>& halves,
                      FieldGaussNewton* fields) const;
  InstrumentalVariables::Set instrumental_variables(std::size_t i) const;
  std::vector<InstrumentalVariables::Set> instrumental_variables(std::span<const Observation> seen,
                                             FieldGaussNewton& fields) const;
  /// Where a solution leads, per component: the step to take, and what is left to go, whole and with
  /// one standard deviation of what is known about it.
  struct DampedStep {
    Vector step, remaining;
  };

  Matrix prior() const;
  bool is_roughness(Eigen::Index k) const;
  DampedStep bounded_step(const Vector& u, bool fix_roughness = false) const;
  void show(std::span<const Observation> seen, const std::vector<Halves>& halves,
            FieldGaussNewton* fields) const;
  double kept() const;
  double kept_with_fields(int ahead = 0) const;
  /// The step, with the fields beside it, if there are.
  Vector advance(const Vector& u, const DampedStep& way, FieldGaussNewton* fields);
  DampedStep free_step(const std::vector<Eigen::Index>& free, const Matrix& normal, const Vector& residual,
               const Vector& scale) const;
  double least_damping() const;

  const Problem* problem_;
  Reparametrization reparametrization_;
  std::vector<View> views_;
  int iteration_ = 0;
  double variance_count_ = 0;  ///< renders in View::variance
  int next_weighing_ = 3;      ///< iteration that puts them into the weights; doubles each time

  // Recursive least squares: normal_ u = right_, and the covariance of right_.
  Matrix normal_, covariance_;
  Vector right_, strength_;
  int seen_ = 0;  ///< iterations that joined them, those of fields that went along included

  double damping_;
  double last_move_ = 0;  ///< largest component of the last step in units of its cap
  int rejected_ = 0;      ///< in a row
  bool converged_ = false;
  NoisyLoss best_loss_;
  bool has_best_ = false;
  Vector best_u_;
  std::deque<Vector> accepted_;
};

}  // namespace selenite
