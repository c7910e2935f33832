// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>

#include "render/film/film.h"

namespace selenite {

/// Of samples 0, 2, ... among n.
inline int even_count(int n) { return (n + 1) / 2; }

/// Sums over the samples of one pixel. Float is enough: at most a few thousand samples, and what
/// goes over the whole picture is summed in double elsewhere.
struct PixelSums {
  Colorf sum, even, squares;
  void add(const Colorf& x, bool is_even) {
    sum += x;
    if (is_even) even += x;
    squares += x * x;
  }
  /// Unbiased variance of the mean of n samples.
  Colorf variance(int n) const {
    // Rounding can leave a constant pixel a little below 0.
    return map(covariance(squares, sum, sum, n), [](float v) { return max(v, 0.0f); });
  }
  void write(Film& film, std::size_t pixel, int n) const {
    film.mean[pixel] = sum / static_cast<float>(n);
    film.half_a[pixel] = even / static_cast<float>(even_count(n));
    film.variance[pixel] = variance(n);
  }
  static Colorf covariance(const Colorf& products, const Colorf& a, const Colorf& b, int n) {
    if (n < 2) return {};
    const auto count = static_cast<float>(n);
    return (products - a * b / count) / (count * (count - 1));
  }
};

/// The same of one derivative, and its products with the radiance.
struct SlotSums {
  PixelSums slope;
  Colorf products;
  void add(const Colorf& derivative, const Colorf& radiance, bool is_even) {
    slope.add(derivative, is_even);
    products += derivative * radiance;
  }
  /// `radiance`: summed over the n samples.
  void write(SlotFilm& film, std::size_t pixel, int n, const Colorf& radiance) const {
    film.mean[pixel] = slope.sum / static_cast<float>(n);
    film.half_a[pixel] = slope.even / static_cast<float>(even_count(n));
    film.variance[pixel] = slope.variance(n);
    film.covariance[pixel] = PixelSums::covariance(products, radiance, slope.sum, n);
  }
};

inline bool is_finite(const Colorf& c) {
  return std::isfinite(c.r) && std::isfinite(c.g) && std::isfinite(c.b);
}

}  // namespace selenite
