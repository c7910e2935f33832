// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/shape/coverage.h"

#include "math/cpu_seconds.h"
#include "math/rng.h"
#include "render/driver/ordered_sum.h"
#include "render/driver/tile_pool.h"
#include "render/path/camera_samples.h"
#include "render/shape/silhouettes.h"

namespace selenite {
namespace {

/// Of the derivative's samples.
constexpr std::uint64_t kOther = 0xc0ffee5eed;

}  // namespace

CoverageGradient render_coverage_gradient(const Scene& scene, const Camera& camera, int instance,
                                          const RenderSettings& settings, const CoverageLoss& loss,
                                          Progress* progress) {
  settings.check();
  const double start = cpu_seconds();
  const Prepared<0> prepared(scene, {});
  const PixelCamera pixels(camera, settings.width, settings.height, settings.frame);
  CoverageGradient result;
  result.coverage.resize(static_cast<std::size_t>(settings.width) * settings.height);
  for_each_tile(settings, progress, [&](int, const Tile& tile) {
    for (int y = tile.y0; y < tile.y1; ++y) {
      CameraSamples samples(prepared, pixels, settings, y, tile.x0, tile.x1);
      for (int x = tile.x0; x < tile.x1; ++x) {
        const auto pixel = static_cast<std::size_t>(y) * settings.width + x;
        if (!settings.has(pixel)) continue;
        int count = 0;
        for (int s = 0; s < settings.spp; ++s) {
          const auto& hit = samples.next().hit;
          count += hit && hit->instance == instance;
        }
        result.coverage[pixel] = static_cast<float>(count) / static_cast<float>(settings.spp);
      }
    }
  });

  Picture weights;
  for (const float slope : loss(result.coverage)) weights.emplace_back(slope, 0.f, 0.f);
  RenderSettings others = settings;
  others.seed = mix64(settings.seed + kOther);
  const VertexNormals normals(scene.geometry->meshes()[static_cast<std::size_t>(
      scene.geometry->instances()[static_cast<std::size_t>(instance)].mesh)]);
  const MovedMesh mesh{*scene.geometry, instance, normals};
  const std::vector<MeshEdge> edges = edges_of(mesh);
  const Silhouettes silhouettes(prepared, pixels, others, mesh, edges, weights);
  const auto seen = [&](const Ray&, const std::optional<Hit>& hit, Random&) {
    return Colorf(hit && hit->instance == instance ? 1.f : 0.f);
  };
  std::vector<std::vector<double>> sums(1, std::vector<double>(3 * mesh.places()));
  OrderedSum sum({3}, sums);
  const int tiles = tile_count(settings);
  const int count = edge_samples(settings);
  for_each_tile(settings, progress, [&](int i, const Tile&) {
    std::vector<SparseGradient> gradients(1);
    VertexSums of_tile(mesh, gradients[0]);
    const auto first = static_cast<int>(static_cast<std::int64_t>(count) * i / tiles);
    const auto last = static_cast<int>(static_cast<std::int64_t>(count) * (i + 1) / tiles);
    for (int k = first; k < last; ++k) silhouettes.add(seen, k, count, of_tile);
    sum.add(i, std::move(gradients));
  });
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
    result.vertices.push_back({sums[0][3 * v], sums[0][3 * v + 1], sums[0][3 * v + 2]});
  result.cpu_seconds = cpu_seconds() - start;
  return result;
}

}  // namespace selenite
