// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/driver/field_gradient.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <utility>

#include "math/error.h"
#include "render/driver/aim_pilot.h"
#include "render/driver/ordered_sum.h"
#include "render/driver/taped_tile.h"
#include "render/driver/tile_pool.h"

namespace selenite {
namespace {

int channels_of(const PlacedGrid& placed) { return placed.grid->channels(); }
int channels_of(const Texture&) { return 3; }
int channels_of(const EnvironmentMap&) { return 3; }
int channels_of(const Field& field) {
  return std::visit([](const auto* one) { return channels_of(*one); }, field);
}

std::size_t count_of(const PlacedGrid& placed) { return placed.grid->values().size(); }
std::size_t count_of(const Texture& image) {
  return 3 * static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height());
}
std::size_t count_of(const EnvironmentMap& image) { return 3 * image.pixels().size(); }
std::size_t count_of(const Field& field) {
  return std::visit([](const auto* one) { return count_of(*one); }, field);
}

Field find(const Scene& scene, const GridRef& ref) { return &scene.grid(ref); }
Field find(const Scene& scene, const ImageRef& ref) { return scene.image(ref).texture.get(); }
Field find(const Scene& scene, const EnvironmentRef&) { return &scene.environment(); }
std::string of_material(const Scene& scene, int material, const char* parameter) {
  return scene.appearance.materials.at(static_cast<std::size_t>(material)).name + ":" + parameter;
}
std::string name_of(const Scene& scene, const GridRef& ref) {
  return of_material(scene, ref.material, grid_name(ref.kind));
}
std::string name_of(const Scene& scene, const ImageRef& ref) {
  return of_material(scene, ref.material, kBaseColorTexture);
}
std::string name_of(const Scene&, const EnvironmentRef&) {
  return std::string(kWorldName) + ":" + kEnvironment;
}

std::vector<Field> fields_of(const Scene& scene, const std::vector<FieldRef>& unknown) {
  std::vector<Field> fields;
  for (auto ref = unknown.begin(); ref != unknown.end(); ++ref)
    std::visit(
        [&](const auto& one) {
          if (std::find(unknown.begin(), ref, *ref) != ref)
            throw InvalidArgument(name_of(scene, one) + " is listed twice; list it once");
          fields.push_back(find(scene, one));
        },
        *ref);
  return fields;
}

}  // namespace

PixelLoss squared_error(const Picture& reference) {
  const float share = 2 / static_cast<float>(reference.size());
  return [&reference, share](std::size_t pixel, const Film& film) {
    return PixelSlope{(film.mean[pixel] - reference[pixel]) * share, Colorf(share)};
  };
}

PixelLoss mean_of_pixels(std::vector<float> weights) {
  double sum = 0;
  for (const float weight : weights) {
    if (!(weight >= 0 && std::isfinite(weight)))
      throw InvalidArgument("The weight of a pixel is " + std::to_string(weight) +
                            "; give finite numbers from 0 up");
    sum += weight;
  }
  if (!(sum > 0)) throw InvalidArgument("No pixel has a weight above 0; give one that counts");
  for (float& weight : weights) weight = static_cast<float>(weight / sum);
  return [weights = std::move(weights)](std::size_t pixel, const Film&) {
    return PixelSlope{Colorf(weights[pixel]), {}};
  };
}

FieldGradient render_field_gradient(const Scene& scene, const Camera& camera,
                                    const std::vector<FieldRef>& unknown,
                                    const RenderSettings& settings, const PixelLoss& loss,
                                    Progress* progress) {
  settings.check();
  if (has_undecided_aims(scene))
    return render_field_gradient(decide_aims(scene, camera, {}, settings, nullptr, progress),
                                 camera, unknown, settings, loss, progress);
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t cpu_start = std::clock();
  const std::vector<Field> fields = fields_of(scene, unknown);
  if (progress) progress->fraction = 0;

  FieldGradient result;
  Film& film = result.film;
  const bool one_image = unknown.size() == 1 && std::holds_alternative<ImageRef>(unknown[0]);
  film = Film(settings.width, settings.height, settings.spp, one_image ? 1 : 0);
  for (const Field& field : fields) result.fields.emplace_back(loss ? count_of(field) : 0);

  const Prepared<kTaped> prepared(scene, {}, unknown);
  const PixelCamera pixels(camera, settings.width, settings.height, settings.frame);
  std::vector<TileReport> reports(tile_count(settings));
  std::vector<int> channels;
  for (const Field& field : fields) channels.push_back(channels_of(field));
  OrderedSum sum(channels, result.fields);
  for_each_tile(settings, progress, [&](int i, const Tile& tile) {
    std::vector<SparseGradient> gradients(fields.size());
    reports[i] =
        render_taped_tile(prepared, pixels, settings, tile, {fields, loss}, film, gradients);
    if (loss) sum.add(i, std::move(gradients));
  });
  add_reports(reports, film);
  film.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  film.cpu_seconds = static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC;
  return result;
}

FieldJacobian render_field_jacobian(const Scene& scene, const Camera& camera,
                                    const std::vector<FieldRef>& unknown,
                                    const RenderSettings& settings,
                                    const std::vector<float>& weights, int cell,
                                    Progress* progress) {
  settings.check();
  if (cell < 1 || kTileSize % cell != 0)
    throw InvalidArgument("Cells of " + std::to_string(cell) + " pixels do not fill a tile of " +
                          std::to_string(kTileSize) + "; choose one of its divisors");
  if (weights.size() != static_cast<std::size_t>(settings.width) * settings.height)
    throw InvalidArgument("There are " + std::to_string(weights.size()) + " weights for " +
                          std::to_string(settings.width) + " x " + std::to_string(settings.height) +
                          " pixels; give one a pixel");
  if (has_undecided_aims(scene))
    return render_field_jacobian(decide_aims(scene, camera, {}, settings, nullptr, progress),
                                 camera, unknown, settings, weights, cell, progress);
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t cpu_start = std::clock();
  const std::vector<Field> fields = fields_of(scene, unknown);
  if (progress) progress->fraction = 0;

  FieldJacobian result;
  Film& film = result.film;
  film = Film(settings.width, settings.height, settings.spp, 0);
  const int columns = cells_along(settings.width, cell), rows = cells_along(settings.height, cell);
  for (const Field& field : fields)
    result.fields.emplace_back(
        CellJacobian::Zero(static_cast<Eigen::Index>(rows) * columns, count_of(field)));

  const PixelLoss weighted = [&](std::size_t pixel, const Film&) {
    return PixelSlope{Colorf(weights[pixel]), {}};
  };
  const Prepared<kTaped> prepared(scene, {}, unknown);
  const PixelCamera pixels(camera, settings.width, settings.height, settings.frame);
  std::vector<TileReport> reports(tile_count(settings));
  // No two tiles share a row.
  for_each_tile(settings, progress, [&](int i, const Tile& tile) {
    const int across = cells_across(cell);
    std::vector<SparseGradient> gradients(fields.size() * across * across);
    reports[i] = render_taped_tile(prepared, pixels, settings, tile, {fields, weighted, cell}, film,
                                   gradients);
    for (int y = tile.y0 / cell; y * cell < tile.y1; ++y)
      for (int x = tile.x0 / cell; x * cell < tile.x1; ++x)
        for (std::size_t f = 0; f < fields.size(); ++f)
          gradients[((y - tile.y0 / cell) * across + x - tile.x0 / cell) * fields.size() + f]
              .add_to(result.fields[f].row(static_cast<Eigen::Index>(y) * columns + x).data(),
                      channels_of(fields[f]));
  });
  add_reports(reports, film);
  film.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  film.cpu_seconds = static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC;
  return result;
}

}  // namespace selenite
