// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "render/camera_samples.h"
#include "render/kernel.h"
#include "render/path_tracer.h"

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

template <int L>
TileReport render_tile(const Prepared<L>& prepared, const PixelCamera& camera,
                       const RenderSettings& settings, const Tile& tile, Film& film) {
  TileReport report;
  PathTracer<L> tracer(prepared, settings.depth);
  const int slots = L > 0 ? prepared.slots : 0;
  const int n = settings.spp;
  std::vector<SlotSums> slot_sums(slots);

  for (int y = tile.y0; y < tile.y1; ++y) {
    CameraSamples samples(prepared, camera, settings, y, tile.x0, tile.x1);
    for (int x = tile.x0; x < tile.x1; ++x) {
      const auto pixel = static_cast<std::size_t>(y) * settings.width + x;
      PixelSums image;
      std::fill(slot_sums.begin(), slot_sums.end(), SlotSums{});
      for (int i = 0; i < n; ++i) {
        auto& [random, ray, hit] = samples.next();
        const Radiance<L> radiance = tracer.trace(ray, hit, random);
        report.truncated += tracer.truncated;

        int bad = is_finite(radiance.value) ? -1 : slots;
        for (int s = 0; s < slots; ++s)
          if (!is_finite(radiance.slope[s])) bad = s;
        if (bad >= 0) {
          // Counted as a sample of zero: the pixel stays finite and the report says so.
          if (report.dropped++ == 0)
            report.first_dropped =
                "pixel (" + std::to_string(x) + ", " + std::to_string(y) + "), sample " +
                std::to_string(i) + ", " +
                (bad == slots ? "radiance" : "derivative " + std::to_string(bad));
          continue;
        }
        const bool even = i % 2 == 0;
        image.add(radiance.value, even);
        for (int s = 0; s < slots; ++s) slot_sums[s].add(radiance.slope[s], radiance.value, even);
      }
      image.write(film, pixel, n);
      for (int s = 0; s < slots; ++s) slot_sums[s].write(film.slots[s], pixel, n, image.sum);
    }
  }
  return report;
}

}  // namespace selenite
