// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "render/picture_statistics.h"
#include "scene/small_scenes.h"

// Closed boxes and skies of one colour: every ray sees the same radiance, which is known on paper.
namespace selenite {
namespace {

constexpr double kEmission = 0.5;

/// Camera inside a closed emitting box of albedo rho.
Scene furnace(double rho, bool inside_out = false) {
  SceneBuilder builder;
  Material wall = matte("Wall", rho);
  wall.values.emission_strength = kEmission;
  Mesh box = box_mesh(1, 1.5, 0.7);
  if (inside_out)
    for (std::size_t i = 0; i < box.triangles.size(); ++i) {
      std::swap(box.triangles[i][1], box.triangles[i][2]);
      for (int k = 0; k < 3; ++k) box.corner_normals[3 * i + k] = -box.corner_normals[3 * i + k];
    }
  place(builder, box, builder.add_material(wall));
  add_view(builder, {0.3, -0.4, 0.1}, {-1, 1, -0.3}, 15);
  return builder.build();
}

/// A white object that fills the view under a sky of radiance 1.
Scene white_object(const Material& material, const Mesh& mesh, double lens = 85) {
  SceneBuilder builder;
  place(builder, mesh, builder.add_material(material));
  add_view(builder, {0, -4, 1}, {0, 0, 0}, lens);
  set_sky(builder, 1);
  return builder.build();
}

class Furnace : public testing::TestWithParam<double> {};

TEST_P(Furnace, LightAndItsDerivativesMatchTheClosedForm) {
  const double rho = GetParam();
  const Scene scene = furnace(rho);
  const SlotLayout layout = ticked(scene, {{"Wall", "base_color"}, {"Wall", "emission_strength"}});
  const Film film = render_view(scene, settings_of(8, 3000), layout);
  ASSERT_TRUE(complete(film));
  for (int c = 0; c < 3; ++c) {
    const Estimate light = mean_of(film, c), slope = slope_of(film, 0, c),
                   strength = slope_of(film, 1, c);
    EXPECT_NEAR(light.mean, kEmission / (1 - rho), 0.01 * kEmission / (1 - rho));
    EXPECT_NEAR(slope.mean, kEmission / square(1 - rho), 0.01 * kEmission / square(1 - rho));
    EXPECT_NEAR(strength.mean, 1 / (1 - rho), 0.01 / (1 - rho));
    // All channels see the same numbers here, so this is one judgement of three: 1 in 5000.
    EXPECT_LT(std::abs(light.z(kEmission / (1 - rho))), 4);
    EXPECT_LT(std::abs(slope.z(kEmission / square(1 - rho))), 4);
    EXPECT_LT(std::abs(strength.z(1 / (1 - rho))), 4);
  }
}
INSTANTIATE_TEST_SUITE_P(Albedos, Furnace, testing::Values(0.2, 0.5, 0.8));

TEST(FurnaceEnds, BlackWallsKeepTheirDerivative) {
  const Scene scene = furnace(0);
  const Film film =
      render_view(scene, settings_of(8, 500), ticked(scene, {{"Wall", "base_color"}}));
  const Estimate slope = slope_of(film, 0);
  EXPECT_NEAR(mean_of(film).mean, kEmission, 1e-6);
  EXPECT_LT(std::abs(slope.z(kEmission)), 4);
  EXPECT_LT(slope.error, 0.01 * kEmission);
}

TEST(FurnaceEnds, BothSidesOfAWallReflectAlike) {
  const Film outside = render_view(furnace(0.5), settings_of(8, 500));
  const Film inside = render_view(furnace(0.5, true), settings_of(8, 500));
  EXPECT_LT(std::abs(mean_of(outside).z(kEmission / 0.5)), 4);
  EXPECT_LT(std::abs(mean_of(inside).z(kEmission / 0.5)), 4);
}

class Depth : public testing::TestWithParam<int> {};

TEST_P(Depth, EndsTheSeriesOfBounces) {
  const int depth = GetParam();
  const double rho = 0.7;
  const Scene scene = furnace(rho);
  const Film film =
      render_view(scene, settings_of(8, 1000, 3, depth), ticked(scene, {{"Wall", "base_color"}}));
  double light = 0, slope = 0;
  for (int n = 0; n <= depth; ++n) {
    light += kEmission * std::pow(rho, n);
    slope += n > 0 ? kEmission * n * std::pow(rho, n - 1) : 0;
  }
  EXPECT_LT(std::abs(mean_of(film).z(light)), 4);
  EXPECT_LT(std::abs(slope_of(film, 0).z(slope)), 4);
  EXPECT_LT(mean_of(film).error, 0.005 * light);
  EXPECT_LT(slope_of(film, 0).error, 0.01 * slope);
}
INSTANTIATE_TEST_SUITE_P(Bounces, Depth, testing::Values(1, 2, 3, 4, 5, 8));

class WhiteGlass : public testing::TestWithParam<std::tuple<double, double>> {};

TEST_P(WhiteGlass, SmoothGlassIsInvisible) {
  // Under a uniform sky every path through smooth clear glass brings 1, whichever way it goes.
  const auto [ior, unused] = GetParam();
  for (const Mesh& mesh : {sphere_mesh(1.2, 16), sphere_mesh(1.2, 8, false), box_mesh(1, 1, 1)}) {
    const Film film = render_view(white_object(glass("Glass", ior), mesh), settings_of(16, 16));
    ASSERT_TRUE(complete(film));
    // Coarse smooth normals lose the few paths that refract to the wrong side of a facet.
    EXPECT_LE(mean_of(film).mean, 1 + 1e-4);
    EXPECT_GE(mean_of(film).mean, 0.99);
  }
  const Film flat =
      render_view(white_object(glass("Glass", ior), box_mesh(1, 1, 1)), settings_of(16, 16));
  EXPECT_NEAR(mean_of(flat).mean, 1, 1e-4);
}

TEST_P(WhiteGlass, RoughGlassGainsNoEnergy) {
  const auto [ior, roughness] = GetParam();
  for (const auto distribution : {Flavour::Distribution::kGgx, Flavour::Distribution::kMultiGgx}) {
    Material material = glass("Glass", ior, roughness);
    material.flavour.distribution = distribution;
    const Film film =
        render_view(white_object(material, sphere_mesh(1.2, 24)), settings_of(12, 64));
    EXPECT_EQ(film.dropped, 0);
    EXPECT_LE(film.truncated, 2);  // light caught by total reflection may circle for very long
    const Estimate light = mean_of(film);
    EXPECT_LE(light.mean - 4 * light.error, 1 + 1e-3);
    EXPECT_LE(light.mean, 1.02);
    EXPECT_GE(light.mean, distribution == Flavour::Distribution::kGgx ? 0.15 : 0.9);
  }
}
INSTANTIATE_TEST_SUITE_P(Glasses, WhiteGlass,
                         testing::Combine(testing::Values(1.01, 1.5, 2.5),
                                          testing::Values(0.05, 0.3, 0.6, 1.0)));

TEST(WhiteFurnace, MultiscatterGlassLosesWhatCyclesLoses) {
  // Closed white sphere of IOR 1.5, mean over its disc, in Cycles 4.5: docs/method/rendering.md.
  const std::pair<double, double> cycles[] = {
      {0.1, 1.000}, {0.3, 1.000}, {0.5, 0.989}, {0.7, 0.980}, {1.0, 0.985}};
  for (const auto& [roughness, expected] : cycles) {
    const Scene scene = white_object(glass("Glass", 1.5, roughness), sphere_mesh(1, 48), 60);
    const Film film = render_view(scene, settings_of(32, 48));
    double sum = 0;  // over the disc but its rim; its radius is 13.7 pixels here
    int count = 0;
    for (std::size_t i = 0; i < film.size(); ++i) {
      if (std::hypot(static_cast<double>(i % 32) - 15.5, static_cast<double>(i / 32) - 15.5) > 13)
        continue;
      sum += film.mean[i].r;
      ++count;
    }
    EXPECT_NEAR(sum / count, expected, 0.01) << "roughness " << roughness;
  }
}

class WhiteMetal : public testing::TestWithParam<double> {};

TEST_P(WhiteMetal, MultiscatterReflectsEverything) {
  const Material metal = mirror("Metal", 1, GetParam());
  // A convex object: what it reflects upwards escapes, so the compensated lobe returns all of it.
  const Film film = render_view(white_object(metal, box_mesh(1, 1, 1)), settings_of(12, 400));
  ASSERT_TRUE(complete(film));
  EXPECT_NEAR(mean_of(film).mean, 1, 0.004);
}
INSTANTIATE_TEST_SUITE_P(Roughness, WhiteMetal, testing::Values(0.0, 0.001, 0.05, 0.3, 0.7, 1.0));

TEST(WhiteFurnace, OpaquePlasticStaysBelowOneAndAlphaLosesNothing) {
  for (const double roughness : {0.0, 0.2, 1.0}) {
    Material plastic = selenite::plastic("Plastic");
    plastic.values.base_color = Color<double>(1);
    plastic.values.roughness = roughness;
    const Estimate opaque =
        mean_of(render_view(white_object(plastic, sphere_mesh(1.2, 24)), settings_of(12, 200)));
    EXPECT_LE(opaque.mean - 4 * opaque.error, 1 + 1e-3);
    EXPECT_GE(opaque.mean, 0.97);
  }
  Material sheet = matte("Sheet", 1);
  sheet.values.alpha = 0.5;
  const Film half =
      render_view(white_object(sheet, sphere_mesh(1.2, 24, false)), settings_of(12, 40));
  EXPECT_NEAR(mean_of(half).mean, 1, 1e-5);
}

}  // namespace
}  // namespace selenite
