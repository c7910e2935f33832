// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/shape/shape_descent.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "fit/photo/photo_render.h"
#include "fit/run/fit_job.h"
#include "math/error.h"
#include "render/lit_plane.h"
#include "scene/small_scenes.h"

namespace selenite {
namespace {

/// A ball of 0.55, each point moved out by a factor, over a floor, seen by eight cameras.
Scene body(const std::function<double(const Vec3d&)>& factor, int rings, const Material& material) {
  SceneBuilder builder;
  Mesh mesh = sphere_mesh(0.55, rings);
  mesh.uvs.push_back({"UVMap", {}});
  for (const auto& triangle : mesh.triangles)
    for (const int vertex : triangle) {
      const Vec3f& p = mesh.positions[static_cast<std::size_t>(vertex)];
      mesh.uvs[0].values.push_back({0.5f + 0.8f * p.x, 0.5f + 0.8f * p.y});
    }
  for (Vec3f& p : mesh.positions) p = Vec3f(Vec3d(p) * factor(normalize(Vec3d(p))));
  const int object = place(builder, std::move(mesh), builder.add_material(material));
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
Scene body(const std::function<double(const Vec3d&)>& factor, int rings, double colour = 0.7) {
  return body(factor, rings, matte("Body", colour));
}
/// With an image of its colour.
Material painted() {
  constexpr int kAlong = 16;
  std::vector<Colorf> texels;
  for (int i = 0; i < kAlong * kAlong; ++i)
    texels.emplace_back((i / 2 + i / (2 * kAlong)) % 2 ? 0.3f : 0.8f);
  Material material = matte("Body", 0.7);
  FieldMap& map = material.maps.emplace_back();
  map.field = material_field(&MaterialValues::base_color);
  map.texture =
      std::make_shared<Texture>("Wood", kAlong, kAlong, std::move(texels), std::vector<float>{},
                                false, Extension::kExtend, Interpolation::kLinear);
  return material;
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

const std::string kName = std::string("Body:") + kVertexPositions;

UnknownParameter vertices(double rate = 0.01, double low = -0.5, double high = 0.5) {
  return {"Body", kVertexPositions, {}, low, high, rate};
}

VertexMatrix matrix_of(const Vector& values) {
  VertexMatrix m(values.size() / 3, 3);
  for (Eigen::Index v = 0; v < m.rows(); ++v) m.row(v) = values.segment<3>(3 * v).transpose();
  return m;
}

/// Mean distance of the vertices from the blob along their directions, by the diagonal of its box.
double distance_to_blob(const Vector& values) {
  double sum = 0;
  for (Eigen::Index i = 0; i < values.size(); i += 3) {
    const Vec3d p{values[i], values[i + 1], values[i + 2]};
    sum += std::abs(length(p) - 0.55 * blob(normalize(p)));
  }
  return sum / static_cast<double>(values.size() / 3) / 2.2;
}

TEST(ShapeDescent, GoesFromABallToABlob) {
  const Scene target = body(blob, 24), start = body(ball, 8);
  Fit fit(start, photos_of(target, 32, 256), {vertices()}, short_fit(50));
  const double before = distance_to_blob((*fit.result().fields_best)[0]);
  while (fit.step()) {
  }
  const FitResult& found = fit.result();
  const Vector& best = (*found.fields_best)[0];
  EXPECT_EQ(found.stopped, StopReason::kIterations) << found.message;
  EXPECT_EQ(found.iterations, 50);
  EXPECT_LT(distance_to_blob(best), 0.35 * before);
  EXPECT_LT(found.best_validation, 0.1 * found.start_validation);
  EXPECT_EQ(found.photos.size(), 8u);
  EXPECT_EQ(found.shape_steps.given_up, 0)
      << found.shape_steps.turning << " " << found.shape_steps.intersecting;
  // No face is turned over: its normal stays on the side of the body's outside.
  const VertexMatrix positions = matrix_of(best);
  const Mesh& mesh = start.geometry->meshes()[0];
  for (const auto& t : mesh.triangles) {
    const auto corner = [&](std::size_t k) {
      return Vec3d{positions(t[k], 0), positions(t[k], 1), positions(t[k], 2)};
    };
    const Vec3d normal = cross(corner(1) - corner(0), corner(2) - corner(0));
    EXPECT_GT(dot(normal, corner(0) + corner(1) + corner(2)), 0);
  }
  const std::vector<int> joined = joined_vertices(matrix_of(fit.fields().start()[0]));
  EXPECT_EQ(crossings(positions, mesh.triangles, joined).size(), 0u);
}

TEST(ShapeDescent, AHighlightDoesNotOutweighOutlines) {
  Material glossy = plastic("Body");
  glossy.values.base_color = Color<double>(0.4);
  glossy.values.roughness = 0.25;
  const Scene target = body(blob, 24, glossy), start = body(ball, 8, glossy);
  Fit fit(start, photos_of(target, 32, 256), {vertices()}, short_fit(50));
  const double before = distance_to_blob((*fit.result().fields_best)[0]);
  while (fit.step()) {
  }
  // Where the brightest vertices set the step, 0.89 of the distance is left.
  EXPECT_LT(distance_to_blob((*fit.result().fields_best)[0]), 0.5 * before);
}

/// Of a blob, off by 0.9 % of its size, in waves of a few edges.
Scene rough_scan(const Scene& target) {
  const Mesh& mesh = target.geometry->meshes()[0];
  std::vector<Vec3f> rough = mesh.positions;
  for (Vec3f& p : rough) {
    const Vec3d at(p);
    const double wave = std::sin(14 * at.x + 1) * std::sin(14 * at.y + 2) * std::sin(14 * at.z + 3);
    p = p + Vec3f(normalize(at) * 0.06 * wave);
  }
  return with_vertices(target, 0, VertexNormals(mesh), rough);
}

TEST(ShapeDescent, RefinesAScanWithAnImage) {
  const Scene target = body(blob, 12, painted()), start = rough_scan(target);
  FitSettings settings = short_fit(40);
  settings.spp = 4;
  Fit fit(start, photos_of(target, 32, 256), {vertices(0.0025)}, settings);
  const double before = distance_to_blob((*fit.result().fields_best)[0]);
  while (fit.step()) {
  }
  const FitResult& found = fit.result();
  // Waves of few edges are smoothed: 0.77 is left.
  EXPECT_LT(distance_to_blob((*found.fields_best)[0]), 0.85 * before);
  EXPECT_EQ(*found.fields_best, *found.fields_last) << "an image cannot say which are the best";
}

TEST(ShapeDescent, VerticesSlideLessUnderAnImage) {
  const auto sliding = [](const Material& material) {  // by how far they go out
    const Scene target = body(blob, 12, material), start = body(ball, 12, material);
    Fit fit(start, photos_of(target, 16, 64), {vertices(0.0025)}, short_fit(6));
    const VertexMatrix before = matrix_of(fit.fields().start()[0]);
    while (fit.step()) {
    }
    const VertexMatrix moved = matrix_of((*fit.result().fields_last)[0]) - before;
    const VertexMatrix outwards = before.rowwise().normalized();
    const Vector along = moved.cwiseProduct(outwards).rowwise().sum();
    return (moved - outwards.cwiseProduct(along.replicate(1, 3))).norm() / along.norm();
  };
  EXPECT_LT(sliding(painted()), 0.5 * sliding(matte("Body", 0.7)));
}

TEST(ShapeDescent, GoesOnFromItsStateToTheSameBits) {
  for (const Material& material : {matte("Body", 0.7), painted()}) {
    const Scene target = body(blob, 8, material), start = body(ball, 6, material);
    const std::vector<Photo> photos = photos_of(target, 12, 16);
    Fit whole(start, photos, {vertices()}, short_fit(4)),
        first(start, photos, {vertices()}, short_fit(4));
    while (whole.step()) {
    }
    for (int done = 1; done <= 3; ++done) {  // before and after details come in
      first.step();
      Fit second(start, photos, {vertices()}, short_fit(4));
      second.restore(first.saved());
      while (second.step()) {
      }
      EXPECT_EQ(*second.result().fields_last, *whole.result().fields_last) << done;
      EXPECT_EQ(*second.result().fields_best, *whole.result().fields_best) << done;
      EXPECT_EQ(second.result().history.size(), whole.result().history.size()) << done;
    }
    Fit other(body(ball, 5), photos, {vertices()}, short_fit(4));
    EXPECT_THROW(other.restore(first.saved()), InvalidArgument);
  }
}

TEST(ShapeDescent, KeepsVerticesInTheirBox) {
  const Scene target = body(blob, 8), start = body(ball, 6);
  Fit fit(start, photos_of(target, 12, 16), {vertices(0.1, 0, 0)}, short_fit(5));
  while (fit.step()) {
  }
  EXPECT_LE((*fit.result().fields_last)[0].cwiseAbs().maxCoeff(), 0.55 + 1e-6);
}

TEST(ShapeDescent, NamesAllThatIsWrong) {
  const Scene scene = body(ball, 6);
  const std::vector<Photo> photos = photos_of(scene, 8, 2);
  const auto fit = [&](UnknownParameter one) { Fit(scene, photos, {one}, short_fit(1)); };
  UnknownParameter nobody = vertices();
  nobody.owner = "Nobody";
  EXPECT_THROW(fit(nobody), UnknownName);
  UnknownParameter bad = vertices(0, 0.1, 200);
  bad.start = {1};
  try {
    fit(bad);
    FAIL();
  } catch (const InvalidArgument& error) {
    const std::string text = error.what();
    for (const char* word : {"learning rate", "bounds", "start"})
      EXPECT_NE(text.find(word), std::string::npos) << text;
  }
  const UnknownParameter roughness{"Body", "roughness", {0.5}, 0, 1};
  EXPECT_THROW(Fit(scene, photos, {vertices(), roughness}, short_fit(1)), InvalidArgument);
}

TEST(ShapeDescent, CanBeCancelled) {
  const Scene target = body(blob, 8), start = body(ball, 6);
  FitJob job(start, photos_of(target, 12, 16), {vertices()}, short_fit(100000));
  job.start();
  job.cancel();
  job.join();
  EXPECT_EQ(job.state().stopped, StopReason::kCancelled);
  EXPECT_TRUE(job.state().faults.empty());
}

Stage stage_of(const Scene& scene, const std::vector<Photo>& photos, const std::string& name,
               int iterations) {
  return {name, {name}, {kName}, scene, photos, short_fit(iterations)};
}

TEST(ShapeDescent, TakesTurnsWithAColour) {
  const Scene target = body(blob, 24, 0.7), start = body(ball, 8, 0.5);
  const std::vector<Photo> photos = photos_of(target, 32, 256);
  const UnknownParameter colour{"Body", "base_color", {0.5, 0.5, 0.5}, 0.01, 0.99};
  // The colour is first: a shape makes up for a wrong one.
  StagedFit fit({vertices(), colour},
                {stage_of(start, photos, colour.name(), 10), stage_of(start, photos, kName, 30),
                 stage_of(start, photos, colour.name(), 10), stage_of(start, photos, kName, 15),
                 stage_of(start, photos, colour.name(), 10)});
  EXPECT_EQ(fit.fit().settings().search, "auto") << "the first stage that can, searches";
  const double before = distance_to_blob(fit.point()->fields[0].second);
  while (fit.ended().size() < 2) ASSERT_TRUE(fit.step());
  const double alone = distance_to_blob(fit.point()->fields[0].second);
  EXPECT_LT(alone, 0.6 * before);
  while (fit.step()) {
  }
  ASSERT_EQ(fit.ended().size(), 4u);
  RunPoint point = *fit.point();
  EXPECT_LT(distance_to_blob(point.fields[0].second), 0.95 * alone);
  point.take(*fit.fit().problem(), fit.fit().result().best, *fit.fit().result().fields_best);
  EXPECT_NEAR(point.scalar(colour.name())[1], 0.7, 0.06) << "eight faces along a side are no blob";
}

/// Two squares side by side, each of two triangles; the second one is moved and turned.
VertexMatrix squares(const std::function<Vec3d(double, double)>& second) {
  VertexMatrix m(8, 3);
  for (int i = 0; i < 4; ++i) {
    const double u = i % 2, v = i / 2;
    m.row(i) << u, v, 0.0;
    const Vec3d p = second(u, v);
    m.row(4 + i) << p.x, p.y, p.z;
  }
  return m;
}
const std::vector<std::array<int, 3>> kSquares{{0, 1, 3}, {0, 3, 2}, {4, 5, 7}, {4, 7, 6}};

TEST(FaceGuard, FindsSurfacesThatCrossEachOther) {
  const auto count = [](const std::function<Vec3d(double, double)>& second) {
    const VertexMatrix m = squares(second);
    return crossings(m, kSquares, joined_vertices(m)).size();
  };
  EXPECT_EQ(count([](double u, double v) { return Vec3d{u, v, 0.1}; }), 0u);
  EXPECT_EQ(count([](double u, double v) { return Vec3d{u, v, 0}; }), 0u);
  // Two sides and the diagonal, and the diagonal of the square that they go through.
  EXPECT_EQ(count([](double u, double v) { return Vec3d{0.3 + 0.4 * u, 0.45, v - 0.3}; }), 4u);
  EXPECT_EQ(count([](double u, double v) { return Vec3d{0.3 + 0.4 * u, 0.45, v + 0.3}; }), 0u);
}

TEST(FaceGuard, VerticesAtOnePlaceAreOne) {
  // Cut along the seam u = 1; a little apart, one side goes through the other.
  const auto touching = [](double u, double v) { return Vec3d{1 + u, v, 0}; };
  const std::vector<int> joined = joined_vertices(squares(touching));
  EXPECT_EQ(joined[4], 1);
  const VertexMatrix apart = squares([](double u, double v) {
    return Vec3d{0.95 + u, v, 0.1 * v - 0.05};
  });
  EXPECT_EQ(crossings(apart, kSquares, joined).size(), 0u);
  EXPECT_GT(crossings(apart, kSquares, joined_vertices(apart)).size(), 0u);
}

TEST(FaceGuard, RefusesAStepThroughASurface) {
  const VertexMatrix before = squares([](double u, double v) {
    return Vec3d{0.3 + 0.4 * u, 0.45, v + 0.3};
  });
  Mesh mesh;
  for (Eigen::Index i = 0; i < before.rows(); ++i)
    mesh.positions.emplace_back(Vec3d{before(i, 0), before(i, 1), before(i, 2)});
  mesh.triangles = kSquares;
  mesh.corner_normals.assign(12, {0, 0, 1});
  std::fill(mesh.corner_normals.begin() + 6, mesh.corner_normals.end(), Vec3f{0, -1, 0});
  const VertexNormals normals(mesh);
  FaceGuard guard(mesh.triangles, normals, before);
  VertexMatrix through = before, aside = before, turned = before;
  through.bottomRows(4).col(2).array() -= 0.6;
  aside.bottomRows(4).col(2).array() += 0.6;
  turned.row(0) << 2, 2, 0;
  EXPECT_EQ(guard.crossing(through).size(), 8u);
  EXPECT_EQ(guard.crossing(aside).size(), 0u);
  EXPECT_EQ(guard.move_to(through), FaceGuard::Verdict::kCrossed);
  EXPECT_EQ(guard.move_to(turned), FaceGuard::Verdict::kTurned);
  EXPECT_EQ(guard.move_to(aside), FaceGuard::Verdict::kGood);
  // What crosses at the start may stay so.
  guard.set(through);
  EXPECT_EQ(guard.move_to(through), FaceGuard::Verdict::kGood);
}

}  // namespace
}  // namespace selenite
