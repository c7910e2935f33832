// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/driver/render.h"

#include <chrono>

#include "math/cpu_seconds.h"
#include "math/fault.h"
#include "render/driver/aim_pilot.h"
#include "render/driver/tile_pool.h"
#include "render/lanes/lanes.h"
#include "render/path/path_kernel.h"

namespace selenite {
namespace {

// A build without the kernel of lanes has no function of it to link.
#if defined(SELENITE_LANES)
constexpr bool kHasKernel = true;
#else
constexpr bool kHasKernel = false;
#endif

/// Every pixel is finished by one thread from its own random numbers, so the result does not depend
/// on the threads.
template <int L, class RenderTile>
void render_tiles(const Prepared<L>& prepared, const Camera& camera, const RenderSettings& settings,
                  Progress* progress, Film& film, RenderTile&& render_tile) {
  const PixelCamera pixels(camera, settings.width, settings.height, settings.frame);
  std::vector<TileReport> reports(tile_count(settings));
  for_each_tile(settings, progress, [&](int i, const Tile& tile) {
    reports[i] = render_tile(prepared, pixels, settings, tile, film);
  });
  add_reports(reports, film);
}

template <int L>
void render_all(const Scene& scene, const Camera& camera, const SlotLayout& layout,
                const RenderSettings& settings, Progress* progress, Film& film) {
  render_tiles(Prepared<L>(scene, layout), camera, settings, progress, film, render_tile<L>);
}

/// The same by eight lanes; false if the scene does not suit them.
template <int L>
bool render_all_by_lanes(const Scene& scene, const Camera& camera, const SlotLayout& layout,
                         const RenderSettings& settings, Progress* progress, Film& film) {
  const Prepared<L> prepared(scene, layout);
  if (!lanes_obstacle(prepared).empty()) return false;
  if constexpr (kHasKernel)
    render_tiles(prepared, camera, settings, progress, film, render_tile_by_lanes<L>);
  return kHasKernel;
}

bool render_by_lanes(const Scene& scene, const Camera& camera, const SlotLayout& layout, int local,
                     const RenderSettings& settings, Progress* progress, Film& film) {
  if (settings.lanes == 1 || !has_lanes() || local > 8) return false;
  if (layout.slots.empty())
    return render_all_by_lanes<0>(scene, camera, layout, settings, progress, film);
  if (local <= 2) return render_all_by_lanes<2>(scene, camera, layout, settings, progress, film);
  if (local <= 4) return render_all_by_lanes<4>(scene, camera, layout, settings, progress, film);
  return render_all_by_lanes<8>(scene, camera, layout, settings, progress, film);
}

void render_by_paths(const Scene& scene, const Camera& camera, const SlotLayout& layout, int local,
                     const RenderSettings& settings, Progress* progress, Film& film) {
  if (layout.slots.empty())
    render_all<0>(scene, camera, layout, settings, progress, film);
  else if (local <= 4)
    render_all<4>(scene, camera, layout, settings, progress, film);
  else if (local <= 8)
    render_all<8>(scene, camera, layout, settings, progress, film);
  else
    render_all<16>(scene, camera, layout, settings, progress, film);
}

/// Most local slots that any material needs.
int local_slots(const SlotLayout& layout) {
  std::vector<int> count;
  for (const Slot& slot : layout.slots) {
    switch (slot.parameter.kind) {
      case OwnerKind::kMaterial:
        count.resize(std::max<std::size_t>(count.size(), slot.parameter.owner + 1));
        ++count[slot.parameter.owner];
        break;
      case OwnerKind::kLight:
      case OwnerKind::kWorld:
        break;  // two at most, for which every kernel has room
    }
  }
  return count.empty() ? 0 : *std::max_element(count.begin(), count.end());
}

}  // namespace

Film render(const Scene& scene, const Camera& camera, const SlotLayout& layout,
            const RenderSettings& settings, Progress* progress) {
  settings.check();
  const int slots = static_cast<int>(layout.slots.size());
  require_setting(slots <= kMaxSlots, "derivative slots in one pass", slots,
                  "at most 32: split the parameters over several passes");
  const int local = local_slots(layout);
  require_setting(local <= kMaxLocalSlots, "derivative slots of one material", local,
                  "at most 16: split the parameters over several passes");

  if (has_undecided_aims(scene))
    return render(decide_aims(scene, camera, layout, settings, nullptr, progress), camera, layout,
                  settings, progress);

  const auto start = std::chrono::steady_clock::now();
  const double cpu_start = cpu_seconds();
  if (progress) progress->fraction = 0;
  Film film(settings.width, settings.height, settings.spp, slots);
  if (settings.aim_pilot) film.make_room_for_excess();
  const bool by_lanes = render_by_lanes(scene, camera, layout, local, settings, progress, film);
  if (settings.lanes == kPacket && !by_lanes)
    throw Refused("Render", "lanes = 8 is not permitted for this scene on this processor",
                  "set it to 0 or 1");
  if (by_lanes) film.lanes = kPacket;
  if (!by_lanes) render_by_paths(scene, camera, layout, local, settings, progress, film);
  film.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  film.cpu_seconds = cpu_seconds() - cpu_start;
  return film;
}

}  // namespace selenite
