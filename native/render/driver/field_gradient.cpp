// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/driver/field_gradient.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <type_traits>
#include <utility>

#include "math/cpu_seconds.h"
#include "math/fault.h"
#include "render/driver/aim_pilot.h"
#include "render/driver/ordered_sum.h"
#include "render/driver/taped_tile.h"
#include "render/driver/tile_pool.h"

namespace selenite {
namespace {

/// What is unknown: of each field what the paths look up, and the numbers at a place of it.
struct Unknown {
  std::vector<Field> fields;
  std::vector<int> channels;
  int slots = 1;  ///< of the material that needs most

  std::size_t size() const { return fields.size(); }
};

int channels_of(const Scene& scene, const GridRef& ref) { return scene.grid(ref).grid->channels(); }
int channels_of(const Scene& scene, const ImageRef& ref) { return scene.channels(ref); }
int channels_of(const Scene&, const EnvironmentRef&) { return 3; }
int channels_of(const Scene&, const VertexColorsRef&) { return 3; }

std::size_t places_of(const PlacedGrid& placed) {
  return placed.grid->values().size() / static_cast<std::size_t>(placed.grid->channels());
}
std::size_t places_of(const Texture& image) { return image.pixels().size(); }
std::size_t places_of(const EnvironmentMap& image) { return image.pixels().size(); }
std::size_t places_of(const VertexColors& colors) { return colors.values().size(); }
std::size_t count_of(const Unknown& unknown, std::size_t f) {
  return std::visit([](const auto* one) { return places_of(*one); }, unknown.fields[f]) *
         static_cast<std::size_t>(unknown.channels[f]);
}

Field find(const Scene& scene, const GridRef& ref) { return &scene.grid(ref); }
Field find(const Scene& scene, const ImageRef& ref) { return scene.image(ref).texture.get(); }
Field find(const Scene& scene, const EnvironmentRef&) { return &scene.environment(); }
Field find(const Scene& scene, const VertexColorsRef& ref) { return &scene.vertex_colors(ref); }
std::string of_material(const Scene& scene, int material, const std::string& parameter) {
  return scene.appearance.materials.at(static_cast<std::size_t>(material)).name + ":" + parameter;
}
std::string name_of(const Scene& scene, const GridRef& ref) {
  return of_material(scene, ref.material, grid_name(ref.kind));
}
std::string name_of(const Scene& scene, const ImageRef& ref) {
  return of_material(scene, ref.material, scene.image_name(ref));
}
std::string name_of(const Scene&, const EnvironmentRef&) {
  return std::string(kWorldName) + ":" + kEnvironment;
}

std::string name_of(const Scene& scene, const VertexColorsRef& ref) {
  return scene.geometry->meshes().at(static_cast<std::size_t>(ref.mesh)).name + ":" + kVertexColors;
}

Unknown unknown_of(const Scene& scene, const std::vector<FieldRef>& unknown) {
  Unknown found;
  for (auto ref = unknown.begin(); ref != unknown.end(); ++ref)
    std::visit(
        [&](const auto& one) {
          if (std::find(unknown.begin(), ref, *ref) != ref)
            throw Refused("", name_of(scene, one) + " is listed twice", "list it once");
          found.fields.push_back(find(scene, one));
          found.channels.push_back(channels_of(scene, one));
        },
        *ref);
  for (std::size_t m = 0; m < scene.appearance.materials.size(); ++m)
    found.slots = std::max(found.slots, map_slots(scene, unknown, static_cast<int>(m)));
  if (found.slots > kTapedMaps)
    throw Refused("",
                  "The unknown images of a material have " + std::to_string(found.slots) +
                      " numbers, a colour of a node tree three of them",
                  "fit at most " + std::to_string(kTapedMaps) + " at once");
  return found;
}

/// Renders all tiles by the kernel that the unknowns need. `work` makes what a tile needs; `done(i, tile,
/// gradients)` takes the gradients of one, by field and cell.
template <class Done>
void render_tiles(const Scene& scene, const Camera& camera, const std::vector<FieldRef>& refs,
                  const Unknown& unknown, const RenderSettings& settings, const TapedWork& work,
                  Progress* progress, Film& film, const Done& done) {
  const auto render = [&]<int L>(std::integral_constant<int, L>) {
    const Prepared<L> prepared(scene, {}, refs);
    const PixelCamera pixels(camera, settings.width, settings.height, settings.frame);
    std::vector<TileReport> reports(tile_count(settings));
    const auto cells = static_cast<std::size_t>(cells_across(work.cell) * cells_across(work.cell));
    for_each_tile(settings, progress, [&](int i, const Tile& tile) {
      std::vector<SparseGradient> gradients(unknown.size() * cells);
      reports[i] = render_taped_tile(prepared, pixels, settings, tile, work, film, gradients);
      done(i, tile, std::move(gradients));
    });
    add_reports(reports, film);
  };
  if (unknown.slots <= kTaped)
    render(std::integral_constant<int, kTaped>());
  else
    render(std::integral_constant<int, kTapedMaps>());
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
      throw Refused("", "The weight of a pixel is " + std::to_string(weight),
                    "give finite numbers from 0 up");
    sum += weight;
  }
  if (!(sum > 0)) throw Refused("", "No pixel has a weight above 0", "give one that counts");
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
  const double cpu_start = cpu_seconds();
  const Unknown found = unknown_of(scene, unknown);
  if (progress) progress->fraction = 0;

  FieldGradient result;
  Film& film = result.film;
  const bool one_image = unknown.size() == 1 && std::holds_alternative<ImageRef>(unknown[0]);
  film = Film(settings.width, settings.height, settings.spp, one_image ? 1 : 0);
  for (std::size_t f = 0; f < found.size(); ++f)
    result.fields.emplace_back(loss ? count_of(found, f) : 0);

  OrderedSum sum(found.channels, result.fields);
  render_tiles(scene, camera, unknown, found, settings, {found.fields, loss}, progress, film,
               [&](int i, const Tile&, std::vector<SparseGradient> gradients) {
                 if (loss) sum.add(i, std::move(gradients));
               });
  film.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  film.cpu_seconds = cpu_seconds() - cpu_start;
  return result;
}

FieldJacobian render_field_jacobian(const Scene& scene, const Camera& camera,
                                    const std::vector<FieldRef>& unknown,
                                    const RenderSettings& settings,
                                    const std::vector<float>& weights, int cell,
                                    Progress* progress) {
  settings.check();
  if (cell < 1 || kTileSize % cell != 0)
    throw Refused("",
                  "Cells of " + std::to_string(cell) + " pixels do not fill a tile of " +
                      std::to_string(kTileSize),
                  "choose one of its divisors");
  if (weights.size() != static_cast<std::size_t>(settings.width) * settings.height)
    throw Refused("",
                  "There are " + std::to_string(weights.size()) + " weights for " +
                      std::to_string(settings.width) + " x " + std::to_string(settings.height) +
                      " pixels",
                  "give one a pixel");
  if (has_undecided_aims(scene))
    return render_field_jacobian(decide_aims(scene, camera, {}, settings, nullptr, progress),
                                 camera, unknown, settings, weights, cell, progress);
  const auto start = std::chrono::steady_clock::now();
  const double cpu_start = cpu_seconds();
  const Unknown found = unknown_of(scene, unknown);
  if (progress) progress->fraction = 0;

  FieldJacobian result;
  Film& film = result.film;
  film = Film(settings.width, settings.height, settings.spp, 0);
  const int columns = cells_along(settings.width, cell), rows = cells_along(settings.height, cell);
  const Eigen::Index cells = static_cast<Eigen::Index>(rows) * columns;
  for (std::size_t f = 0; f < found.size(); ++f) {
    const bool sparse = std::holds_alternative<ImageRef>(unknown[f]);
    result.fields.emplace_back(
        CellJacobian::Zero(cells, static_cast<Eigen::Index>(sparse ? 0 : count_of(found, f))));
    result.places.emplace_back(sparse ? static_cast<std::size_t>(cells) : 0);
  }

  const PixelLoss weighted = [&](std::size_t pixel, const Film&) {
    return PixelSlope{Colorf(weights[pixel]), {}};
  };
  const int across = cells_across(cell);
  // No two tiles share a row.
  render_tiles(
      scene, camera, unknown, found, settings,
      {.fields = found.fields, .loss = weighted, .cell = cell, .number_places = true}, progress,
      film, [&](int, const Tile& tile, const std::vector<SparseGradient>& gradients) {
        for (int y = tile.y0 / cell; y * cell < tile.y1; ++y)
          for (int x = tile.x0 / cell; x * cell < tile.x1; ++x)
            for (std::size_t f = 0; f < found.size(); ++f) {
              const SparseGradient& of_cell =
                  gradients[((y - tile.y0 / cell) * across + x - tile.x0 / cell) * found.size() +
                            f];
              const Eigen::Index row = static_cast<Eigen::Index>(y) * columns + x;
              if (result.places[f].empty())
                of_cell.add_to(result.fields[f].row(row).data(), found.channels[f]);
              else
                of_cell.each([&](std::uint32_t place, const Color<double>& slope) {
                  result.places[f][static_cast<std::size_t>(row)].push_back({place, Colorf(slope)});
                });
            }
      });
  film.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  film.cpu_seconds = cpu_seconds() - cpu_start;
  return result;
}

}  // namespace selenite
