// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/inference/normal_equations.h"

namespace selenite {

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
  Vector term(n);
  Eigen::MatrixXd slopes(n, n);
  clusters.begin_photo(photo);
  for (Eigen::Index i = 0; i < pixels; ++i) {
    if (weight[3 * i] == 0 && weight[3 * i + 1] == 0 && weight[3 * i + 2] == 0) continue;
    term.setZero();
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
        term += (a + b) * static_cast<double>(halves.residual_a[j] + halves.residual_b[j]) / 2;
      }
      normal_variance += noise_a.cwiseAbs2() + noise_b.cwiseAbs2();
    }
    gradient += term;
    normal += slopes;
    clusters.add(static_cast<std::size_t>(i), term, slopes);
    score_covariance.noalias() += term * term.transpose();
  }
  const Halves& halves = equations.of_photo ? *equations.of_photo : equations.whole.residual;
  shared.add(photo, halves.residual_a, halves.residual_b, weight);
}

}  // namespace selenite
