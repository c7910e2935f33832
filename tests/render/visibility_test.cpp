// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "render/difference.h"
#include "render/lit_plane.h"
#include "render/picture_statistics.h"
#include "scene/small_scenes.h"

// What some rays see and others do not: pictures that can be worked out on paper.
namespace selenite {
namespace {

constexpr RayKinds without(RayKinds kinds) { return kAllRays & ~kinds; }

Colorf pixel(const SceneBuilder& builder, int spp = 4, int depth = 0, int lanes = 0) {
  RenderSettings settings = settings_of(1, spp, 1, depth);
  settings.lanes = lanes;
  const Film film = render_view(builder.build(), settings);
  EXPECT_TRUE(complete(film));
  return film.mean[0];
}
Estimate brightness(const SceneBuilder& builder, int spp) {
  const Film film = render_view(builder.build(), settings_of(8, spp));
  EXPECT_TRUE(complete(film));
  return mean_of(film);
}

/// Radiance of a matte floor under the sun alone.
constexpr double kSunlit = 0.5 * 3 * 0.8 / kPi<double>;

TEST(Lamp, WithoutDiffuseRaysLightsNoMatteFloor) {
  for (const Light& light : {sun(3), area(50, 1, {0.6, 0, 0.8})}) {
    SceneBuilder builder = plane(matte("Floor", 0.5));
    builder.add_light(light);
    EXPECT_GT(pixel(builder, 16).g, 0.1f);
    builder.appearance.lights[0].visible_to &= ~kDiffuseRay;
    EXPECT_EQ(pixel(builder, 16).g, 0);
  }
}

TEST(Lamp, KindsOfRaysShareOutItsLight) {
  // A floor with a diffuse and a glossy lobe: what either ray brings adds up to the whole, if the
  // lamp is so small that light sampling has all of it.
  for (const bool delta : {true, false}) {
    Material material = plastic("Floor");
    material.values.roughness = 0.3;
    SceneBuilder builder = plane(material);
    Light light = area(50, 0.03, {0, 2, 2});
    if (delta) light = sun(3, {0, 2, 2});
    builder.add_light(light);
    const auto seen_by = [&](RayKinds kinds) {
      builder.appearance.lights[0].visible_to = kinds;
      return brightness(builder, delta ? 2 : 2000);
    };
    const Estimate whole = seen_by(kScatteredRays), diffuse = seen_by(kDiffuseRay),
                   glossy = seen_by(kGlossyRay), none = seen_by(kTransmissionRay | kScatterRay);
    EXPECT_GT(diffuse.mean, 0.1 * whole.mean);
    EXPECT_GT(glossy.mean, 0.1 * whole.mean);
    EXPECT_EQ(none.mean, 0);
    // Beyond 4 standard errors: a false alarm in 16,000.
    const double error = std::hypot(whole.error, std::hypot(diffuse.error, glossy.error));
    EXPECT_NEAR(diffuse.mean + glossy.mean, whole.mean, 4 * error + 1e-6);
    EXPECT_LT(error, 0.01 * whole.mean);
  }
}

TEST(Lamp, WithoutVolumeScatterRaysLightsNoMedium) {
  SceneBuilder builder;
  Material fog = plastic("Fog");
  fog.values.alpha = 0;
  fog.values.extinction = Color<double>(1);
  fog.values.albedo = Color<double>(0.8);
  place(builder, box_mesh(1, 1, 1), builder.add_material(fog));
  add_view(builder, {0, -4, 0}, {0, 0, 0});
  builder.add_light(area(50, 1, {0, 0, 3}));
  EXPECT_GT(brightness(builder, 32).mean, 0.01);
  builder.appearance.lights[0].visible_to &= ~kScatterRay;
  EXPECT_EQ(brightness(builder, 32).mean, 0);
}

TEST(Lamp, IsShownToTheCameraThatSeesIt) {
  // A square of 1: radiance power / pi. By one path and by eight.
  SceneBuilder builder;
  place(builder, quad_mesh(1), builder.add_material(matte("Floor", 0.5)), translation({0, 0, -9}));
  add_view(builder, {0, -3, 0}, {0, 0, 0}, 1e5);
  Light light = area(7, 1, {0, -1, 0});
  light.to_world = looking_at({0, 0, 0}, {0, -3, 0});
  builder.add_light(light);
  for (const int lanes : {0, 1}) {
    builder.appearance.lights[0].visible_to = kScatteredRays;
    EXPECT_EQ(pixel(builder, 8, 0, lanes).r, 0);
    builder.appearance.lights[0].visible_to = kAllRays;
    EXPECT_NEAR(pixel(builder, 8, 0, lanes).r, 7 / kPi<double>, 1e-5);
    builder.cameras[0].clip_end = 2;
    EXPECT_EQ(pixel(builder, 8, 0, lanes).r, 0);
    builder.cameras[0].clip_end = 1000;
  }
  // Something in front hides it.
  place(builder, box_mesh(1, 0.1, 1), builder.add_material(matte("Lid", 0)),
        translation({0, -1, 0}));
  for (const int lanes : {0, 1}) EXPECT_EQ(pixel(builder, 8, 0, lanes).r, 0);
}

TEST(Lamp, CastsNoShadowWhereThatIsOff) {
  SceneBuilder builder = plane(matte("Floor", 0.5));
  sheet(builder).visible_to = without(kCameraRay);
  builder.add_light(sun(3));
  EXPECT_EQ(pixel(builder).g, 0);
  builder.appearance.lights[0].casts_shadows = false;
  EXPECT_NEAR(pixel(builder).g, kSunlit, 1e-5);
}

TEST(Lamp, LightsNothingBeyondItsBounces) {
  // Bounce by bounce, the same as a path that ends there.
  SceneBuilder builder;
  place(builder, sphere_mesh(2), builder.add_material(matte("Room", 0.5)));
  add_view(builder, {0, 0, 0}, {1, 1, 0});
  Light lamp;
  lamp.name = "Lamp";
  lamp.to_world = translation({0, 0, 1});
  builder.add_light(lamp);
  const double whole = brightness(builder, 32).mean;
  for (const int bounces : {0, 1, 2}) {
    builder.appearance.lights[0].max_bounces = std::numeric_limits<int>::max();
    const Film film = render_view(builder.build(), settings_of(8, 32, 1, bounces + 1));
    builder.appearance.lights[0].max_bounces = bounces;
    const double mean = brightness(builder, 32).mean;
    EXPECT_NEAR(mean, mean_of(film).mean, 1e-5 * whole);
    EXPECT_LT(mean, 0.95 * whole);
  }
}

TEST(Lamp, ThatRaysDoNotMeetIsMissingInAMirror) {
  SceneBuilder builder = plane(mirror("Floor", 1, 0));
  builder.add_light(area(50, 2, {0, 3, 3}));
  EXPECT_GT(pixel(builder).g, 1);
  builder.appearance.lights[0].met_by_rays = false;
  EXPECT_EQ(pixel(builder).g, 0);
  // Elsewhere light sampling finds all of its light.
  builder.appearance.materials[0] = matte("Floor", 0.5);
  const Estimate alone = brightness(builder, 500);
  builder.appearance.lights[0].met_by_rays = true;
  const Estimate both = brightness(builder, 500);
  EXPECT_NEAR(alone.mean, both.mean, 4 * std::hypot(alone.error, both.error));
}

TEST(Object, ThatGlossyRaysDoNotSeeIsMissingInAMirror) {
  for (const double roughness : {0.0, 0.3}) {
    SceneBuilder builder = plane(mirror("Floor", 1, roughness));
    sheet(builder).visible_to = without(kCameraRay);
    set_sky(builder, 1);
    EXPECT_LT(brightness(builder, 64).mean, 1e-3);
    builder.instances[1].visible_to = without(kCameraRay | kDiffuseRay | kShadowRay);
    EXPECT_LT(brightness(builder, 64).mean, 1e-3);
    builder.instances[1].visible_to = without(kCameraRay | kGlossyRay);
    const double mean = brightness(builder, 4000).mean;
    EXPECT_NEAR(mean, 1, roughness == 0 ? 1e-5 : 5e-3);
  }
}

TEST(Object, ThatDiffuseRaysDoNotSeeHidesNoSkyFromAMatteFloor) {
  SceneBuilder builder = plane(matte("Floor", 0.5));
  sheet(builder).visible_to = without(kCameraRay);
  set_sky(builder, 1);
  EXPECT_LT(pixel(builder).g, 1e-3f);
  builder.instances[1].visible_to = without(kCameraRay | kDiffuseRay);
  EXPECT_NEAR(pixel(builder).g, 0.5, 1e-5);
}

TEST(Object, ThatShadowRaysDoNotSeeCastsNoShadow) {
  SceneBuilder builder = plane(matte("Floor", 0.5));
  sheet(builder).visible_to = without(kCameraRay);
  builder.add_light(sun(3));
  EXPECT_EQ(pixel(builder).g, 0);
  builder.instances[1].visible_to = without(kCameraRay | kShadowRay);
  EXPECT_NEAR(pixel(builder).g, kSunlit, 1e-5);
}

TEST(Object, ThatTransmissionRaysDoNotSeeIsMissingBehindGlass) {
  // Glass of IOR 1 bends and reflects nothing: the sky is seen through both of its faces.
  SceneBuilder builder;
  place(builder, box_mesh(1, 1, 1), builder.add_material(glass("Glass", 1)));
  add_view(builder, {0, 0, 4}, {0, 0.001, 0}, 1e5);
  const int lid = builder.add_material(matte("Lid", 0));
  place(builder, quad_mesh(9), lid, translation({0, 0, -3}));
  set_sky(builder, 1);
  EXPECT_NEAR(pixel(builder).g, 0, 1e-6);
  builder.instances[1].visible_to = without(kTransmissionRay);
  EXPECT_NEAR(pixel(builder).g, 1, 1e-5);
}

TEST(Object, HeldOutIsBlackToTheCameraAlone) {
  SceneBuilder builder = plane(mirror("Floor", 1, 0));
  const int shining = builder.add_material(emitter("Shining", 2));
  const int lamp =
      place(builder, quad_mesh(9), shining, matrix({1, 0, 0}, {0, 0, 1}, {0, -1, 0}, {0, 8, 0}));
  EXPECT_NEAR(pixel(builder).g, 2, 1e-5);
  builder.instances[lamp].holdout = true;
  EXPECT_NEAR(pixel(builder).g, 2, 1e-5);  // in the mirror
  builder.instances[0].holdout = true;
  EXPECT_EQ(pixel(builder).g, 0);
}

TEST(Object, HeldOutLetsThroughWhatItIsTransparentFor) {
  Material veil = emitter("Veil", 5);
  veil.values.alpha = 0.25;
  SceneBuilder builder = plane(emitter("Floor", 2));
  const int object =
      place(builder, quad_mesh(2), builder.add_material(veil), translation({0, 0, 0.5}));
  builder.instances[object].holdout = true;
  const Estimate light = brightness(builder, 200);
  EXPECT_NEAR(light.mean, 0.75 * 2, 4 * light.error);
}

TEST(World, IsSeenByTheRaysThatSeeIt) {
  const auto seen = [](const Material& material, RayKinds kinds) {
    SceneBuilder builder = plane(material);
    set_sky(builder, 1);
    builder.appearance.world.visible_to = kinds;
    return brightness(builder, 4).mean;
  };
  EXPECT_EQ(seen(matte("Floor", 0.5), without(kDiffuseRay)), 0);
  EXPECT_NEAR(seen(matte("Floor", 0.5), kDiffuseRay), 0.5, 1e-5);
  EXPECT_EQ(seen(mirror("Floor", 1, 0), without(kGlossyRay)), 0);
  EXPECT_NEAR(seen(mirror("Floor", 1, 0), kGlossyRay), 1, 1e-5);
}

TEST(World, IsSharedOutByTheLobesThatAreDrawn) {
  Material material = plastic("Floor");
  material.values.roughness = 0.4;
  SceneBuilder builder = plane(material);
  set_sky(builder, 1);
  const auto seen_by = [&](RayKinds kinds) {
    builder.appearance.world.visible_to = kinds;
    return brightness(builder, 3000);
  };
  const Estimate whole = seen_by(kAllRays), diffuse = seen_by(kDiffuseRay),
                 glossy = seen_by(kGlossyRay);
  const double error = std::hypot(whole.error, std::hypot(diffuse.error, glossy.error));
  EXPECT_NEAR(diffuse.mean + glossy.mean, whole.mean, 4 * error);
  EXPECT_LT(error, 0.01 * whole.mean);
  EXPECT_GT(glossy.mean, 0.05 * whole.mean);
}

TEST(World, IsNotOnATransparentFilm) {
  SceneBuilder builder;
  place(builder, box_mesh(1, 1, 1), builder.add_material(glass("Glass", 1, 0.05)));
  add_view(builder, {0, 0, 4}, {0, 0.001, 0}, 1e5);
  add_view(builder, {0, 0, 4}, {9, 0, 4}, 1e5);
  set_sky(builder, 1);
  World& world = builder.appearance.world;
  const auto view = [&](int camera, int lanes) {
    RenderSettings settings = settings_of(1, 4);
    settings.lanes = lanes;
    const Scene scene = builder.build();
    return render(scene, scene.cameras[camera], {}, settings).mean[0].g;
  };
  for (const int lanes : {0, 1}) {
    world.transparent_film = false;
    EXPECT_NEAR(view(1, lanes), 1, 1e-6);
    world.transparent_film = true;
    EXPECT_EQ(view(1, lanes), 0);
    EXPECT_NEAR(view(0, lanes), 1, 1e-3);  // through glass it is
    world.transparent_film = false;
    world.visible_to = without(kCameraRay);
    EXPECT_EQ(view(1, lanes), 0);
    world.visible_to = kAllRays;
  }
  world.transparent_film = true;
  world.film_roughness = 0.1;
  EXPECT_NEAR(view(0, 0), 0, 1e-3);
  world.film_roughness = 0.01;  // too clear a limit for this glass
  EXPECT_NEAR(view(0, 0), 1, 1e-3);
}

TEST(Material, WithoutTransparentShadowsCastsFullOnes) {
  SceneBuilder builder = plane(matte("Floor", 0.5));
  sheet(builder).visible_to = without(kCameraRay);
  builder.appearance.materials[1].values.alpha = 0.5;
  builder.add_light(sun(3));
  EXPECT_NEAR(pixel(builder).g, 0.5 * kSunlit, 1e-5);
  builder.appearance.materials[1].transparent_shadows = false;
  EXPECT_EQ(pixel(builder).g, 0);
}

/// A ball with several lobes between a floor and a wall that casts no shadow, under lamps that are
/// hidden from some rays.
Scene partly_hidden() {
  SceneBuilder builder;
  Material ball = plastic("Ball");
  ball.values.base_color = {0.6, 0.4, 0.3};
  ball.values.roughness = 0.2;
  ball.values.metallic = 0.3;
  ball.values.coat_weight = 0.4;
  ball.values.coat_roughness = 0.3;
  place(builder, sphere_mesh(1, 10), builder.add_material(ball));
  const int floor = builder.add_material(matte("Floor", 0.5));
  place(builder, quad_mesh(4), floor, translation({0, 0, -1.1}));
  place(builder, quad_mesh(3), builder.add_material(matte("Wall", 0.8)),
        matrix({0, 1, 0}, {0, 0, 1}, {1, 0, 0}, {-2, 0, 0}));
  builder.instances[2].visible_to = without(kShadowRay);
  builder.add_light(area(60, 0.3, {1.5, -1, 3}));
  builder.appearance.lights[0].visible_to = kScatteredRays & ~kGlossyRay;
  Light fill = area(40, 0.3, {-1, -3, 2});
  fill.name = "Fill";
  fill.visible_to = kScatteredRays & ~kDiffuseRay;
  builder.add_light(fill);
  set_sky(builder, 0.3);
  builder.appearance.world.visible_to = without(kCameraRay);
  add_view(builder, {0, -4, 1.5}, {0, 0, 0}, 55);
  return builder.build();
}

struct Ticked {
  const char *owner, *parameter;
  double step;
  int spp = 800;
};
class HiddenFromSome : public testing::TestWithParam<Ticked> {};

TEST_P(HiddenFromSome, DerivativesAgreeWithDifferences) {
  const auto& [owner, parameter, step, spp] = GetParam();
  const Scene scene = partly_hidden();
  const ParameterRef ref = scene.find(owner, parameter);
  const SlotLayout layout(scene, {ref});
  const std::vector<double> at = scene.get(ref);
  DifferencePairs pairs;
  for (int seed = 0; seed < 12; ++seed) {
    const RenderSettings settings = settings_of(8, spp, 40 + seed, 4);
    const Film film = render_view(scene, settings, layout);
    ASSERT_TRUE(complete(film));
    const auto mean = [&](double by) {
      std::vector<double> values = at;
      values[0] += by;
      return mean_of(render_view(scene.with({{ref, values}}), settings)).mean;
    };
    pairs.add(slope_of(film, 0).mean, (mean(step) - mean(-step)) / (2 * step));
  }
  pairs.expect_agreement();
}

INSTANTIATE_TEST_SUITE_P(
    Parameters, HiddenFromSome,
    testing::Values(Ticked{"Ball", "base_color", 0.02, 100}, Ticked{"Ball", "roughness", 0.04},
                    Ticked{"Ball", "metallic", 0.02}, Ticked{"Ball", "coat_weight", 0.02},
                    Ticked{"Key", "power", 1, 200}, Ticked{"Fill", "power", 1},
                    Ticked{"World", "strength", 0.02, 100}),
    [](const auto& info) { return std::string(info.param.owner) + "_" + info.param.parameter; });

}  // namespace
}  // namespace selenite
