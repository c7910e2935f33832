// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/gauss_newton.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "fit/directions.h"
#include "fit/saved_state.h"
#include "fit/weights.h"

namespace selenite {
namespace {

// Constants of the recipe. Source: facts sheet "estimators", Q2, steps 2 to 8.
constexpr double kFirstDamping = 0.1;
constexpr double kEarlyDamping = 0.05, kLateDamping = 0.002;  ///< smallest, before and after:
constexpr double kLateFrom = 0.64;                            ///< share of the iterations
constexpr double kDampingDown = 1.0 / 3, kDampingUp = 5;
constexpr double kLeastValue = 0.003;   ///< of the scaled normal matrix, in a direction
constexpr double kLeastStrength = 0.1;  ///< of Z^T w Z, for scaling
constexpr double kForgetAt = 0.5;       ///< caps; a step of that size keeps 1/e of the past
constexpr double kLeastKept = 0.1, kLeastJacobianKept = 0.3;
/// Equations count with this power of their iteration's number: early ones were made far from the
/// answer, where pictures change by other slopes. Those of all alike cost a fit the last of its way
/// (an error that falls as t^-0.65 where differences measure 1.5 times the slope); these a seventh
/// more noise, which verification takes away again.
constexpr double kAging = 1;
/// Where fields move: what is kept of the equations before, which told of other fields, and the least
/// damping.
constexpr double kFollowKept = 0.8, kFollowDamping = 1;
constexpr double kLargeMove = 0.25;  ///< caps; smaller steps are never rejected
/// From this iteration on caps shrink as 1 / iteration: the way that is left to go stays unlimited
/// (harmonic series), but noise cannot throw a settled fit far and make it forget what it knows.
constexpr double kShrinkFrom = 10;
constexpr int kMostRejections = 3;
constexpr double kWorseBy = 0.1, kWorseSigmas = 2;
constexpr std::size_t kAveraged = 8;
/// Arrived: so many iterations, and no more than that share of the caps left to go. A look at frozen
/// values ends the way better than more iterations; but it needs their derivatives.
constexpr int kLeastIterations = 10;
constexpr double kArrived = 0.1;
constexpr int kVarianceBlur = 2;
constexpr double kFinalSamples = 64;  ///< samples a pixel will have seen in the end
constexpr double kModelError = 0.05;  ///< of a pixel's brightness
/// Channels of an extinction differ by about that factor (its logarithm), unless the photos say more.
constexpr double kUnlikeness = 0.5;
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
      coordinates_(problem.unknowns),
      views_(problem.captures.size()),
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
        strength_, damping_, last_move_, rejected_, arrived_, best_loss_, has_best_, best_u_,
        accepted_);
}

void GaussNewton::set_first_weights() {
  for (std::size_t i = 0; i < views_.size(); ++i) {
    const Capture& capture = problem_->captures[i];
    views_[i].weight = relative_weights(capture, views_.size());
    views_[i].variance = Eigen::VectorXf::Zero(views_[i].weight.size());
  }
}

/// Noise by pixel is learned on the way and put into the weights twice, from earlier seeds only:
/// the start may be far from where the noise (caustics, say) will be. Sums in the old weights stay:
/// they are true equations for the same unknowns.
void GaussNewton::learn_variance(std::span<const Observation> seen, double keep) {
  variance_count_ = keep * variance_count_ + 1;
  for (const Observation& one : seen) {
    View& view = views_[static_cast<std::size_t>(one.capture)];
    const Eigen::Map<const Eigen::VectorXf> variance(&one.film.variance.front().r,
                                                     view.variance.size());
    view.variance = view.variance * static_cast<float>(keep) +
                    variance.cwiseMax(0.f) * static_cast<float>(one.film.spp);
  }
  if (iteration_ != next_weighing_) return;
  next_weighing_ *= 2;
  for (std::size_t i = 0; i < views_.size(); ++i) {
    const Capture& capture = problem_->captures[i];
    const Eigen::VectorXf noise =
        box_blur(views_[i].variance, capture.width, capture.height, kVarianceBlur) /
        static_cast<float>(variance_count_ * kFinalSamples);
    const Eigen::VectorXf model = brightness(capture) * static_cast<float>(kModelError);
    views_[i].weight = shares(capture, views_.size()).cwiseQuotient(noise + model.cwiseAbs2());
  }
  has_best_ = false;  // losses in other weights do not compare
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

void GaussNewton::add(Measurement& sum, const JacobianSums::Set& z, const Eigen::VectorXf& w,
                      const Halves& halves) {
  sum.normal += (weighted_product(z.a.instruments, w, z.b.slopes) +
                 weighted_product(z.b.instruments, w, z.a.slopes)) /
                2;
  sum.gradient += (weighted_product(z.a.instruments, w, halves.residual_b) +
                   weighted_product(z.b.instruments, w, halves.residual_a)) /
                  2;
  const Eigen::VectorXf noise = w.cwiseAbs2().cwiseProduct(halves.variance);
  for (const Jacobian* one : {&z.a.instruments, &z.b.instruments}) {
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

GaussNewton::Measurement GaussNewton::measure(std::span<const Observation> seen,
                                              const std::vector<Halves>& halves, double keep) {
  const Eigen::Index n = right_.size();
  Measurement sum{Matrix::Zero(n, n), Matrix::Zero(n, n), Vector::Zero(n), Vector::Zero(n)};
  for (std::size_t v = 0; v < seen.size(); ++v) {
    const Capture& capture = problem_->captures[static_cast<std::size_t>(seen[v].capture)];
    View& view = views_[static_cast<std::size_t>(seen[v].capture)];
    const Eigen::VectorXf& w = view.weight;
    view.jacobians.add(halves[v], keep);
    const JacobianSums::Set z = view.jacobians.all(*problem_, capture, w);
    add(sum, z, w, halves[v]);
  }
  return sum;
}

double GaussNewton::least_damping() const {
  return iteration_ < kLateFrom * problem_->iterations ? kEarlyDamping : kLateDamping;
}

Vector GaussNewton::step(const Vector& x, std::span<const Observation> seen) {
  const Vector u = coordinates_.from_values(x);
  const Vector slope = coordinates_.slope(x);
  std::vector<Halves> halves;
  for (const Observation& one : seen) halves.push_back(split_halves(*problem_, one, slope));
  ++iteration_;
  arrived_ = false;
  const NoisyLoss loss = weighted_loss(halves);
  if (worse_than_best(loss)) {
    ++rejected_;
    damping_ *= kDampingUp;
    last_move_ = 0;  // back to where the sums were made
    accepted_.pop_back();
    return problem_->unknowns.project(coordinates_.to_values(best_u_));
  }
  if (rejected_ == 0) damping_ *= kDampingDown;
  damping_ = std::max(damping_, least_damping());
  rejected_ = 0;

  const double moved = std::max(kLeastKept, std::exp(-std::pow(last_move_ / kForgetAt, 2)));
  const double jacobian_keep = std::max(moved, kLeastJacobianKept);
  const double keep = moved * (1 - kAging / iteration_);
  const Measurement now = measure(seen, halves, jacobian_keep);
  join(now, u, keep);
  if (!has_best_ || loss.value < best_loss_.value) {
    has_best_ = true;
    best_loss_ = loss;
    best_u_ = u;
  }

  const Way way = bounded_way(u);
  const Vector next = u + way.step;
  arrived_ = iteration_ >= kLeastIterations &&
             (way.left.array() <= kArrived * coordinates_.cap().array()).all();
  last_move_ = (next - u).cwiseQuotient(coordinates_.cap()).cwiseAbs().maxCoeff();
  accepted_.push_back(next);
  if (accepted_.size() > kAveraged) accepted_.pop_front();
  learn_variance(seen, jacobian_keep);
  return problem_->unknowns.project(coordinates_.to_values(next));
}

/// By the instruments that earlier iterations have gathered. Fields and scalars that stand in for each
/// other lie in a narrow valley, in which turns of either alone are slow.
Vector GaussNewton::follow(const Vector& x, std::span<const Observation> seen) {
  if (std::ranges::any_of(views_, [](const View& view) { return view.jacobians.empty(); }))
    return x;
  const Vector u = coordinates_.from_values(x);
  const Eigen::Index n = u.size();
  Measurement now{Matrix::Zero(n, n), Matrix::Zero(n, n), Vector::Zero(n), Vector::Zero(n)};
  for (const Observation& one : seen) {
    const Equations told = equations(static_cast<std::size_t>(one.capture), one.film);
    add(now, told.z, told.weight, told.residual);
  }
  join(now, u, kFollowKept);
  damping_ = std::max(damping_, kFollowDamping);
  return problem_->unknowns.project(coordinates_.to_values(u + bounded_way(u).step));
}

void GaussNewton::gather(const Vector& x, const Observation& derivatives, double weight) {
  views_[static_cast<std::size_t>(derivatives.capture)].jacobians.add(
      split_halves(*problem_, derivatives, coordinates_.slope(x)), 1, weight);
}

GaussNewton::Equations GaussNewton::equations(std::size_t i, const Film& residual) const {
  const Capture& capture = problem_->captures[i];
  const View& view = views_[i];
  return {residual_halves(residual, capture), view.jacobians.all(*problem_, capture, view.weight),
          view.weight};
}

/// The instruments serve on: what is wrong about them slows the way and leaves its end.
void GaussNewton::start_afresh() {
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
void GaussNewton::start_anew() {
  for (View& view : views_) view.jacobians = {};
  start_afresh();
}

/// What is known before any photo, as another term of the normal matrix: the channels of an
/// extinction are about alike. In units of the sums' noise, so that it gives way to what is seen.
/// Without it a channel that little light comes back from wanders off, and takes its albedo along.
GaussNewton::Matrix GaussNewton::prior() const {
  Matrix prior = Matrix::Zero(normal_.rows(), normal_.cols());
  const auto& components = problem_->unknowns.components();
  for (Eigen::Index k = 0; k + 2 < prior.rows(); ++k) {
    const Component& first = components[static_cast<std::size_t>(k)];
    const bool colour = components[static_cast<std::size_t>(k) + 2].parameter == first.parameter;
    if (first.index != 0 || !colour ||
        !problem_->unknowns.description_of(static_cast<int>(k)).alike)
      continue;
    const double seen = normal_.diagonal()
                            .segment<3>(k)
                            .cwiseMax(kLeastStrength * strength_.segment<3>(k))
                            .cwiseMax(0)
                            .sum();
    if (!(seen > 0)) continue;
    const double noise = covariance_.diagonal().segment<3>(k).sum() / seen;
    prior.block<3, 3>(k, k) = (Eigen::Matrix3d::Identity() - Eigen::Matrix3d::Constant(1.0 / 3)) *
                              (noise / (kUnlikeness * kUnlikeness));
  }
  return prior;
}

/// Step within the caps and the bounds. Components that would leave at a bound are held, and the
/// others solved again without them.
GaussNewton::Way GaussNewton::bounded_way(const Vector& u) const {
  const Matrix normal = normal_ + prior();
  const Vector residual = right_ - normal * u;
  const Vector scale =
      normal.diagonal().cwiseMax(kLeastStrength * strength_).cwiseMax(0).cwiseSqrt();
  std::vector<Eigen::Index> free;
  for (Eigen::Index k = 0; k < u.size(); ++k)
    if (scale[k] > 0) free.push_back(k);  // else: not in any picture
  Way way{Vector::Zero(u.size()), Vector::Zero(u.size())};
  Vector& step = way.step;
  while (!free.empty()) {
    way = free_way(free, normal, residual, scale);
    const auto leaves = [&](Eigen::Index k) {
      return (u[k] <= coordinates_.minimum()[k] && step[k] < 0) ||
             (u[k] >= coordinates_.maximum()[k] && step[k] > 0);
    };
    if (std::erase_if(free, leaves) == 0) break;
    way.step.setZero();
    way.left.setZero();
  }
  const double longest = std::min(1.0, kShrinkFrom / iteration_);
  const double reach = step.cwiseQuotient(coordinates_.cap()).cwiseAbs().maxCoeff();
  if (reach > longest) step *= longest / reach;
  step = (u + step).cwiseMax(coordinates_.minimum()).cwiseMin(coordinates_.maximum()) - u;
  return way;
}

/// Damped step in the singular directions of the scaled normal matrix, shrunk where it is noise.
GaussNewton::Way GaussNewton::free_way(const std::vector<Eigen::Index>& free, const Matrix& normal,
                                       const Vector& residual, const Vector& scale) const {
  const Vector inverse = scale(free).cwiseInverse();
  const Matrix scaled = inverse.asDiagonal() * normal(free, free) * inverse.asDiagonal();
  const Matrix noise = inverse.asDiagonal() * covariance_(free, free) * inverse.asDiagonal();
  const Directions directions(scaled);
  const Vector values = directions.values.cwiseMax(kLeastValue);
  const Matrix spread = directions.out.transpose() * noise * directions.out;
  Vector along = directions.out.transpose() * inverse.cwiseProduct(residual(free));
  const Vector whole = along.cwiseQuotient(values);
  for (Eigen::Index j = 0; j < along.size(); ++j) {
    const double square = along[j] * along[j];
    const double trust = square > 0 ? square / (square + spread(j, j)) : 0;
    along[j] *= trust / (values[j] + damping_);
  }
  const Matrix back = directions.in * values.cwiseInverse().asDiagonal();
  const Vector deviation = (back * spread * back.transpose()).diagonal().cwiseMax(0).cwiseSqrt();
  Way way{Vector::Zero(scale.size()), Vector::Zero(scale.size())};
  way.step(free) = inverse.cwiseProduct(directions.in * along);
  way.left(free) = inverse.cwiseProduct((directions.in * whole).cwiseAbs() + deviation);
  return way;
}

/// The mean of the last estimates: each still carries the noise of its own samples.
Vector GaussNewton::answer(const Vector& x) const {
  const std::size_t settled =
      static_cast<std::size_t>((1 - kLateFrom) * static_cast<double>(iteration_));
  const std::size_t count = std::min(accepted_.size(), std::max<std::size_t>(settled, 1));
  if (accepted_.empty()) return x;
  const Vector zero = Vector::Zero(x.size());
  const Vector mean =
      std::accumulate(accepted_.end() - static_cast<std::ptrdiff_t>(count), accepted_.end(), zero) /
      static_cast<double>(count);
  return problem_->unknowns.project(coordinates_.to_values(mean));
}

}  // namespace selenite
