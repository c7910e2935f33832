// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/inference/normal_equations.h"

#include <algorithm>

#include "fit/problem/shared_pixels.h"

namespace selenite {
namespace {

/// Covariance of the sum of all terms, one row a pixel, where noise reaches the pixels beside its own:
/// sums over all squares of 3 pixels. Source: Newey and West 1987, Econometrica 55 (weights of Bartlett).
Eigen::MatrixXd covariance_of_sum(const Photo& photo, const Eigen::MatrixXd& terms) {
  constexpr int kSide = 3;
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(terms.cols(), terms.cols());
  Vector sum(terms.cols());
  for (int top = 1 - kSide; top < photo.height; ++top)
    for (int left = 1 - kSide; left < photo.width; ++left) {
      sum.setZero();
      for (int y = std::max(top, 0); y < std::min(top + kSide, photo.height); ++y)
        for (int x = std::max(left, 0); x < std::min(left + kSide, photo.width); ++x)
          sum += terms.row(static_cast<Eigen::Index>(y) * photo.width + x).transpose();
      covariance.noalias() += sum * sum.transpose();
    }
  return covariance / (kSide * kSide);
}

}  // namespace

void NormalEquations::remove(Eigen::Index k) {
  for (Eigen::MatrixXd* one : {&normal, &normal_variance, &score_covariance}) {
    one->row(k).setZero();
    one->col(k).setZero();
  }
  gradient[k] = 0;
}

void NormalEquations::add(const Photo& photo, const GaussNewton::PhotoEquations& equations) {
  const Eigen::VectorXf& weight = equations.whole.weight;
  const Eigen::Index n = gradient.size(), pixels = weight.size() / 3;
  const GaussNewton::WeightedResidual* const informative =
      equations.informative ? &*equations.informative : nullptr;
  Eigen::MatrixXd noise_a(n, n), noise_b(n, n);
  const bool widened = equations.widening.size() > 0;
  Vector term(n), error(n), score(n);
  Eigen::MatrixXd slopes(n, n);
  const bool neighbours_share = shares_pixels(photo);
  Eigen::MatrixXd terms = Eigen::MatrixXd::Zero(neighbours_share ? pixels : 0, n);
  clusters.begin_photo(photo);
  for (Eigen::Index i = 0; i < pixels; ++i) {
    if (weight[3 * i] == 0 && weight[3 * i + 1] == 0 && weight[3 * i + 2] == 0) continue;
    term.setZero();
    error.setZero();
    slopes.setZero();
    // The photo's noise is in both.
    for (const GaussNewton::WeightedResidual* seen : {&equations.whole, informative}) {
      if (!seen) continue;
      const auto& [halves, z, weights] = *seen;
      noise_a.setZero();
      noise_b.setZero();
      for (Eigen::Index j = 3 * i; j < 3 * i + 3; ++j) {
        const double w = weights[j] / 2;
        const Vector a = w * z.a.filtered.row(j).cast<double>();
        const Vector b = w * z.b.filtered.row(j).cast<double>();
        slopes.noalias() += a * z.b.slopes.row(j).cast<double>();
        slopes.noalias() += b * z.a.slopes.row(j).cast<double>();
        noise_b.noalias() += a * z.b.noise.row(j).cast<double>();
        noise_a.noalias() += b * z.a.noise.row(j).cast<double>();
        score = (a + b) * static_cast<double>(halves.residual_a[j] + halves.residual_b[j]) / 2;
        term += score;
        error += (widened ? static_cast<double>(equations.widening[j]) : 1.0) * score;
      }
      normal_variance += noise_a.cwiseAbs2() + noise_b.cwiseAbs2();
    }
    gradient += term;
    normal += slopes;
    clusters.add(static_cast<std::size_t>(i), term, slopes);
    if (neighbours_share)
      terms.row(i) = error.transpose();
    else
      score_covariance.noalias() += error * error.transpose();
  }
  if (neighbours_share) score_covariance += covariance_of_sum(photo, terms);
  const Halves& halves = equations.of_photo ? *equations.of_photo : equations.whole.residual;
  shared.add(photo, halves.residual_a, halves.residual_b, weight);
}

}  // namespace selenite
