// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/inference/normal_equations.h"

#include <array>

#include "fit/problem/pixel_weights.h"

namespace selenite {

void NormalEquations::remove(Eigen::Index k) {
  for (Eigen::MatrixXd* one : {&normal, &normal_variance, &score_covariance}) {
    one->row(k).setZero();
    one->col(k).setZero();
  }
  gradient[k] = 0;
}

void NormalEquations::add(const Photo& photo, const GaussNewton::PhotoEquations& equations,
                          std::size_t photos) {
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
  const Halves& halves = equations.whole.residual;
  // A pixel's residual in one half times its neighbours' in the other: only what they share stays.
  const Eigen::VectorXf relative = relative_weights(photo, photos);
  const auto at = [&](int x, int y) { return static_cast<std::size_t>(y) * photo.width + x; };
  for (int y = 0; y < photo.height; ++y)
    for (int x = 0; x < photo.width; ++x) {
      if (photo.weight[at(x, y)] == 0) continue;
      std::array<double, 3> around{};
      int count = 0;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          const int p = x + dx, q = y + dy;
          if ((dx == 0 && dy == 0) || p < 0 || q < 0 || p >= photo.width || q >= photo.height)
            continue;
          if (photo.weight[at(p, q)] == 0) continue;
          ++count;
          for (std::size_t c = 0; c < 3; ++c)
            around[c] += halves.residual_b[static_cast<Eigen::Index>(3 * at(p, q) + c)];
        }
      if (count == 0) continue;
      double part = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const auto i = static_cast<Eigen::Index>(3 * at(x, y) + c);
        part += relative[i] * halves.residual_a[i] * around[c] / count;
      }
      misfit += part;
      misfit_variance += part * part;
    }
}

}  // namespace selenite
