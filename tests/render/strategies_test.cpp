// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "model/bsdf.h"
#include "render/picture_statistics.h"
#include "scene/small_scenes.h"

// Light sampling and bsdf sampling meet in one estimate: the mean must not depend on which of the
// two finds the light, nor on what kind of thing the light is.
namespace selenite {
namespace {

constexpr double kPower = 40, kHalf = 0.7, kHeight = 1.5, kOffset = 0.9;

Light panel() {
  Light light;
  light.name = "Panel";
  light.kind = LightKind::kArea;
  light.size_x = light.size_y = 2 * kHalf;
  light.values.power = kPower;
  light.to_world = matrix({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, kOffset, kHeight});  // looks down
  return light;
}

/// Floor at the origin, seen at 45 degrees from -y.
SceneBuilder floor_of(const Material& material) {
  SceneBuilder builder;
  place(builder, quad_mesh(3), builder.add_material(material));
  add_view(builder, {0, -3, 3}, {0, 0, 0}, 1e5);
  return builder;
}

/// Radiance towards the viewer: integral of bsdf times light over the panel, midpoint rule.
double quadrature(const Material& material) {
  const Vec3d wi = normalize(Vec3d{0, -1, 1});
  const SurfacePoint<double> point{{0, 0, 1}, {0, 0, 1}, wi, false};
  const PrincipledBsdf<double> bsdf(material.values, material.flavour, point);
  const double radiance = kPower / (kPi<double> * square(2 * kHalf));
  constexpr int kSteps = 600;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i)
    for (int j = 0; j < kSteps; ++j) {
      const Vec3d d{kHalf * (2 * (i + 0.5) / kSteps - 1),
                    kOffset + kHalf * (2 * (j + 0.5) / kSteps - 1), kHeight};
      const double distance2 = dot(d, d);
      const Vec3d wo = d / std::sqrt(distance2);
      sum += bsdf.value(wo).r * radiance * wo.z / distance2;
    }
  return sum * square(2 * kHalf / kSteps);
}

class MetalFloor : public testing::TestWithParam<double> {};

TEST_P(MetalFloor, UnderAPanelMatchesQuadrature) {
  // Smooth: the bsdf finds the panel. Rough: light sampling does.
  const Material metal = mirror("Metal", 0.7, GetParam());
  SceneBuilder builder = floor_of(metal);
  builder.add_light(panel());
  const Film film = render_view(builder.build(), settings_of(8, 2000, 5));
  ASSERT_TRUE(complete(film));
  const double truth = quadrature(metal);
  const Estimate light = mean_of(film);
  EXPECT_NEAR(light.mean, truth, 4 * light.error + 1e-3 * truth);
  EXPECT_LT(light.error, 0.01 * truth);
}

TEST_P(MetalFloor, CannotTellALampFromAnEmissiveMesh) {
  const Material metal = mirror("Metal", 0.7, GetParam());
  SceneBuilder builder = floor_of(metal);
  // Camera-visible but out of the narrow view; black from behind by facing away from the sky.
  place(builder, quad_mesh(kHalf),
        builder.add_material(emitter("Panel", kPower / (kPi<double> * square(2 * kHalf)))),
        translation({0, kOffset, kHeight}));
  const Film film = render_view(builder.build(), settings_of(8, 2000, 6));
  ASSERT_TRUE(complete(film));
  const double truth = quadrature(metal);
  const Estimate light = mean_of(film);
  EXPECT_NEAR(light.mean, truth, 4 * light.error + 1e-3 * truth);
}
INSTANTIATE_TEST_SUITE_P(Roughness, MetalFloor, testing::Values(0.05, 0.1, 0.2, 0.4, 0.7, 1.0));

TEST(Strategies, AMirrorSeesThePanelItself) {
  // Roughness 0: only the bsdf can find it.
  SceneBuilder builder = floor_of(mirror("Metal", 0.7, 0));
  Light light = panel();
  light.to_world.m[1][3] = kHeight;  // where the mirror direction goes
  builder.add_light(light);
  const double schlick = 0.7 + 0.3 * std::pow(1 - std::sqrt(0.5), 5);
  EXPECT_NEAR(mean_of(render_view(builder.build(), settings_of(8, 4))).mean,
              schlick * kPower / (kPi<double> * square(2 * kHalf)), 1e-3);
}

TEST(Strategies, ManyLampsAddUp) {
  // Four lamps of every strength: the mean is the sum of their single pictures.
  const Material plastic = selenite::plastic("Floor");
  std::vector<Light> lights(4, panel());
  lights[1].kind = LightKind::kPoint;
  lights[1].radius = 0.2;
  lights[1].values.power = 0.5;
  lights[2].kind = LightKind::kSun;
  lights[2].angle = 0.3;
  lights[2].values.power = 0.01;
  lights[3].kind = LightKind::kSpot;
  lights[3].values.power = 300;
  double sum = 0, error2 = 0;
  SceneBuilder all = floor_of(plastic);
  for (std::size_t i = 0; i < lights.size(); ++i) {
    lights[i].name = "Lamp " + std::to_string(i);
    lights[i].to_world = looking_at({0.3 * i, 0.9 - 0.2 * i, 1.5 + 0.3 * i}, {0, 0, 0});
    SceneBuilder one = floor_of(plastic);
    one.add_light(lights[i]);
    all.add_light(lights[i]);
    const Estimate light = mean_of(render_view(one.build(), settings_of(8, 500, 7 + i)));
    sum += light.mean;
    error2 += light.error * light.error;
  }
  const Estimate together = mean_of(render_view(all.build(), settings_of(8, 4000, 20)));
  EXPECT_LT(std::abs(together.z(Estimate{sum, std::sqrt(error2)})), 4);
  EXPECT_LT(together.error, 0.01 * sum);
}

TEST(Strategies, ASkyImageGivesWhatAConstantSkyGives) {
  // Sampled as a light and not: a map of one colour against the constant.
  for (const double roughness : {0.1, 0.6}) {
    SceneBuilder constant = floor_of(mirror("Metal", 0.7, roughness));
    set_sky(constant, 0.8);
    SceneBuilder map = floor_of(mirror("Metal", 0.7, roughness));
    set_sky(map, 0.8);
    map.appearance.world.map =
        std::make_shared<EnvironmentMap>(8, 4, std::vector<Colorf>(32, Colorf(1)));
    const Estimate a = mean_of(render_view(constant.build(), settings_of(8, 1000, 1)));
    const Estimate b = mean_of(render_view(map.build(), settings_of(8, 1000, 2)));
    EXPECT_LT(std::abs(a.mean - b.mean), 4 * std::hypot(a.error, b.error) + 1e-5);
    EXPECT_LT(b.error, 0.005 * a.mean);
  }
}

TEST(Strategies, ASmallBrightSkyPatchIsFoundByLightSampling) {
  // One pixel of a 64 x 32 map: E = integral of the bilinear patch times the cosine.
  std::vector<Colorf> pixels(64 * 32);
  pixels[3 * 64 + 20] = Colorf(1000);
  const auto map = std::make_shared<EnvironmentMap>(64, 32, pixels);
  double irradiance = 0;
  constexpr int kSteps = 2000;
  for (int i = 0; i < kSteps; ++i)
    for (int j = 0; j < kSteps; ++j) {
      const double theta = kPi<double> / 2 * (i + 0.5) / kSteps;
      const double phi = 2 * kPi<double> * (j + 0.5) / kSteps;
      const Vec3d d{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                    std::cos(theta)};
      irradiance += map->radiance(Vec3f(d)).r * d.z * std::sin(theta);
    }
  irradiance *= kPi<double> / 2 * 2 * kPi<double> / (double(kSteps) * kSteps);
  SceneBuilder builder = floor_of(matte("Floor", 0.5));
  set_sky(builder, 1);
  builder.appearance.world.map = map;
  const Scene scene = builder.build();
  const Film film =
      render_view(scene, settings_of(8, 300, 3), ticked(scene, {{"World", "strength"}}));
  const double truth = irradiance * 0.5 / kPi<double>;
  EXPECT_NEAR(mean_of(film).mean, truth, 4 * mean_of(film).error + 1e-3 * truth);
  EXPECT_LT(mean_of(film).error, 0.01 * truth);  // bsdf sampling alone: 0.1
  EXPECT_NEAR(slope_of(film, 0).mean, mean_of(film).mean, 1e-4 * truth);
}

}  // namespace
}  // namespace selenite
