// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "render/film/film.h"
#include "render/film/pixel_sums.h"
#include "render/film/tile.h"
#include "render/lanes/lane_tracer.h"

namespace selenite {

/// render_tile with many paths at a time. Paths of several pixels are under way together, so that all
/// pixels of the tile have their sums until the last path has ended. Lanes take up paths in an order
/// that depends on the tile alone.
template <int L>
TileReport trace_tile(const Prepared<L>& prepared, const PixelCamera& camera,
                      const RenderSettings& settings, const Tile& tile, Film& film) {
  const int width = tile.x1 - tile.x0, pixels = width * (tile.y1 - tile.y0), n = settings.spp;
  const int slots = L > 0 ? prepared.slots : 0;
  TileReport report;
  std::vector<PixelSums> images(pixels);
  std::vector<SlotSums> slot_sums(static_cast<std::size_t>(pixels) * slots);
  LaneTracer<L> tracer(prepared, settings.depth);
  LaneCamera samples(prepared, camera, settings, tile);
  LaneCamera::Sample running[LaneTracer<L>::kPackets][kLanes];

  const auto start = [&](int packet, int lane) {
    LaneCamera::Sample& sample = running[packet][lane];
    if (samples.next(sample)) tracer.start(packet, lane, samples.rays(), sample.lane);
  };
  const auto finish = [&](int packet, int lane) {
    const auto [pixel, number, unused] = running[packet][lane];
    const auto in_lane = [lane](const Color<Lanes>& c) {
      return Colorf{c.r[lane], c.g[lane], c.b[lane]};
    };
    const auto& radiance = tracer.packet(packet).radiance;
    report.truncated += tracer.packet(packet).truncated[lane];
    const Colorf value = in_lane(radiance.value);
    int bad = is_finite(value) ? -1 : slots;
    for (int s = 0; s < slots; ++s)
      if (!is_finite(in_lane(radiance.slope(s)))) bad = s;
    if (bad >= 0) {
      const int x = tile.x0 + pixel % width, y = tile.y0 + pixel / width;
      report.drop(x, y, number, bad == slots ? -1 : bad);
      return;
    }
    const bool even = number % 2 == 0;
    images[pixel].add(value, even);
    SlotSums* sums = slot_sums.data() + static_cast<std::size_t>(pixel) * slots;
    for (int s = 0; s < slots; ++s) sums[s].add(in_lane(radiance.slope(s)), value, even);
  };

  for (int packet = 0; packet < LaneTracer<L>::kPackets; ++packet)
    for (int lane = 0; lane < kLanes; ++lane) start(packet, lane);
  while (tracer.busy())
    tracer.step([&](int packet, const LaneMask& ended) {
      for_each_lane(ended, [&](int lane) {
        finish(packet, lane);
        start(packet, lane);
      });
    });
  for (int i = 0; i < pixels; ++i) {
    const auto pixel =
        static_cast<std::size_t>(tile.y0 + i / width) * settings.width + tile.x0 + i % width;
    images[i].write(film, pixel, n);
    for (int s = 0; s < slots; ++s)
      slot_sums[static_cast<std::size_t>(i) * slots + s].write(film.slots[s], pixel, n,
                                                               images[i].sum);
  }
  return report;
}

}  // namespace selenite
