// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/gauss_newton.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "fit/solver/field_gauss_newton.h"
#include "fit/problem/saved_state.h"
#include "fit/problem/pixel_weights.h"

namespace selenite {
namespace {

// Constants of the recipe. Source: docs/method/optimisation.md.
constexpr double kFirstDamping = 0.1;
constexpr double kEarlyDamping = 0.05, kLateDamping = 0.002;  ///< smallest, before and after:
constexpr double kLateFrom = 0.64;                            ///< share of the iterations
constexpr double kDampingDown = 1.0 / 3, kDampingUp = 5;
constexpr double kForgetAt = 0.5;  ///< caps; a step of that size keeps 1/e of the past
constexpr double kLeastKept = 0.1, kLeastJacobianKept = 0.3;
/// Equations count with this power of their iteration's number: early ones were made far from the
/// answer, where pictures change by other slopes. Those of all alike cost a fit the last of its way
/// (an error that falls as t^-0.65 where differences measure 1.5 times the slope); these a seventh
/// more noise, which refinement takes away again.
constexpr double kAging = 1;
/// Where fields move: what is kept of the equations before, which told of other fields, and the least
/// damping.
constexpr double kFollowKept = 0.8, kFollowDamping = 1;
constexpr double kLargeMove = 0.25;  ///< caps; smaller steps are never rejected
constexpr int kMostRejections = 3;
constexpr double kWorseBy = 0.1, kWorseSigmas = 2;
constexpr std::size_t kAveraged = 8;
/// Arrived: so many iterations, and no more than that share of the caps left to go. A look at frozen
/// values ends the way better than more iterations; but it needs their derivatives.
constexpr int kLeastIterations = 10;
constexpr double kConverged = 0.1;
constexpr Eigen::Index kBlock = 3 * 1024;  ///< rows per sum in double

/// a^T diag(w) b, in double and in fixed order.
template <class A, class B>
Eigen::MatrixXd weighted_product(const A& a, const Eigen::VectorXf& w, const B& b) {
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(a.cols(), b.cols());
  for (Eigen::Index i = 0; i < a.rows(); i += kBlock) {
    const Eigen::Index n = std::min(kBlock, a.rows() - i);
    const Eigen::MatrixXd left = a.middleRows(i, n).template cast<double>();
    const Eigen::MatrixXd right = b.middleRows(i, n).template cast<double>();
    sum += left.transpose() * (w.segment(i, n).cast<double>().asDiagonal() * right);
  }
  return sum;
}

}  // namespace

GaussNewton::GaussNewton(const Problem& problem)
    : problem_(&problem),
      reparametrization_(problem.unknowns),
      views_(problem.photos.size()),
      normal_(Matrix::Zero(problem.unknowns.size(), problem.unknowns.size())),
      covariance_(normal_),
      right_(Vector::Zero(problem.unknowns.size())),
      strength_(right_),
      damping_(kFirstDamping) {
  set_first_weights();
}

void GaussNewton::View::members(SavedState& state) { state(weight, variance, jacobians); }

void GaussNewton::members(SavedState& state) {
  state(views_, iteration_, variance_count_, next_weighing_, normal_, covariance_, right_,
        strength_, damping_, last_move_, rejected_, converged_, best_loss_, has_best_, best_u_,
        accepted_, seen_);
}

void GaussNewton::set_first_weights() {
  for (std::size_t i = 0; i < views_.size(); ++i) {
    const Photo& photo = problem_->photos[i];
    views_[i].weight = relative_weights(photo, views_.size());
    views_[i].variance = Eigen::VectorXf::Zero(views_[i].weight.size());
  }
}

/// Noise by pixel is learned on the way and put into the weights twice, from earlier seeds only:
/// the start may be far from where the noise (caustics, say) will be. Sums in the old weights stay:
/// they are true equations for the same unknowns.
void GaussNewton::learn_variance(std::span<const Observation> seen, double keep) {
  variance_count_ = keep * variance_count_ + 1;
  for (const Observation& one : seen) {
    View& view = views_[static_cast<std::size_t>(one.photo)];
    const Eigen::Map<const Eigen::VectorXf> variance(&one.film.variance.front().r,
                                                     view.variance.size());
    view.variance = view.variance * static_cast<float>(keep) +
                    variance.cwiseMax(0.f) * static_cast<float>(one.film.spp);
  }
  if (iteration_ != next_weighing_) return;
  next_weighing_ *= 2;
  for (std::size_t i = 0; i < views_.size(); ++i) {
    const Photo& photo = problem_->photos[i];
    views_[i].weight =
        weight_by(i, box_blur(views_[i].variance, photo.width, photo.height, kPixelWeights.noise_radius) /
                         static_cast<float>(variance_count_));
  }
  has_best_ = false;  // losses in other weights do not compare
}

Eigen::VectorXf GaussNewton::weight_by(std::size_t i, const Eigen::VectorXf& variance) const {
  return noise_weights(problem_->photos[i], views_.size(), variance);
}

/// Unbiased: the halves are independent.
GaussNewton::NoisyLoss GaussNewton::weighted_loss(const std::vector<Halves>& halves) const {
  NoisyLoss loss;
  for (std::size_t v = 0; v < halves.size(); ++v) {
    const Halves& half = halves[v];
    for (Eigen::Index i = 0; i < half.variance.size(); i += 3) {
      double spread = 0;  // the channels of a pixel vary together
      for (Eigen::Index j = i; j < i + 3; ++j) {
        const double weight = views_[v].weight[j], variance = half.variance[j];
        const double product =
            static_cast<double>(half.residual_a[j]) * static_cast<double>(half.residual_b[j]);
        loss.value += weight * product;
        spread += weight * std::sqrt(2 * std::max(product, 0.0) * variance + variance * variance);
      }
      loss.variance += spread * spread;
    }
  }
  return loss;
}

bool GaussNewton::worse_than_best(const NoisyLoss& loss) const {
  if (!has_best_ || last_move_ <= kLargeMove || rejected_ >= kMostRejections) return false;
  const double noise = std::sqrt(loss.variance + best_loss_.variance);
  return loss.value >
         best_loss_.value + kWorseSigmas * noise + kWorseBy * std::abs(best_loss_.value);
}

void GaussNewton::add(Measurement& sum, const InstrumentalVariables::Set& z, const Eigen::VectorXf& w,
                      const Halves& halves) {
  sum.normal += (weighted_product(z.a.filtered, w, z.b.slopes) +
                 weighted_product(z.b.filtered, w, z.a.slopes)) /
                2;
  sum.gradient += (weighted_product(z.a.filtered, w, halves.residual_b) +
                   weighted_product(z.b.filtered, w, halves.residual_a)) /
                  2;
  const Eigen::VectorXf noise = w.cwiseAbs2().cwiseProduct(halves.variance);
  for (const Jacobian* one : {&z.a.filtered, &z.b.filtered}) {
    sum.covariance += weighted_product(*one, noise, *one) / 4;
    sum.strength += weighted_product(*one, w, *one).diagonal() / 2;
  }
}

void GaussNewton::join(const Measurement& now, const Vector& u, double keep) {
  for (Eigen::Index k = 0; k < u.size(); ++k)
    if (!std::isfinite(now.gradient[k]) || !std::isfinite(now.normal(k, k)))
      throw std::runtime_error("The derivative with respect to " +
                               problem_->unknowns.components()[static_cast<std::size_t>(k)].name +
                               " is not finite; narrow its bounds, or report this scene");
  normal_ = keep * normal_ + now.normal;
  right_ = keep * right_ + now.normal * u - now.gradient;
  covariance_ = keep * keep * covariance_ + now.covariance;
  strength_ = keep * strength_ + now.strength;
}

InstrumentalVariables::Set GaussNewton::instrumental_variables(std::size_t i) const {
  return views_[i].jacobians.all(problem_->layout, problem_->photos[i], views_[i].weight);
}

std::vector<InstrumentalVariables::Set> GaussNewton::instrumental_variables(std::span<const Observation> seen,
                                                        FieldGaussNewton& fields) const {
  std::vector<InstrumentalVariables::Set> z;
  std::vector<FieldGaussNewton::Regressors> all;
  for (const Observation& one : seen)
    z.push_back(instrumental_variables(static_cast<std::size_t>(one.photo)));
  for (std::size_t k = 0; k < seen.size(); ++k)
    all.push_back({&z[k], &views_[static_cast<std::size_t>(seen[k].photo)].weight});
  fields.solve(iteration_ / static_cast<double>(problem_->iterations));
  (void)fields.eliminate_fields(all);  // steps follow what is known, whatever is not
  return z;
}

GaussNewton::Measurement GaussNewton::measure(std::span<const Observation> seen,
                                              const std::vector<Halves>& halves,
                                              FieldGaussNewton* fields) const {
  const Eigen::Index n = right_.size();
  Measurement sum{Matrix::Zero(n, n), Matrix::Zero(n, n), Vector::Zero(n), Vector::Zero(n)};
  std::vector<InstrumentalVariables::Set> separated;
  if (fields) separated = instrumental_variables(seen, *fields);
  for (std::size_t v = 0; v < seen.size(); ++v) {
    const auto i = static_cast<std::size_t>(seen[v].photo);
    add(sum, fields ? separated[v] : instrumental_variables(i), views_[i].weight, halves[v]);
  }
  return sum;
}

double GaussNewton::least_damping() const {
  return iteration_ < kLateFrom * problem_->iterations ? kEarlyDamping : kLateDamping;
}

Vector GaussNewton::step(const Vector& x, std::span<const Observation> seen, FieldGaussNewton* fields) {
  const Vector u = reparametrization_.from_values(x);
  const Vector slope = reparametrization_.slope(x);
  std::vector<Halves> halves;
  for (const Observation& one : seen) halves.push_back(split_halves(*problem_, one, slope));
  ++iteration_;
  converged_ = false;
  show(seen, halves, fields);
  const NoisyLoss loss = weighted_loss(halves);
  // The voxels that went along would have to go back as well; `Fit` does that where a turn begins.
  if (!fields && worse_than_best(loss)) {
    ++rejected_;
    damping_ *= kDampingUp;
    last_move_ = 0;  // back to where the sums were made
    accepted_.pop_back();
    return problem_->unknowns.project(reparametrization_.to_values(best_u_));
  }
  if (rejected_ == 0) damping_ *= kDampingDown;
  damping_ = std::max(damping_, least_damping());
  rejected_ = 0;

  const double moved = kept();
  const double jacobian_keep = std::max(moved, kLeastJacobianKept);
  ++seen_;
  const double keep = fields ? kept_with_fields() : moved * (1 - kAging / iteration_);
  for (std::size_t v = 0; v < seen.size(); ++v)
    views_[static_cast<std::size_t>(seen[v].photo)].jacobians.add(halves[v], jacobian_keep);
  const Measurement now = measure(seen, halves, fields);
  join(now, u, keep);
  if (!has_best_ || loss.value < best_loss_.value) {
    has_best_ = true;
    best_loss_ = loss;
    best_u_ = u;
  }

  const DampedStep way = bounded_step(u);
  const Vector next = advance(u, way, fields);
  converged_ = iteration_ >= kLeastIterations &&
             (way.remaining.array() <= kConverged * reparametrization_.cap().array()).all();
  last_move_ = (next - u).cwiseQuotient(reparametrization_.cap()).cwiseAbs().maxCoeff();
  accepted_.push_back(next);
  if (accepted_.size() > kAveraged) accepted_.pop_front();
  learn_variance(seen, jacobian_keep);
  return problem_->unknowns.project(reparametrization_.to_values(next));
}

/// By the instruments that earlier iterations have gathered. Fields and scalars that stand in for each
/// other lie in a narrow valley, in which turns of either alone are slow.
Vector GaussNewton::step_by_residuals(const Vector& x, std::span<const Observation> seen,
                           FieldGaussNewton* fields) {
  std::vector<Halves> halves;
  for (const Observation& one : seen)
    halves.push_back(
        residual_halves(one.film, problem_->photos[static_cast<std::size_t>(one.photo)]));
  show(seen, halves, fields);
  if (std::ranges::any_of(views_, [](const View& view) { return view.jacobians.empty(); }))
    return x;
  const Vector u = reparametrization_.from_values(x);
  const Measurement now = measure(seen, halves, fields);
  if (fields) ++seen_;
  join(now, u, fields ? kept_with_fields() : kFollowKept);
  damping_ = std::max(fields ? least_damping() : kFollowDamping, damping_);
  // Fields paint what blur would be needed for, until the derivatives of all are new.
  const Vector next = advance(u, bounded_step(u, true), fields);
  if (fields) last_move_ = (next - u).cwiseQuotient(reparametrization_.cap()).cwiseAbs().maxCoeff();
  return problem_->unknowns.project(reparametrization_.to_values(next));
}

/// Of the past, after the last step.
double GaussNewton::kept() const {
  return std::max(kLeastKept, std::exp(-std::pow(last_move_ / kForgetAt, 2)));
}

/// Where fields move along: all iterations tell, also those of the fields.
double GaussNewton::kept_with_fields(int ahead) const { return kept() * (1 - kAging / (seen_ + ahead)); }

void GaussNewton::show(std::span<const Observation> seen, const std::vector<Halves>& halves,
                       FieldGaussNewton* fields) const {
  if (!fields) return;
  for (std::size_t k = 0; k < seen.size(); ++k) {
    const auto i = static_cast<std::size_t>(seen[k].photo);
    fields->add_residual(i, halves[k], views_[i].weight, kept_with_fields(1));
  }
}

Vector GaussNewton::advance(const Vector& u, const DampedStep& way, FieldGaussNewton* fields) {
  if (fields) fields->advance(way.step);
  return u + way.step;
}

void GaussNewton::gather(const Vector& x, const Observation& derivatives, double weight) {
  views_[static_cast<std::size_t>(derivatives.photo)].jacobians.add(
      split_halves(*problem_, derivatives, reparametrization_.slope(x)), 1, weight);
}

GaussNewton::PhotoEquations GaussNewton::equations(std::size_t i, const Film& residual) const {
  const Photo& photo = problem_->photos[i];
  const View& view = views_[i];
  return {{residual_halves(residual, photo), instrumental_variables(i), view.weight}};
}

Eigen::MatrixXd GaussNewton::eliminate_fields(std::vector<PhotoEquations>& all, FieldGaussNewton& fields) const {
  std::vector<FieldGaussNewton::Regressors> z;
  for (std::size_t i = 0; i < all.size(); ++i) {
    WeightedResidual& whole = all[i].whole;
    fields.add_residual(i, whole.residual, whole.weight, 0);
    z.push_back({&whole.z, &whole.weight});
    if (const auto& informative = all[i].informative) {
      z.back().informative = &informative->z;
      z.back().informative_weight = &informative->weight;
    }
  }
  fields.solve(iteration_ / static_cast<double>(problem_->iterations));
  return fields.eliminate_fields(z);
}

/// The instruments serve on: what is wrong about them slows the way and leaves its end.
void GaussNewton::reset_equations() {
  normal_.setZero();
  covariance_.setZero();
  right_.setZero();
  strength_.setZero();
  damping_ = kFirstDamping;
  last_move_ = 0;
  rejected_ = 0;
  has_best_ = false;
  accepted_.clear();
}

/// Pictures of a sharp body change by other slopes than those of a blurred one.
void GaussNewton::reset_everything() {
  for (View& view : views_) view.jacobians = {};
  reset_equations();
}

/// The mean of the last estimates: each still carries the noise of its own samples.
Vector GaussNewton::estimate(const Vector& x) const {
  const std::size_t late =
      static_cast<std::size_t>((1 - kLateFrom) * static_cast<double>(iteration_));
  const std::size_t count = std::min(accepted_.size(), std::max<std::size_t>(late, 1));
  if (accepted_.empty()) return x;
  const Vector zero = Vector::Zero(x.size());
  const Vector mean =
      std::accumulate(accepted_.end() - static_cast<std::ptrdiff_t>(count), accepted_.end(), zero) /
      static_cast<double>(count);
  return problem_->unknowns.project(reparametrization_.to_values(mean));
}

}  // namespace selenite
