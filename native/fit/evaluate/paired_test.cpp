// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/evaluate/paired_test.h"

#include <cmath>

#include "fit/evaluate/wiener_filter.h"
#include "fit/objective/half_buffers.h"

namespace selenite {

Film merged(const FilmPair& parts) {
  Film film(parts[0].width, parts[0].height, parts[0].spp + parts[1].spp);
  for (std::size_t i = 0; i < film.size(); ++i) {
    film.mean[i] = (parts[0].mean[i] + parts[1].mean[i]) / 2.f;
    film.half_a[i] = parts[0].mean[i];
    film.variance[i] = (parts[0].variance[i] + parts[1].variance[i]) / 4.f;
  }
  return film;
}

void PairedMidpointTest::add(const Photo& photo, const Eigen::VectorXf& weights,
                             const FilmPair& one, const FilmPair& other) {
  std::array<Halves, 2> from, to;
  for (std::size_t part = 0; part < 2; ++part) {
    from[part] = residual_halves(one[part], photo);
    to[part] = residual_halves(other[part], photo);
  }
  using Half = Eigen::VectorXf Halves::*;
  const auto terms_of = [&](Half way, Half middle) -> Eigen::VectorXf {
    const Eigen::VectorXf first = to[0].*way - from[0].*way, second = to[1].*way - from[1].*way;
    const Eigen::VectorXf four_times =
        from[0].*middle + from[1].*middle + to[0].*middle + to[1].*middle;
    return filtered_derivative((first + second) / 2, first, second, 0.25, photo, -1, weights)
        .cwiseProduct(four_times / 4)
        .cwiseProduct(weights);
  };
  const Eigen::VectorXf terms = terms_of(&Halves::residual_a, &Halves::residual_b) +
                                terms_of(&Halves::residual_b, &Halves::residual_a);
  // Pixels are independent, their channels are not.
  for (Eigen::Index k = 0; k < terms.size(); k += 3) {
    const double pixel = terms.segment<3>(k).sum();
    sum += pixel;
    variance += pixel * pixel;
  }
}

bool PairedMidpointTest::significant(double sigmas) const {
  return sum > sigmas * std::sqrt(variance);
}

double PairedMidpointTest::z_score() const { return variance > 0 ? -sum / std::sqrt(variance) : 0; }

}  // namespace selenite
