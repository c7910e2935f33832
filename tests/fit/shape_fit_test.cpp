// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/shape/shape_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "fit/photo/photo_render.h"
#include "fit/shape/shape_job.h"
#include "math/error.h"
#include "render/lit_plane.h"
#include "scene/small_scenes.h"

namespace selenite {
namespace {

/// A ball of 0.55, each point moved out by a factor, over a floor, seen by eight cameras.
Scene body(const std::function<double(const Vec3d&)>& factor, int rings) {
  SceneBuilder builder;
  Mesh mesh = sphere_mesh(0.55, rings);
  for (Vec3f& p : mesh.positions) p = Vec3f(Vec3d(p) * factor(normalize(Vec3d(p))));
  const int object = place(builder, std::move(mesh), builder.add_material(matte("Body", 0.7)));
  builder.instances[object].name = "Body";
  place(builder, quad_mesh(4), builder.add_material(matte("Floor", 0.4)),
        translation({0, 0, -1}));
  builder.add_light(area(120, 2, {2, -1, 3}));
  set_sky(builder, 0.4);
  for (int i = 0; i < 8; ++i) {
    const double turn = 2 * kPi<double> * i / 8;
    add_view(builder, {4 * std::cos(turn), 4 * std::sin(turn), i % 2 ? 2.2 : 0.6}, {0, 0, 0}, 60);
  }
  const Scene scene = builder.build();
  const Mesh& placed = scene.geometry->meshes()[0];
  return with_vertices(scene, 0, VertexNormals(placed), placed.positions);
}
double ball(const Vec3d&) { return 1; }
double blob(const Vec3d& n) {
  return 1.15 + 0.25 * n.x * n.y + 0.15 * std::sin(3 * n.z + 1) + 0.1 * n.y;
}

std::vector<Photo> photos_of(const Scene& scene, int size, int spp) {
  std::vector<Photo> photos;
  for (const Camera& camera : scene.cameras) {
    Photo photo = photo_of_size(camera.name, size, size);
    photo.reference = render_photo(scene, photo, {}, {spp, 99, 3, 0, 0}).mean;
    photos.push_back(std::move(photo));
  }
  return photos;
}

FitSettings short_fit(int iterations) {
  FitSettings settings;
  settings.loss = "dual-buffer";
  settings.iterations = iterations;
  settings.spp = 8;
  settings.depth = 3;
  settings.tolerance = 0;
  return settings;
}

/// Mean distance of the vertices from the blob along their directions, by the diagonal of its box.
double distance_to_blob(const VertexMatrix& vertices) {
  double sum = 0;
  for (Eigen::Index i = 0; i < vertices.rows(); ++i) {
    const Vec3d p{vertices(i, 0), vertices(i, 1), vertices(i, 2)};
    sum += std::abs(length(p) - 0.55 * blob(normalize(p)));
  }
  return sum / static_cast<double>(vertices.rows()) / 2.2;
}

TEST(ShapeFit, GoesFromABallToABlob) {
  const int size = std::getenv("SIZE") ? std::atoi(std::getenv("SIZE")) : 32;
  const int rings = std::getenv("RINGS") ? std::atoi(std::getenv("RINGS")) : 8;
  const int iterations = std::getenv("ITER") ? std::atoi(std::getenv("ITER")) : 40;
  UnknownVertices unknown{"Body"};
  if (std::getenv("LR")) unknown.learning_rate = std::atof(std::getenv("LR"));
  if (std::getenv("LAMBDA")) unknown.smoothness = std::atof(std::getenv("LAMBDA"));
  const Scene target = body(blob, 24), start = body(ball, rings);
  FitSettings settings = short_fit(iterations);
  if (std::getenv("SPP")) settings.spp = std::atoi(std::getenv("SPP"));
  ShapeFit fit(start, photos_of(target, size, 256), unknown, settings);
  const double before = distance_to_blob(fit.result().best);
  while (fit.step())
    if (fit.result().iterations % 10 == 0)
      std::printf("%d %.6f %.5f\n", fit.result().iterations, fit.result().history.back().loss, distance_to_blob(fit.result().last));
  const ShapeResult found = fit.result();
  std::printf("%.4f -> %.4f, loss %.6f -> %.6f, %.3f CPU s an iteration\n", before, distance_to_blob(found.best), found.history.front().loss, found.best_loss, found.cpu_seconds / iterations);
  EXPECT_LT(distance_to_blob(found.best), 0.25 * before);
}

}  // namespace
}  // namespace selenite
