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
  place(builder, quad_mesh(4), builder.add_material(matte("Floor", 0.4)), translation({0, 0, -1}));
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
  const Scene target = body(blob, 24), start = body(ball, 8);
  ShapeFit fit(start, photos_of(target, 32, 256), {"Body"}, short_fit(50));
  const double before = distance_to_blob(fit.result().best);
  while (fit.step()) {
  }
  const ShapeResult found = fit.result();
  EXPECT_EQ(fit.stopped(), StopReason::kIterations);
  EXPECT_EQ(found.iterations, 50);
  EXPECT_LT(distance_to_blob(found.best), 0.35 * before);
  EXPECT_LT(found.best_loss, 0.1 * found.history.front().loss);
  // No face is turned over: its normal stays on the side of the body's outside.
  const Mesh& mesh = start.geometry->meshes()[0];
  for (const auto& t : mesh.triangles) {
    const auto corner = [&](int k) {
      const auto row = found.best.row(t[static_cast<std::size_t>(k)]);
      return Vec3d{row[0], row[1], row[2]};
    };
    const Vec3d normal = cross(corner(1) - corner(0), corner(2) - corner(0));
    EXPECT_GT(dot(normal, corner(0) + corner(1) + corner(2)), 0);
  }
}

TEST(ShapeFit, GoesOnFromItsStateToTheSameBits) {
  const Scene target = body(blob, 8), start = body(ball, 6);
  const std::vector<Photo> photos = photos_of(target, 12, 16);
  ShapeFit whole(start, photos, {"Body"}, short_fit(4)),
      first(start, photos, {"Body"}, short_fit(4));
  while (whole.step()) {
  }
  first.step();
  first.step();
  ShapeFit second(start, photos, {"Body"}, short_fit(4));
  second.restore(first.saved());
  while (second.step()) {
  }
  EXPECT_EQ(second.result().best, whole.result().best);
  EXPECT_EQ(second.result().history.size(), whole.result().history.size());
  ShapeFit other(body(ball, 5), photos, {"Body"}, short_fit(4));
  EXPECT_THROW(other.restore(first.saved()), InvalidArgument);
}

TEST(ShapeFit, KeepsVerticesInTheirBox) {
  const Scene target = body(blob, 8), start = body(ball, 6);
  UnknownVertices unknown{"Body"};
  unknown.minimum = unknown.maximum = 0;
  unknown.learning_rate = 0.1;
  ShapeFit fit(start, photos_of(target, 12, 16), unknown, short_fit(5));
  while (fit.step()) {
  }
  EXPECT_LE(fit.result().last.cwiseAbs().maxCoeff(), 0.55 + 1e-6);
}

TEST(ShapeFit, NamesAllThatIsWrong) {
  const Scene scene = body(ball, 6);
  std::vector<Photo> photos = photos_of(scene, 8, 2);
  EXPECT_THROW(ShapeFit(scene, photos, {"Nobody"}, short_fit(1)), UnknownName);
  UnknownVertices unknown{"Body"};
  unknown.learning_rate = 0;
  unknown.smoothness = -1;
  photos[1].align = true;
  try {
    const ShapeFit fit(scene, photos, unknown, short_fit(1));
    FAIL();
  } catch (const InvalidArgument& error) {
    const std::string text = error.what();
    for (const char* word : {"learning rate", "smoothness", "alignment"})
      EXPECT_NE(text.find(word), std::string::npos) << text;
  }
}

TEST(ShapeJob, CanBeCancelled) {
  const Scene target = body(blob, 8), start = body(ball, 6);
  ShapeJob job(start, photos_of(target, 12, 16), {"Body"}, short_fit(100000));
  job.start();
  EXPECT_THROW(job.start(), InvalidArgument);
  job.cancel();
  job.join();
  EXPECT_TRUE(job.state().done);
  EXPECT_EQ(job.state().stopped, StopReason::kCancelled);
  EXPECT_TRUE(job.state().faults.empty());
}

}  // namespace
}  // namespace selenite
