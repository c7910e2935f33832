// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "render/film/pixel_sums.h"
#include "render/path/camera_samples.h"
#include "render/path/path_kernel.h"
#include "render/path/path_tracer.h"

namespace selenite {

template <int L>
TileReport render_tile(const Prepared<L>& prepared, const PixelCamera& camera,
                       const RenderSettings& settings, const Tile& tile, Film& film) {
  TileReport report;
  PathTracer<L> tracer(prepared, settings.depth, camera);
  const int slots = L > 0 ? prepared.slots : 0;
  const int n = settings.spp;
  std::vector<SlotSums> slot_sums(slots);

  for (int y = tile.y0; y < tile.y1; ++y) {
    CameraSamples samples(prepared, camera, settings, y, tile.x0, tile.x1);
    for (int x = tile.x0; x < tile.x1; ++x) {
      const auto pixel = static_cast<std::size_t>(y) * settings.width + x;
      if (!settings.has(pixel)) continue;
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
          report.drop(x, y, i, bad == slots ? -1 : bad);
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
