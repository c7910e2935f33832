// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/shape/shape_gradient.h"

#include <gtest/gtest.h>

#include <cstring>

#include "math/error.h"
#include "math/rng.h"
#include "math/statistics.h"
#include "render/driver/render.h"
#include "render/lit_plane.h"
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
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }
class Vertices : public testing::TestWithParam<Case> {};

TEST_P(Vertices, AgreeWithDifferencesOfRenders) {
  const Case& c = GetParam();
  Material material = matte("Body", 0.7);
  if (c.roughness > 0) {
    material = plastic("Body");
    material.values.roughness = c.roughness;
  }
  const Scene scene = lit_body(c.body, c.sky, material);
  const Geometry& geometry = *scene.geometry;
  const VertexNormals normals(geometry.meshes()[0]);
  const std::vector<Vec3f>& positions = geometry.meshes()[0].positions;

  RenderSettings settings;
  settings.width = settings.height = 32;
  settings.depth = c.depth;
  const std::vector<float> weights = pattern(settings);
  double all = 0;
  for (const float weight : weights) all += weight;
  const PictureLoss loss = [&](const Film&) {
    Picture slopes;
    for (const float weight : weights) slopes.emplace_back(weight / static_cast<float>(all));
    return slopes;
  };
  const auto mean = [&](const Scene& of) {
    const Film film = render(of, of.cameras[0], {}, settings);
    double sum = 0;
    for (std::size_t p = 0; p < weights.size(); ++p)
      sum += weights[p] * (film.mean[p].r + film.mean[p].g + film.mean[p].b) / all;
    return sum;
  };

  const char* const env = std::getenv("SHAPE_SCALE");
  const double scale_up = env ? std::atof(env) : 1;
  constexpr int kSeeds = 6;
  const int kVertices = 50;
  const int count = static_cast<int>(positions.size());
  std::vector<Tally> found(3 * kVertices), wanted(3 * kVertices);
  Random random(17, 0, 0);
  std::vector<int> chosen;
  for (int i = 0; i < kVertices; ++i)
    chosen.push_back(static_cast<int>(random.uniform(i) * static_cast<float>(count)));
  double seconds = 0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    settings.seed = 100 + seed;
    settings.spp = static_cast<int>(256 * scale_up);
    const ShapeGradient gradient =
        render_shape_gradient(scene, scene.cameras[0], 0, normals, settings, loss);
    seconds += gradient.film.cpu_seconds;
    settings.spp = static_cast<int>(64 * scale_up * (std::getenv("FD") ? std::atof(std::getenv("FD")) : 1));
    for (int i = 0; i < kVertices; ++i) {
      // One direction for each vertex.
      const Vec3d axis = i % 3 == 0 ? Vec3d{1, 0, 0} : i % 3 == 1 ? Vec3d{0, 1, 0} : Vec3d{0, 0, 1};
      const Vec3d& g = gradient.vertices[chosen[i]];
      found[i].add(dot(g, axis));
      const float kStep = std::getenv("STEP") ? static_cast<float>(std::atof(std::getenv("STEP"))) : 0.02f;
      double sides[2];
      for (int side = 0; side < 2; ++side) {
        std::vector<Vec3f> moved = positions;
        moved[chosen[i]] += Vec3f(axis) * (side == 0 ? -kStep : kStep);
        sides[side] = mean(with_vertices(scene, 0, normals, moved));
      }
      wanted[i].add((sides[1] - sides[0]) / (2 * kStep));
    }
  }
  double worst = 0, sum2 = 0, gap2 = 0;
  for (int i = 0; i < kVertices; ++i) {
    const Estimate a = found[i].estimate(), b = wanted[i].estimate();
    const double z = a.z(b);
    if (std::getenv("SHAPE_PRINT"))
      std::printf("%4d %d  %+.5f +- %.5f   %+.5f +- %.5f  z %+.2f\n", chosen[i], i % 3, a.mean,
                  a.error, b.mean, b.error, z);
    worst = std::max(worst, std::abs(z));
    sum2 += b.mean * b.mean;
    gap2 += (a.mean - b.mean) * (a.mean - b.mean);
  }
  std::printf("worst z %.2f, gap %.4f of the size, %.2f CPU s a gradient\n", worst,
              std::sqrt(gap2 / sum2), seconds / kSeeds);
}

INSTANTIATE_TEST_SUITE_P(Bodies, Vertices,
                         testing::Values(Case{"sphere, direct light", Body::kSphere, 0, 1, 0},
                                         Case{"bumpy, direct light", Body::kBumpy, 0, 1, 0},
                                         Case{"flat faces, direct light", Body::kFlat, 0, 1, 0},
                                         Case{"sphere under a sky", Body::kSphere, 0.5, 1, 0},
                                         Case{"bumpy plastic, all light", Body::kBumpy, 0.3, 0,
                                              0.4}));

}  // namespace
}  // namespace selenite
