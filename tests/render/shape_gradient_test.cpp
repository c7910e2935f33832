// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/shape/shape_gradient.h"

#include <gtest/gtest.h>

#include <cstring>
#include <utility>

#include "math/error.h"
#include "math/statistics.h"
#include "render/driver/render.h"
#include "render/lit_plane.h"
#include "render/shape/fixed_normals.h"
#include "render/shape/moved_mesh.h"
#include "scene/small_scenes.h"

namespace selenite {
namespace {

enum class Body { kSphere, kBumpy, kFlat };

Mesh body_mesh(Body body) {
  Mesh mesh = sphere_mesh(0.7, 8, body != Body::kFlat);
  if (body != Body::kBumpy) return mesh;
  for (Vec3f& p : mesh.positions) {
    const float bump =
        1 + 0.25f * std::sin(5 * p.x + 1) * std::sin(6 * p.y) + 0.15f * std::cos(7 * p.z + p.x);
    p = p * bump;
  }
  return mesh;
}

/// A body over a floor under an area lamp; object 0.
Scene lit_body(Body body, double sky, const Material& material) {
  SceneBuilder builder;
  place(builder, body_mesh(body), builder.add_material(material));
  place(builder, quad_mesh(4), builder.add_material(matte("Floor", 0.6)),
        translation({0, 0, -0.9}));
  builder.add_light(area(60, 1, {1.5, -1, 2.5}));
  set_sky(builder, sky);
  add_view(builder, {0.3, -4, 1.8}, {0, 0, -0.2}, 45);
  Scene scene = builder.build();
  const VertexNormals normals(scene.geometry->meshes()[0]);
  return with_vertices(scene, 0, normals, scene.geometry->meshes()[0].positions);
}

/// A weight of each pixel that knows where it is.
std::vector<float> pattern(const RenderSettings& s) {
  std::vector<float> weights;
  for (int y = 0; y < s.height; ++y)
    for (int x = 0; x < s.width; ++x)
      weights.push_back(1 + 0.6f * std::sin(0.4f * static_cast<float>(x)) *
                                std::cos(0.3f * static_cast<float>(y) + 1));
  return weights;
}

struct Case {
  const char* name;
  Body body;
  double sky;
  int depth;
  double roughness;  ///< of a plastic; 0: matte
  ShadingNormals shading = ShadingNormals::kFollow;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }
class Vertices : public testing::TestWithParam<Case> {};

/// Fifty vertices of which the picture knows something, those of the outline among them.
std::vector<int> seen_vertices(const std::vector<Vec3d>& gradient) {
  std::vector<int> seen;
  for (int v = 0; v < static_cast<int>(gradient.size()) && seen.size() < 50; ++v)
    if (length(gradient[static_cast<std::size_t>(v)]) > 0) seen.push_back(v);
  return seen;
}
Vec3d axis_of(int i) {
  return {i % 3 == 0 ? 1.0 : 0.0, i % 3 == 1 ? 1.0 : 0.0, i % 3 == 2 ? 1.0 : 0.0};
}

TEST_P(Vertices, AgreeWithDifferencesOfRenders) {
  const Case& c = GetParam();
  Material material = matte("Body", 0.7);
  if (c.roughness > 0) {
    material = plastic("Body");
    material.values.roughness = c.roughness;
  }
  const Scene scene = lit_body(c.body, c.sky, material);
  const VertexNormals normals(scene.geometry->meshes()[0]);
  const std::vector<Vec3f>& positions = scene.geometry->meshes()[0].positions;
  RenderSettings settings;
  settings.width = settings.height = 24;
  settings.depth = c.depth;
  const std::vector<float> weights = pattern(settings);
  const PictureLoss loss = [&](const Film&) {
    Picture slopes;
    for (const float weight : weights) slopes.emplace_back(weight / 576);
    return slopes;
  };
  const auto mean = [&](int vertex, const Vec3d& step) {
    std::vector<Vec3f> moved = positions;
    moved[static_cast<std::size_t>(vertex)] += Vec3f(step);
    Scene other = with_vertices(scene, 0, normals, moved);
    if (c.shading == ShadingNormals::kFixed)
      other.geometry = scene.geometry->with_vertices(0, moved, normals.corner_normals(positions));
    const Film film = render(other, other.cameras[0], {}, settings);
    double sum = 0;
    for (std::size_t p = 0; p < weights.size(); ++p)
      sum += weights[p] * (film.mean[p].r + film.mean[p].g + film.mean[p].b) / 576;
    return sum;
  };

  constexpr double kStep = 0.01;
  std::vector<int> chosen;
  std::vector<Tally> found(50), wanted(50);
  for (int seed = 0; seed < 8; ++seed) {
    settings.seed = 100 + seed;
    settings.spp = 192;
    const auto render =
        c.shading == ShadingNormals::kFixed ? render_fixed_normals_gradient : render_shape_gradient;
    const ShapeGradient gradient =
        render(scene, scene.cameras[0], 0, normals, settings, loss, nullptr);
    if (seed == 0) chosen = seen_vertices(gradient.vertices);
    ASSERT_EQ(chosen.size(), 50u);
    settings.spp = 32;
    for (int i = 0; i < 50; ++i) {
      const int vertex = chosen[static_cast<std::size_t>(i)];
      const Vec3d axis = axis_of(i);
      found[i].add(dot(gradient.vertices[static_cast<std::size_t>(vertex)], axis));
      wanted[i].add((mean(vertex, axis * kStep) - mean(vertex, axis * -kStep)) / (2 * kStep));
    }
  }
  double size = 0, gap = 0, noise = 0;
  for (int i = 0; i < 50; ++i) {
    const Estimate a = found[i].estimate(), b = wanted[i].estimate();
    size += square(a.mean) / 50;
    noise += (square(a.error) + square(b.error)) / 50;
    gap += square(a.mean - b.mean) / 50;
  }
  gap -= noise;  // which adds as much to it
  RecordProperty("gap", std::to_string(gap / size));
  RecordProperty("error_per_slope", std::to_string(std::sqrt(noise / size)));
  for (int i = 0; i < 50; ++i) {
    const Estimate a = found[i].estimate(), b = wanted[i].estimate();
    // 8 % of the usual size for the curvature, and for rare paths that a difference may miss.
    EXPECT_LT(std::abs(a.mean - b.mean), 4 * std::hypot(a.error, b.error) + 0.08 * std::sqrt(size))
        << chosen[static_cast<std::size_t>(i)] << " " << i % 3 << ": " << a.mean << " +- "
        << a.error << ", " << b.mean << " +- " << b.error;
  }
  EXPECT_LT(gap, 0.1 * size);
}

// Direct light: docs/method/shape.md says what is left out of light over several bounces.
INSTANTIATE_TEST_SUITE_P(Bodies, Vertices,
                         testing::Values(Case{"sphere, direct light", Body::kSphere, 0, 1, 0},
                                         Case{"bumpy, direct light", Body::kBumpy, 0, 1, 0},
                                         Case{"flat faces, direct light", Body::kFlat, 0, 1, 0},
                                         Case{"sphere under a sky", Body::kSphere, 0.4, 1, 0},
                                         Case{"bumpy plastic, direct light", Body::kBumpy, 0, 1,
                                              0.4},
                                         Case{"flat faces, fixed normals", Body::kFlat, 0.4, 1, 0,
                                              ShadingNormals::kFixed}));

TEST(FixedNormals, HasLittleOfTheNoise) {
  const Scene scene = lit_body(Body::kBumpy, 0.4, matte("Body", 0.7));
  const VertexNormals normals(scene.geometry->meshes()[0]);
  RenderSettings settings;
  settings.width = settings.height = 24;
  settings.spp = 4;
  const auto noise = [&](auto render) {
    std::vector<Tally> found;
    for (int seed = 0; seed < 8; ++seed) {
      settings.seed = 50 + seed;
      const ShapeGradient gradient = render(
          scene, scene.cameras[0], 0, normals, settings, [](const Film& film) { return film.mean; },
          nullptr);
      found.resize(3 * gradient.vertices.size());
      for (std::size_t i = 0; i < found.size(); ++i)
        found[i].add(dot(gradient.vertices[i / 3], axis_of(static_cast<int>(i % 3))));
    }
    double sum = 0;
    for (const Tally& one : found) sum += square(one.estimate().error);
    return sum;
  };
  EXPECT_LT(noise(render_fixed_normals_gradient), 0.1 * noise(render_shape_gradient));
}

TEST(FixedNormals, IsThatOfSurfacesWithAnImage) {
  Material painted = matte("Body", 0.7);
  EXPECT_FALSE(has_image(lit_body(Body::kSphere, 0, painted), 0));
  painted.maps.emplace_back();
  EXPECT_TRUE(has_image(lit_body(Body::kSphere, 0, painted), 0));
  EXPECT_FALSE(has_image(lit_body(Body::kSphere, 0, painted), 1)) << "of the floor";
}

TEST(ShapeGradient, IsTheSameForAnyNumberOfThreads) {
  const Scene scene = lit_body(Body::kBumpy, 0.3, matte("Body", 0.7));
  const VertexNormals normals(scene.geometry->meshes()[0]);
  RenderSettings settings;
  settings.width = 40;
  settings.height = 20;
  settings.spp = 3;
  const auto gradient = [&](int threads) {
    settings.threads = threads;
    return render_shape_gradient(scene, scene.cameras[0], 0, normals, settings,
                                 [](const Film& film) { return film.mean; });
  };
  const ShapeGradient one = gradient(1), other = gradient(3);
  EXPECT_EQ(0, std::memcmp(one.vertices.data(), other.vertices.data(),
                           one.vertices.size() * sizeof(Vec3d)));
}

TEST(ShapeGradient, RefusesASharedMesh) {
  SceneBuilder builder;
  const int material = builder.add_material(matte("Body", 0.5));
  place(builder, box_mesh(1, 1, 1), material);
  Instance again = builder.instances[0];
  again.name = "Again";
  builder.add_object(again);
  const Scene scene = builder.build();
  EXPECT_THROW(movable_object(scene, "Again"), InvalidArgument);
  EXPECT_THROW(movable_object(scene, "Nobody"), UnknownName);
}

/// Normals of a ball's vertices turn with them as the differences say.
TEST(VertexNormals, SpreadAgreesWithDifferences) {
  const Mesh mesh = body_mesh(Body::kBumpy);
  const VertexNormals normals(mesh);
  EXPECT_EQ(normals.count(), static_cast<int>(mesh.positions.size()));
  const auto weighted = [&](const std::vector<Vec3f>& positions) {
    const std::vector<Vec3f> corners = normals.corner_normals(positions);
    double sum = 0;
    std::vector<char> counted(static_cast<std::size_t>(normals.count()));
    for (std::size_t corner = 0; corner < corners.size(); ++corner) {
      const int n = normals.normal(static_cast<int>(corner / 3), static_cast<int>(corner % 3));
      if (!std::exchange(counted[static_cast<std::size_t>(n)], 1))
        sum += dot(Vec3d(corners[corner]), Vec3d{std::sin(1.0 * n), std::cos(2.0 * n), 0.5});
    }
    return sum;
  };
  std::vector<Vec3d> by_normal, by_position(mesh.positions.size());
  for (int n = 0; n < normals.count(); ++n)
    by_normal.push_back({std::sin(1.0 * n), std::cos(2.0 * n), 0.5});
  normals.spread(mesh.positions, by_normal, by_position);
  for (const std::size_t v : {0u, 7u, 40u, 90u}) {
    std::vector<Vec3f> up = mesh.positions, down = mesh.positions;
    up[v].x += 0.01f, down[v].x -= 0.01f;
    const double difference = (weighted(up) - weighted(down)) / 0.02;
    EXPECT_NEAR(by_position[v].x, difference, 0.02 * std::abs(difference) + 0.01);
  }
}

}  // namespace
}  // namespace selenite
