// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/render.h"

#include <chrono>
#include <ctime>

#include "math/error.h"
#include "render/kernel.h"

namespace selenite {
namespace {

void require(bool good, const char* what, long long value, const char* range) {
  if (!good)
    throw InvalidArgument(std::string("Render: ") + what + " = " + std::to_string(value) +
                          " is not permitted; set it to " + range);
}

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// Every pixel is finished by one thread from its own random numbers, so the result does not depend
/// on the threads.
template <int L>
void render_all(const Scene& scene, const Camera& camera, const SlotLayout& layout,
                const RenderSettings& settings, Progress* progress, Film& film) {
  const Prepared<L> prepared(scene, layout);
  const PixelCamera pixels(camera, settings.width, settings.height);
  std::vector<TileReport> reports(tile_count(settings));
  for_each_tile(settings, progress, [&](int i, const Tile& tile) {
    reports[i] = render_tile<L>(prepared, pixels, settings, tile, film);
  });
  add_reports(reports, film);
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
  Film film(settings.width, settings.height, settings.spp, slots);
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
