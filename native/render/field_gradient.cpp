// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/field_gradient.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <map>
#include <mutex>

#include "math/error.h"
#include "render/taped_tile.h"

namespace selenite {
namespace {

/// Adds the gradients of tiles in tile order, whichever is finished first.
class OrderedSum {
 public:
  OrderedSum(const std::vector<const PlacedGrid*>& grids, std::vector<std::vector<double>>& sums)
      : grids_(grids), sums_(sums) {}

  void add(int tile, std::vector<SparseGradient> gradients) {
    const std::scoped_lock lock(mutex_);
    waiting_.emplace(tile, std::move(gradients));
    while (!waiting_.empty() && waiting_.begin()->first == next_) {
      for (std::size_t f = 0; f < grids_.size(); ++f)
        waiting_.begin()->second[f].add_to(sums_[f], grids_[f]->grid->channels());
      waiting_.erase(waiting_.begin());
      ++next_;
    }
  }

 private:
  const std::vector<const PlacedGrid*>& grids_;
  std::vector<std::vector<double>>& sums_;
  std::mutex mutex_;
  std::map<int, std::vector<SparseGradient>> waiting_;
  int next_ = 0;
};

std::vector<const PlacedGrid*> grids_of(const Scene& scene, const std::vector<GridRef>& unknown) {
  std::vector<const PlacedGrid*> grids;
  for (const GridRef& ref : unknown) {
    const PlacedGrid* placed = &scene.grid(ref);
    if (std::find(grids.begin(), grids.end(), placed) != grids.end())
      throw InvalidArgument(
          scene.appearance.materials.at(static_cast<std::size_t>(ref.material)).name + ":" +
          grid_name(ref.kind) + " is listed twice; list it once");
    grids.push_back(placed);
  }
  return grids;
}

}  // namespace

FieldGradient render_field_gradient(const Scene& scene, const Camera& camera,
                                    const std::vector<GridRef>& unknown,
                                    const RenderSettings& settings, const PixelLoss& loss,
                                    Progress* progress) {
  settings.check();
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t cpu_start = std::clock();
  const std::vector<const PlacedGrid*> grids = grids_of(scene, unknown);
  if (progress) progress->fraction = 0;

  FieldGradient result;
  Film& film = result.film;
  film = Film(settings.width, settings.height, settings.spp);
  for (const PlacedGrid* placed : grids)
    result.fields.emplace_back(loss ? placed->grid->values().size() : 0);

  const Prepared<kTaped> prepared(scene, {}, unknown);
  const PixelCamera pixels(camera, settings.width, settings.height);
  std::vector<TileReport> reports(tile_count(settings));
  OrderedSum sum(grids, result.fields);
  for_each_tile(settings, progress, [&](int i, const Tile& tile) {
    std::vector<SparseGradient> gradients(grids.size());
    reports[i] =
        render_taped_tile(prepared, pixels, settings, tile, {grids, loss}, film, gradients);
    if (loss) sum.add(i, std::move(gradients));
  });
  add_reports(reports, film);
  film.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  film.cpu_seconds = static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC;
  return result;
}

}  // namespace selenite
