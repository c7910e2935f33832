// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "math/error.h"
#include "math/statistics.h"
#include "render/driver/render.h"
#include "render/lanes/lanes.h"
#include "render/media_scenes.h"

namespace selenite {
namespace {

constexpr double kStrength = 1.3;

std::shared_ptr<const EnvironmentMap> even(const Colorf& color) {
  return std::make_shared<EnvironmentMap>(1, 1, std::vector<Colorf>{color});
}

/// A body in the middle of the picture, under a grey world.
Scene under(const Material& body, const std::vector<Backdrop>& backdrops, bool image = false) {
  SceneBuilder builder;
  place(builder, sphere_mesh(1, 12), builder.add_material(body));
  add_view(builder, {0, -4, 1}, {0, 0, 0}, 40);
  World world;
  world.values.color = {0.9, 0.8, 0.7};
  world.values.strength = kStrength;
  if (image) {
    std::vector<Colorf> pixels;
    for (int i = 0; i < 8 * 4; ++i) pixels.emplace_back(0.1f + (i % 5), 0.3f, 0.2f * (i % 3));
    world.map = std::make_shared<EnvironmentMap>(8, 4, pixels);
  }
  world.backdrops = backdrops;
  builder.appearance.world = world;
  return builder.build();
}

Backdrop seen_by(RayKinds kinds, const Colorf& color, bool scaled = false) {
  Backdrop one;
  one.seen_by = kinds;
  one.map = even(color);
  one.scaled = scaled;
  return one;
}

RenderSettings settings_of(std::uint64_t seed) {
  RenderSettings settings;
  settings.width = settings.height = 8;
  settings.spp = 64;
  settings.seed = seed;
  return settings;
}

Picture picture_of(const Scene& scene) {
  return render(scene, scene.cameras[0], {}, settings_of(3)).mean;
}

constexpr std::size_t kCorner = 0, kMiddle = 4 * 8 + 4;

TEST(Backdrop, TheCameraSeesItAndItLightsNothing) {
  const Material body = matte("Body", 0.5);
  const Picture plain = picture_of(under(body, {}));
  const Picture other = picture_of(under(body, {seen_by(kCameraRay, {5, 6, 7})}));
  EXPECT_EQ(other[kMiddle].r, plain[kMiddle].r);
  EXPECT_NEAR(other[kCorner].r, 5, 1e-5);
  EXPECT_NEAR(other[kCorner].b, 7, 1e-5);
  EXPECT_NEAR(plain[kCorner].r, 0.9 * kStrength, 1e-5);
}

TEST(Backdrop, ColourAndStrengthScaleOneOfTheSameShader) {
  const Picture scaled =
      picture_of(under(matte("Body", 0.5), {seen_by(kCameraRay, Colorf(5), true)}));
  EXPECT_NEAR(scaled[kCorner].g, 5 * 0.8 * kStrength, 1e-4);
}

TEST(Backdrop, ReflectedRaysOfItsKindSeeIt) {
  const Material body = mirror("Body", 1.0, 0.0);
  const RayKinds glossy = kGlossyRay;
  const Picture seen = picture_of(under(body, {seen_by(glossy, {4, 4, 4})}));
  const Picture white = picture_of(under(body, {}));
  EXPECT_NEAR(seen[kMiddle].r / white[kMiddle].r, 4 / (0.9 * kStrength), 1e-4);
  EXPECT_NEAR(seen[kCorner].r, 0.9 * kStrength, 1e-5);
  // A path through glass is of two kinds, and so is its backdrop.
  const Picture through = picture_of(
      under(glass("Body", 1.0001, 0.0), {seen_by(kTransmissionRay | kGlossyRay, Colorf(4))}));
  EXPECT_NEAR(through[kMiddle].r, 4, 0.05);
}

TEST(Backdrop, OfScatteredRaysKeepsLanesAway) {
  const Material body = matte("Body", 0.5);
  if (!has_lanes()) GTEST_SKIP() << "no AVX2";
  EXPECT_EQ(lanes_obstacle(under(body, {seen_by(kCameraRay, Colorf(2))})), "");
  EXPECT_NE(lanes_obstacle(under(body, {seen_by(kGlossyRay, Colorf(2))})), "");
}

struct Case {
  const char* name;
  bool scaled, image;
  int lanes = 1;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }
class Fitted : public testing::TestWithParam<Case> {};

/// The strength of the world is that of what lights, and of the backdrop of the same shader only.
TEST_P(Fitted, DerivativeByStrengthIsThatOfThePicture) {
  const auto [name, scaled, image, lanes] = GetParam();
  if (lanes > 1 && !has_lanes()) GTEST_SKIP() << "no AVX2";
  const Scene scene = under(matte("Body", 0.5), {seen_by(kCameraRay, {2, 3, 4}, scaled)}, image);
  const ParameterRef strength = scene.find(kWorldName, "strength");
  const SlotLayout layout(scene, {strength});
  const auto slot = static_cast<std::size_t>(layout.rows[0].slot);
  constexpr double kStep = 0.1;
  RenderSettings settings = settings_of(5);
  settings.lanes = lanes;
  const Camera& camera = scene.cameras[0];
  const auto at = [&](double value) {
    return render(scene.with({{strength, {value}}}), camera, {}, settings).mean;
  };
  const Picture carried = render(scene, camera, layout, settings).slots[slot].mean;
  const Picture up = at(kStrength + kStep), down = at(kStrength - kStep);
  // The picture is linear in the strength, and the paths are the same.
  for (const std::size_t pixel : {kCorner, kMiddle})
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(carried[pixel][c], (up[pixel][c] - down[pixel][c]) / (2 * kStep),
                  1e-3 * (1 + std::abs(carried[pixel][c])))
          << pixel << c;
  EXPECT_EQ(carried[kCorner].r > 0, scaled);
  EXPECT_GT(carried[kMiddle].r, 0.1);
}

INSTANTIATE_TEST_SUITE_P(Backdrop, Fitted,
                         testing::Values(Case{"Alone", false, false}, Case{"Scaled", true, false},
                                         Case{"AloneUnderAnImage", false, true},
                                         Case{"ScaledUnderAnImage", true, true},
                                         Case{"EightAlone", false, true, 8},
                                         Case{"EightScaled", true, true, 8}),
                         [](const auto& info) { return info.param.name; });

TEST(Backdrop, WithoutAnImageIsRefused) {
  EXPECT_THROW(under(matte("Body", 0.5), {Backdrop{}}), InvalidArgument);
}

}  // namespace
}  // namespace selenite
