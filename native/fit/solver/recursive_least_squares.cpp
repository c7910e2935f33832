// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/recursive_least_squares.h"

#include <algorithm>

#include "fit/problem/saved_state.h"

namespace selenite {
namespace {

/// Rows that are converted to double precision at once: the copies stay in the cache.
constexpr Eigen::Index kBlockRows = 3 * 1024;

/// a^T diag(w) b, in double precision and in a fixed order.
template <class A, class B>
Eigen::MatrixXd weighted_product(const A& a, const Eigen::VectorXf& w, const B& b) {
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(a.cols(), b.cols());
  for (Eigen::Index i = 0; i < a.rows(); i += kBlockRows) {
    const Eigen::Index n = std::min(kBlockRows, a.rows() - i);
    const Eigen::MatrixXd left = a.middleRows(i, n).template cast<double>();
    const Eigen::MatrixXd right = b.middleRows(i, n).template cast<double>();
    sum += left.transpose() * (w.segment(i, n).cast<double>().asDiagonal() * right);
  }
  return sum;
}

}  // namespace

Measurement::Measurement(Eigen::Index n)
    : normal(Eigen::MatrixXd::Zero(n, n)),
      covariance(normal),
      gradient(Vector::Zero(n)),
      strength(gradient) {}

void Measurement::add(const InstrumentalVariables::Set& z, const Eigen::VectorXf& w,
                      const Halves& halves) {
  normal += (weighted_product(z.a.filtered, w, z.b.slopes) +
             weighted_product(z.b.filtered, w, z.a.slopes)) /
            2;
  add_gradient(z, w, halves);
  const Eigen::VectorXf noise = w.cwiseAbs2().cwiseProduct(halves.variance);
  for (const Jacobian* one : {&z.a.filtered, &z.b.filtered}) {
    covariance += weighted_product(*one, noise, *one) / 4;
    strength += weighted_product(*one, w, *one).diagonal() / 2;
  }
}

void Measurement::add_gradient(const InstrumentalVariables::Set& z, const Eigen::VectorXf& w,
                               const Halves& halves) {
  gradient += (weighted_product(z.a.filtered, w, halves.residual_b) +
               weighted_product(z.b.filtered, w, halves.residual_a)) /
              2;
}

void RecursiveLeastSquares::join(const Measurement& now, const Vector& u, double keep) {
  sum_.normal = keep * sum_.normal + now.normal;
  sum_.gradient = keep * sum_.gradient + now.normal * u - now.gradient;
  sum_.covariance = keep * keep * sum_.covariance + now.covariance;
  sum_.strength = keep * sum_.strength + now.strength;
}

void RecursiveLeastSquares::reset() {
  sum_.normal.setZero();
  sum_.covariance.setZero();
  sum_.gradient.setZero();
  sum_.strength.setZero();
}

void RecursiveLeastSquares::members(SavedState& state) {
  state(sum_.normal, sum_.covariance, sum_.gradient, sum_.strength);
}

}  // namespace selenite
