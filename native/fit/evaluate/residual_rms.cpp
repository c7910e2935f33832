// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/evaluate/residual_rms.h"

#include <algorithm>
#include <cmath>

#include "fit/evaluate/tiled_loss.h"
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

}  // namespace selenite
