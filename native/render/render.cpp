// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/render.h"

#include <chrono>
#include <ctime>
#include <exception>
#include <thread>

#include "math/error.h"
#include "render/kernel.h"

namespace selenite {
namespace {

constexpr int kTileSize = 16;

void require(bool good, const char* what, long long value, const char* range) {
  if (!good)
    throw InvalidArgument(std::string("Render: ") + what + " = " + std::to_string(value) +
                          " is not permitted; set it to " + range);
}

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

Film new_film(const RenderSettings& settings, int slots) {
  Film film;
  film.width = settings.width;
  film.height = settings.height;
  film.spp = settings.spp;
  const auto size = static_cast<std::size_t>(settings.width) * settings.height;
  film.mean.resize(size);
  film.half_a.resize(size);
  film.variance.resize(size);
  film.slots.resize(slots);
  for (SlotFilm& slot : film.slots) {
    slot.mean.resize(size);
    slot.half_a.resize(size);
    slot.variance.resize(size);
    slot.covariance.resize(size);
  }
  return film;
}

/// Tiles go to whichever thread is free; every pixel is finished by one thread from its own random
/// numbers and reports are added in tile order, so the result does not depend on the threads.
template <int L>
void render_all(const Scene& scene, const Camera& camera, const SlotLayout& layout,
                const RenderSettings& settings, Progress* progress, Film& film) {
  const Prepared<L> prepared(scene, layout);
  const PixelCamera pixels(camera, settings.width, settings.height);
  const int columns = (settings.width + kTileSize - 1) / kTileSize;
  const int rows = (settings.height + kTileSize - 1) / kTileSize;
  const int count = columns * rows;
  std::vector<TileReport> reports(count);
  std::atomic<int> next{0}, finished{0};
  std::atomic<bool> stop{false};

  const int cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  const int threads = std::min(settings.threads > 0 ? settings.threads : cores, count);
  std::vector<std::exception_ptr> failures(threads);
  const auto work = [&](int thread) {
    try {
      for (int i = next++; i < count && !stop; i = next++) {
        if (progress && progress->cancelled) {
          stop = true;
          break;
        }
        const int x = i % columns * kTileSize, y = i / columns * kTileSize;
        const Tile tile{x, y, std::min(x + kTileSize, settings.width),
                        std::min(y + kTileSize, settings.height)};
        reports[i] = render_tile<L>(prepared, pixels, settings, tile, film);
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
    for (int i = 1; i < threads; ++i) pool.emplace_back(work, i);
    work(0);
  }
  for (const std::exception_ptr& failure : failures)
    if (failure) std::rethrow_exception(failure);
  if (stop) throw Cancelled("The render was cancelled");
  for (const TileReport& report : reports) {
    if (film.dropped == 0 && report.dropped > 0) film.first_dropped = report.first_dropped;
    film.dropped += report.dropped;
    film.truncated += report.truncated;
  }
}

/// Most local slots that any material needs.
int local_slots(const SlotLayout& layout) {
  std::vector<int> count;
  for (const Slot& slot : layout.slots) {
    if (slot.parameter.kind != OwnerKind::kMaterial) continue;
    count.resize(std::max<std::size_t>(count.size(), slot.parameter.owner + 1));
    ++count[slot.parameter.owner];
  }
  return count.empty() ? 0 : *std::max_element(count.begin(), count.end());
}

}  // namespace

void RenderSettings::check() const {
  require(width >= 1 && width <= 65536, "width", width, "1 to 65536 pixels");
  require(height >= 1 && height <= 65536, "height", height, "1 to 65536 pixels");
  require(static_cast<long long>(width) * height <= 1 << 28, "number of pixels",
          static_cast<long long>(width) * height, "at most 268435456");
  require(spp >= 1 && spp <= 1 << 20, "samples per pixel", spp, "1 to 1048576");
  require(depth >= 0, "depth", depth, "0 (no limit) or more");
  require(threads >= 0 && threads <= 1024, "threads", threads, "0 (all) to 1024");
}

Film render(const Scene& scene, const Camera& camera, const SlotLayout& layout,
            const RenderSettings& settings, Progress* progress) {
  settings.check();
  const int slots = static_cast<int>(layout.slots.size());
  require(slots <= kMaxSlots, "derivative slots in one pass", slots,
          "at most 32: split the parameters over several passes");
  const int local = local_slots(layout);
  require(local <= kMaxLocalSlots, "derivative slots of one material", local,
          "at most 16: split the parameters over several passes");

  const auto start = std::chrono::steady_clock::now();
  const double cpu_start = cpu_seconds();
  if (progress) progress->fraction = 0;
  Film film = new_film(settings, slots);
  if (slots == 0)
    render_all<0>(scene, camera, layout, settings, progress, film);
  else if (local <= 4)
    render_all<4>(scene, camera, layout, settings, progress, film);
  else if (local <= 8)
    render_all<8>(scene, camera, layout, settings, progress, film);
  else
    render_all<16>(scene, camera, layout, settings, progress, film);
  film.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  film.cpu_seconds = cpu_seconds() - cpu_start;
  return film;
}

}  // namespace selenite
