// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/driver/tile_pool.h"

#include <exception>
#include <thread>

#include "math/error.h"

namespace selenite {
namespace {

int tiles_along(int pixels) { return (pixels + kTileSize - 1) / kTileSize; }

}  // namespace

int tile_count(const RenderSettings& settings) {
  return tiles_along(settings.width) * tiles_along(settings.height);
}

void for_each_tile(const RenderSettings& settings, Progress* progress,
                   const std::function<void(int index, const Tile& tile)>& work) {
  const int columns = tiles_along(settings.width), count = tile_count(settings);
  std::atomic<int> next{0}, finished{0};
  std::atomic<bool> stop{false};

  const int cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  const int threads = std::min(settings.threads > 0 ? settings.threads : cores, count);
  std::vector<std::exception_ptr> failures(threads);
  const auto run = [&](int thread) {
    try {
      for (int i = next++; i < count && !stop; i = next++) {
        if (progress && progress->cancelled) {
          stop = true;
          break;
        }
        const int x = i % columns * kTileSize, y = i / columns * kTileSize;
        work(i, Tile{x, y, std::min(x + kTileSize, settings.width),
                     std::min(y + kTileSize, settings.height)});
        if (progress)
          progress->fraction = static_cast<float>(++finished) / static_cast<float>(count);
      }
    } catch (...) {
      failures[thread] = std::current_exception();
      stop = true;
    }
  };
  {
    std::vector<std::jthread> pool;
    for (int i = 1; i < threads; ++i) pool.emplace_back(run, i);
    run(0);
  }
  for (const std::exception_ptr& failure : failures)
    if (failure) std::rethrow_exception(failure);
  if (stop) throw Cancelled("The render was cancelled");
}

void add_reports(const std::vector<TileReport>& reports, Film& film) {
  for (const TileReport& report : reports) {
    if (film.dropped == 0 && report.dropped > 0) film.first_dropped = report.first_dropped;
    film.dropped += report.dropped;
    film.truncated += report.truncated;
    film.vertices += report.vertices;
    film.exits += report.exits;
  }
}

}  // namespace selenite
