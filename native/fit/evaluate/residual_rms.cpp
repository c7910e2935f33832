// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/evaluate/residual_rms.h"

#include <algorithm>
#include <cmath>

#include "fit/evaluate/tiled_loss.h"
#include "fit/objective/shared_residual.h"
#include "math/scalar.h"

namespace selenite {

double residual_rms(const Film& film, const Photo& photo) {
  Eigen::ArrayXd squares = Eigen::ArrayXd::Zero(static_cast<Eigen::Index>(film.size()));
  for (std::size_t k = 0; k < film.size(); ++k)
    for (int c = 0; c < 3; ++c) {
      const double off = static_cast<double>(film.mean[k][c]) - photo.reference[k][c];
      squares[static_cast<Eigen::Index>(k)] +=
          photo.share(k) * (square(off) - std::max(film.variance[k][c], 0.f));
    }
  const NoisySum by(squares);
  return by.sum > kResidual.sigmas * by.deviation ? std::sqrt(by.sum) : 0;
}

double unexplained_share(const Film& film, const Photo& photo) {
  Eigen::VectorXf residual(3 * static_cast<Eigen::Index>(film.size())), weights(residual.size());
  for (std::size_t k = 0; k < film.size(); ++k)
    for (int c = 0; c < 3; ++c) {
      const auto i = static_cast<Eigen::Index>(3 * k) + c;
      residual[i] = film.mean[k][c] - photo.reference[k][c];
      weights[i] = photo.weight[k];
    }
  SharedResidual shared;  // noise of two pixels is independent: the same render may be both halves
  shared.add(photo, residual, residual, weights);
  const double square = shared.relative();
  return square > kResidual.shared_sigmas * shared.relative_error() ? std::sqrt(square) : 0;
}

}  // namespace selenite
