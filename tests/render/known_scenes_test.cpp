// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "render/picture_statistics.h"
#include "scene/small_scenes.h"

// Scenes whose picture and derivatives can be worked out on paper.
namespace selenite {
namespace {

Light sun_at(const Vec3d& from, double strength) {
  Light sun;
  sun.name = "Sun";
  sun.kind = LightKind::kSun;
  sun.values.power = strength;
  sun.to_world = looking_at(from, {0, 0, 0});
  return sun;
}
Light point_at(const Vec3d& from, double power) {
  Light lamp;
  lamp.name = "Lamp";
  lamp.values.power = power;
  lamp.to_world = translation(from);
  return lamp;
}

/// A plane z = 0 seen from above in a narrow view of its origin.
SceneBuilder plane(const Material& material, double half = 5) {
  SceneBuilder builder;
  place(builder, quad_mesh(half), builder.add_material(material));
  add_view(builder, {0, -3, 3}, {0, 0, 0}, 1e5);
  return builder;
}

/// Every pixel of a picture without noise.
void expect_everywhere(const Picture& picture, double value, double relative) {
  for (const Colorf& pixel : picture) ASSERT_NEAR(pixel.g, value, relative * std::abs(value));
}

class Albedo : public testing::TestWithParam<double> {};

TEST_P(Albedo, SunOnAMatteFloor) {
  // L = rho / pi E cos; derivatives L / rho and L / E. The black floor too.
  const double rho = GetParam(), e = 3, cosine = 0.8;
  SceneBuilder builder = plane(matte("Floor", rho));
  builder.add_light(sun_at({0.6, 0, 0.8}, e));
  const Scene scene = builder.build();
  const Film film = render_view(scene, settings_of(4, 2),
                                ticked(scene, {{"Floor", "base_color"}, {"Sun", "power"}}));
  ASSERT_TRUE(complete(film));
  expect_everywhere(film.mean, rho / kPi<double> * e * cosine, 1e-5);
  expect_everywhere(film.slots[0].mean, e * cosine / kPi<double>, 1e-5);
  expect_everywhere(film.slots[1].mean, rho / kPi<double> * cosine, 1e-5);
}

TEST_P(Albedo, PointLampOverAMatteFloor) {
  // L = rho / pi P / (4 pi d^2) cos.
  const double rho = GetParam(), power = 50, d2 = 1.2 * 1.2 + 1.6 * 1.6;
  SceneBuilder builder = plane(matte("Floor", rho));
  builder.add_light(point_at({1.2, 0, 1.6}, power));
  const Scene scene = builder.build();
  const Film film = render_view(scene, settings_of(4, 2),
                                ticked(scene, {{"Floor", "base_color"}, {"Lamp", "color"}}));
  const double light = power / (4 * kPi<double> * d2) * 0.8 / kPi<double>;
  expect_everywhere(film.mean, rho * light, 3e-3);  // the view is small, not a point
  expect_everywhere(film.slots[0].mean, light, 3e-3);
  expect_everywhere(film.slots[1].mean, rho * light, 3e-3);
}

TEST_P(Albedo, SkyOnAMatteFloor) {
  const double rho = GetParam();
  SceneBuilder builder = plane(matte("Floor", rho));
  set_sky(builder, 0.7);
  const Scene scene = builder.build();
  const Film film = render_view(
      scene, settings_of(4, 2),
      ticked(scene, {{"Floor", "base_color"}, {"World", "strength"}, {"World", "color"}}));
  expect_everywhere(film.mean, rho * 0.7, 1e-5);
  expect_everywhere(film.slots[0].mean, 0.7, 1e-5);
  expect_everywhere(film.slots[1].mean, rho, 1e-5);
  expect_everywhere(film.slots[2].mean, rho * 0.7, 1e-5);
}
INSTANTIATE_TEST_SUITE_P(Values, Albedo, testing::Values(0.0, 0.3, 1.0));

TEST(KnownScene, TheFloorIsLitOnTheSideOfTheViewerOnly) {
  SceneBuilder builder = plane(matte("Floor", 0.5));
  builder.add_light(sun_at({0, 0, -1}, 3));
  expect_everywhere(render_view(builder.build(), settings_of(4, 2)).mean, 0, 0);
}

TEST(KnownScene, AnEmitterIsSeenAsBrightAsItIs) {
  SceneBuilder builder = plane(emitter("Panel", 7));
  const Scene scene = builder.build();
  const Film film =
      render_view(scene, settings_of(4, 2, 1, 1),
                  ticked(scene, {{"Panel", "emission_strength"}, {"Panel", "emission_color"}}));
  expect_everywhere(film.mean, 7, 1e-6);
  expect_everywhere(film.slots[0].mean, 1, 1e-6);
  expect_everywhere(film.slots[1].mean, 7, 1e-6);
}

TEST(KnownScene, LampsAreNotSeenByTheCameraButByMirrors) {
  // A 2 x 2 panel of radiance P / (pi A), reflected by a mirror of reflectance 0.5 everywhere.
  Light panel;
  panel.name = "Panel";
  panel.kind = LightKind::kArea;
  panel.size_x = panel.size_y = 2;
  panel.values.power = 12;
  panel.to_world = looking_at({0, 3, 3}, {0, 0, 0});
  SceneBuilder builder = plane(mirror("Mirror", 0.5, 0));
  builder.add_light(panel);
  const double radiance = 12 / (kPi<double> * 4);
  const double schlick = 0.5 + 0.5 * std::pow(1 - std::sqrt(0.5), 5);
  expect_everywhere(render_view(builder.build(), settings_of(4, 2)).mean, schlick * radiance, 1e-3);

  SceneBuilder direct = plane(matte("Floor", 0.5));
  add_view(direct, {0, 0, 0.5}, {0, 3, 3});
  direct.add_light(panel);
  const Scene scene = direct.build();
  expect_everywhere(render(scene, scene.cameras[1], {}, settings_of(4, 2)).mean, 0, 0);
}

TEST(KnownScene, TwoFacingMirrorsMultiply) {
  // At 45 degrees from the lower mirror to the upper, to the lower again and out to the sky.
  SceneBuilder builder;
  const int lower = builder.add_material(mirror("Lower", 0.5, 0));
  const int upper = builder.add_material(mirror("Upper", 0.8, 0));
  place(builder, quad_mesh(1.5), lower, translation({0, 1, 0}));  // hit at y = 0 and 2
  place(builder, quad_mesh(0.5), upper, translation({0, 1, 1}));  // hit at y = 1
  add_view(builder, {0, -2, 2}, {0, 0, 0}, 1e5);
  set_sky(builder, 1);
  const Scene scene = builder.build();
  const Film film = render_view(scene, settings_of(4, 4),
                                ticked(scene, {{"Lower", "base_color"}, {"Upper", "base_color"}}));
  const double s = std::pow(1 - std::sqrt(0.5), 5), low = 0.5 + 0.5 * s, high = 0.8 + 0.2 * s;
  expect_everywhere(film.mean, low * low * high, 1e-3);
  expect_everywhere(film.slots[0].mean, 2 * (1 - s) * low * high, 1e-3);
  expect_everywhere(film.slots[1].mean, low * low * (1 - s), 1e-3);
}

class Alpha : public testing::TestWithParam<double> {};

TEST_P(Alpha, SheetShowsWhatIsBehindIt) {
  // A black sheet before an emitter: (1 - a) L, derivative -L, at both ends of the range too.
  const double a = GetParam();
  SceneBuilder builder = plane(emitter("Panel", 2));
  Material sheet = matte("Sheet", 0);
  sheet.values.alpha = a;
  place(builder, quad_mesh(5), builder.add_material(sheet), translation({0, 0, 1}));
  const Scene scene = builder.build();
  const Film film = render_view(scene, settings_of(8, 400), ticked(scene, {{"Sheet", "alpha"}}));
  const Estimate light = mean_of(film), slope = slope_of(film, 0);
  EXPECT_NEAR(light.mean, 2 * (1 - a), std::max(4 * light.error, 1e-5));
  EXPECT_NEAR(slope.mean, -2, std::max(4 * slope.error, 1e-5));
  EXPECT_LT(light.error, 0.02);
  EXPECT_LT(slope.error, 0.05);
}

TEST_P(Alpha, SheetsThrowPartOfAShadow) {
  // Two sheets between a sun and the floor, out of the camera's sight: (1 - a)^2, exactly.
  const double a = GetParam();
  SceneBuilder builder = plane(matte("Floor", 0.5));
  Material sheet = matte("Sheet", 0);
  sheet.values.alpha = a;
  const int material = builder.add_material(sheet);
  place(builder, quad_mesh(0.5), material, translation({0, 2, 2}));
  place(builder, quad_mesh(0.5), material, translation({0, 2.2, 2.2}));
  builder.add_light(sun_at({0, 1, 1}, 4));
  const Scene scene = builder.build();
  const Film film =
      render_view(scene, settings_of(4, 4, 1, 1), ticked(scene, {{"Sheet", "alpha"}}));
  const double light = 4 * std::sqrt(0.5) * 0.5 / kPi<double>;
  expect_everywhere(film.mean, light * square(1 - a), 1e-4);
  expect_everywhere(film.slots[0].mean, -2 * light * (1 - a), 1e-4);
}
INSTANTIATE_TEST_SUITE_P(Values, Alpha, testing::Values(0.0, 0.25, 0.5, 1.0));

TEST(KnownScene, GlassThrowsAFullShadowOfADeltaLamp) {
  // No light connection goes through a refraction, whatever the IOR: as in Cycles.
  for (const double ior : {1.0, 1.5}) {
    SceneBuilder builder = plane(matte("Floor", 0.5));
    place(builder, quad_mesh(0.5), builder.add_material(glass("Glass", ior)),
          translation({0, 2, 2}));
    builder.add_light(sun_at({0, 1, 1}, 4));
    // Depth 1: sunlight from the floor beside the shadow comes back from the pane.
    expect_everywhere(render_view(builder.build(), settings_of(4, 16, 1, 1)).mean, 0, 0);
  }
}

class ClearSheet : public testing::TestWithParam<double> {};

TEST_P(ClearSheet, OfIorOneLetsItsBaseColourThroughOnePerPass) {
  // Transmission 1, IOR 1: straight through a closed slab with sqrt(base) at each face.
  SceneBuilder builder = plane(emitter("Panel", 2));
  Material m = glass("Slab", 1, GetParam());
  m.values.base_color = {0.25, 0.36, 0.49};
  // Cycles' evaluation would add light to the rough ones, whose amount depends on the sampling.
  m.flavour.evaluate_unphysical_refraction = false;
  place(builder, box_mesh(3, 3, 0.1), builder.add_material(m), translation({0, 0, 1}));
  const Scene scene = builder.build();
  const Film film = render_view(scene, settings_of(4, 8), ticked(scene, {{"Slab", "base_color"}}));
  for (std::size_t i = 0; i < film.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      ASSERT_NEAR(film.mean[i][c], 2 * m.values.base_color[c], 1e-4);
      ASSERT_NEAR(film.slots[0].mean[i][c], 2, 0.3);  // the lobe's choice of sides is floored
    }
  EXPECT_NEAR(slope_of(film, 0).mean, 2, 0.02);
}
INSTANTIATE_TEST_SUITE_P(Roughness, ClearSheet, testing::Values(0.0, 0.3, 1.0));

TEST(KnownScene, AGlassPaneReflectsAndTransmitsByFresnelsLaw) {
  // Normal incidence on one face of IOR 1.5 before an emitter, sky black: 1 - 0.04.
  SceneBuilder builder;
  place(builder, quad_mesh(5), builder.add_material(emitter("Panel", 1)));
  place(builder, quad_mesh(5), builder.add_material(glass("Glass", 1.5)), translation({0, 0, 1}));
  add_view(builder, {0, 0, 4}, {0, 0, 0}, 1e5);
  const Scene scene = builder.build();
  // Depth 1 ends the light that would come back between pane and panel, which is black anyway.
  const Film film =
      render_view(scene, settings_of(8, 1000, 2, 1), ticked(scene, {{"Glass", "ior"}}));
  const Estimate light = mean_of(film), slope = slope_of(film, 0);
  EXPECT_NEAR(light.mean, 0.96, 4 * light.error + 1e-5);
  EXPECT_LT(light.error, 0.002);
  // d/dn of 1 - ((n - 1) / (n + 1))^2 = -4 (n - 1) / (n + 1)^3
  EXPECT_NEAR(slope.mean, -4 * 0.5 / std::pow(2.5, 3), 4 * slope.error + 1e-5);
  EXPECT_LT(slope.error, 0.002);
}

TEST(KnownScene, CameraDoesNotSeeWhatIsHiddenFromItButItsShadow) {
  SceneBuilder builder = plane(matte("Floor", 0.5));
  const int sheet =
      place(builder, quad_mesh(6), builder.add_material(matte("Sheet", 0)), translation({0, 0, 1}));
  builder.instances[sheet].visible_to = kAllRays & ~kCameraRay;
  set_sky(builder, 1);
  const Film film = render_view(builder.build(), settings_of(8, 400));
  const Estimate light = mean_of(film);
  EXPECT_GT(light.mean, 0);
  EXPECT_LT(light.mean, 0.05);  // the sky reaches the floor through the gap at the sides alone
}

}  // namespace
}  // namespace selenite
