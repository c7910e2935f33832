// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/shape/shape_gradient.h"

#include <algorithm>
#include <chrono>

#include "math/cpu_seconds.h"
#include "math/fault.h"
#include "math/rng.h"
#include "render/driver/aim_pilot.h"
#include "render/driver/ordered_sum.h"
#include "render/driver/render.h"
#include "render/driver/tile_pool.h"
#include "render/shape/fixed_normals.h"
#include "render/shape/moved_paths.h"
#include "render/shape/shadow_edges.h"
#include "render/shape/silhouettes.h"

namespace selenite {
namespace {

/// Of the picture, for one of the derivative with fixed normals: the noise of the loss is most of
/// what is left then.
constexpr int kPictureSamples = 4;

/// Of the derivative's samples, which are independent of those of the picture.
std::uint64_t other_seed(std::uint64_t seed) { return mix64(seed + 0x5ca1ab1e); }

ShapeGradient gradient_of(const Scene& scene, const Camera& camera, int instance,
                          const VertexNormals& normals, const RenderSettings& settings,
                          const PictureLoss& loss, Progress* progress, ShadingNormals shading) {
  settings.check();
  const MovedMesh mesh{*scene.geometry, instance, normals, shading};
  if (has_undecided_aims(scene))
    return gradient_of(decide_aims(scene, camera, {}, settings, nullptr, progress), camera,
                       instance, normals, settings, loss, progress, shading);
  const auto start = std::chrono::steady_clock::now();
  const double cpu_start = cpu_seconds();
  ShapeGradient result;
  RenderSettings of_picture = settings;
  if (shading == ShadingNormals::kFixed) of_picture.spp *= kPictureSamples;
  result.film = render(scene, camera, {}, of_picture, progress);
  Film& film = result.film;
  const Picture weights = loss(film);

  RenderSettings others = settings;
  others.seed = other_seed(settings.seed);
  const Prepared<0> prepared(scene, {});
  const PixelCamera pixels(camera, settings.width, settings.height, settings.frame);
  const std::vector<MeshEdge> edges = edges_of(mesh);
  const Silhouettes silhouettes(prepared, pixels, others, mesh, edges, weights);
  const ShadowEdges shadows(prepared, pixels, others, mesh, edges, weights);

  std::vector<std::vector<double>> sums(1, std::vector<double>(3 * mesh.places()));
  OrderedSum sum({3}, sums);
  const int tiles = tile_count(settings);
  const int count = edge_samples(settings);
  for_each_tile(settings, progress, [&](int i, const Tile& tile) {
    std::vector<SparseGradient> gradients(1);
    VertexSums of_tile(mesh, gradients[0]);
    const int depth = shading == ShadingNormals::kFixed ? 1 : settings.depth;
    MovedPaths paths(prepared, pixels, depth, mesh);
    for (int y = tile.y0; y < tile.y1; ++y) {
      CameraSamples samples(prepared, pixels, others, y, tile.x0, tile.x1);
      for (int x = tile.x0; x < tile.x1; ++x) {
        const auto pixel = static_cast<std::size_t>(y) * settings.width + x;
        if (!settings.has(pixel)) continue;
        const Colorf weight = weights[pixel] / static_cast<float>(settings.spp);
        for (int s = 0; s < settings.spp; ++s) paths.add(samples.next(), weight, of_tile);
      }
    }
    PathTracer<0> tracer(prepared, settings.depth, pixels);
    const auto see = [&](const Ray& ray, const std::optional<Hit>& hit, Random& random) {
      return tracer.trace(ray, hit, random).value;
    };
    const auto first = static_cast<int>(static_cast<std::int64_t>(count) * i / tiles);
    const auto last = static_cast<int>(static_cast<std::int64_t>(count) * (i + 1) / tiles);
    for (int k = first; k < last; ++k) {
      silhouettes.add(see, k, count, of_tile);
      shadows.add(k, count, of_tile);
    }
    sum.add(i, std::move(gradients));
  });

  const std::size_t vertices = mesh.vertex_count();
  const auto at = [&](std::size_t place) {
    return Vec3d{sums[0][3 * place], sums[0][3 * place + 1], sums[0][3 * place + 2]};
  };
  std::vector<Vec3d> by_normal;
  for (std::size_t v = 0; v < vertices; ++v) result.vertices.push_back(at(v));
  for (std::size_t n = vertices; n < mesh.places(); ++n) by_normal.push_back(at(n));
  normals.spread(mesh.mesh().positions, by_normal, result.vertices);
  film.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  film.cpu_seconds = cpu_seconds() - cpu_start;
  return result;
}

}  // namespace

int movable_object(const Scene& scene, std::string_view name) {
  const auto& instances = scene.geometry->instances();
  for (std::size_t i = 0; i < instances.size(); ++i) {
    if (instances[i].name != name) continue;
    if (!scene.geometry->in_world_space(static_cast<int>(i)))
      throw Refused("Object '" + instances[i].name + "'", "several objects share its mesh",
                    "make the mesh a single user");
    return static_cast<int>(i);
  }
  throw NotFound("Object '" + std::string(name) + "'", "it is not in the scene",
                 "give one that is rendered");
}

ShapeGradient render_shape_gradient(const Scene& scene, const Camera& camera, int instance,
                                    const VertexNormals& normals, const RenderSettings& settings,
                                    const PictureLoss& loss, Progress* progress) {
  return gradient_of(scene, camera, instance, normals, settings, loss, progress,
                     ShadingNormals::kFollow);
}

ShapeGradient render_fixed_normals_gradient(const Scene& scene, const Camera& camera, int instance,
                                            const VertexNormals& normals,
                                            const RenderSettings& settings, const PictureLoss& loss,
                                            Progress* progress) {
  return gradient_of(scene, camera, instance, normals, settings, loss, progress,
                     ShadingNormals::kFixed);
}

bool has_image(const Scene& scene, int instance) {
  const Instance& placed = scene.geometry->instances()[static_cast<std::size_t>(instance)];
  return std::ranges::any_of(placed.materials, [&](int index) {
    const Material& material = scene.appearance.materials[static_cast<std::size_t>(index)];
    return !material.maps.empty() || !material.images.empty();
  });
}

Scene with_vertices(const Scene& scene, int instance, const VertexNormals& normals,
                    const std::vector<Vec3f>& positions) {
  Scene moved = scene;
  moved.geometry =
      scene.geometry->with_vertices(instance, positions, normals.corner_normals(positions));
  return moved;
}

}  // namespace selenite
