// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "math/error.h"
#include "math/statistics.h"
#include "render/driver/render.h"
#include "render/media_scenes.h"

namespace selenite {
namespace {

constexpr int kWidth = 16, kHeight = 8;
constexpr double kHere = 0.6;

/// A body on a ground under a sky whose side is bright.
Scene under_sky(const Material& body, double strength = 1.5) {
  std::vector<Colorf> pixels;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const auto wave = static_cast<float>(1 + std::cos(2 * kPi<double> * x / kWidth));
      pixels.emplace_back(0.2f + wave * wave, 0.4f + 0.3f * static_cast<float>(x % 5),
                          0.1f + 0.1f * static_cast<float>(y));
    }
  SceneBuilder builder;
  place(builder, sphere_mesh(1, 12), builder.add_material(body));
  place(builder, quad_mesh(4), builder.add_material(matte("Ground", 0.3)),
        translation({0, 0, -1.1}));
  add_view(builder, {0, -4, 1}, {0, 0, 0}, 70);
  World world;
  world.values.color = {1, 0.8, 0.6};
  world.values.strength = strength;
  world.values.rotation = kHere;
  world.map = std::make_shared<EnvironmentMap>(kWidth, kHeight, pixels);
  world.to_map = {Vec3f{0, 1, 0}, Vec3f{-1, 0, 0}, Vec3f{0, 0, 1}};
  builder.appearance.world = world;
  return builder.build();
}

RenderSettings settings_of(std::uint64_t seed) {
  RenderSettings settings;
  settings.width = settings.height = 10;
  settings.spp = 256;
  settings.seed = seed;
  return settings;
}

struct Body {
  const char* name;
  Material material;
};
void PrintTo(const Body& body, std::ostream* out) { *out << body.name; }
class UnderRotatedSky : public testing::TestWithParam<Body> {};

/// Of the left and of the right half of the picture: light that comes from one side goes to the other.
TEST_P(UnderRotatedSky, DerivativeIsThatOfThePicture) {
  const Scene scene = under_sky(GetParam().material);
  const std::vector<ParameterRef> ticked{
      scene.find(kWorldName, "strength"), scene.find(kWorldName, "rotation"),
      scene.find(kWorldName, "color"), scene.find(GetParam().material.name, "base_color")};
  const SlotLayout layout(scene, ticked);
  const auto slot = static_cast<std::size_t>(layout.rows[1].slot);
  constexpr double kStep = 0.02;
  const auto at = [&](double rotation) { return scene.with({{ticked[1], {rotation}}}); };
  const Scene up = at(kHere + kStep), down = at(kHere - kStep);
  Tally carried[2][3], difference[2][3];
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    const Camera& camera = scene.cameras[0];
    const Picture slopes = render(scene, camera, layout, settings_of(seed)).slots[slot].mean;
    const Picture after = render(up, camera, {}, settings_of(seed)).mean,
                  before = render(down, camera, {}, settings_of(seed)).mean;
    for (int half = 0; half < 2; ++half)
      for (int c = 0; c < 3; ++c) {
        const auto sum = [&](const Picture& picture) {
          double all = 0;
          for (std::size_t p = 0; p < picture.size(); ++p)
            if (static_cast<int>(p % 10) / 5 == half) all += picture[p][c];
          return all;
        };
        carried[half][c].add(sum(slopes));
        difference[half][c].add((sum(after) - sum(before)) / (2 * kStep));
      }
  }
  for (int half = 0; half < 2; ++half)
    for (int c = 0; c < 3; ++c) {
      const Estimate found = carried[half][c].estimate(), want = difference[half][c].estimate();
      const double size = std::abs(want.mean);
      EXPECT_NEAR(found.mean, want.mean, 4 * std::hypot(found.error, want.error) + 0.01 * size)
          << half << c;
      // It is known well enough for that to say something.
      if (c == 0) {
        EXPECT_LT(found.error, 0.1 * size) << half;
      }
    }
}

INSTANTIATE_TEST_SUITE_P(Bodies, UnderRotatedSky,
                         testing::Values(Body{"Matte", matte("Body", 0.7)},
                                         Body{"RoughMirror", mirror("Body", 0.8, 0.4)},
                                         Body{"RoughGlass", glass("Body", 1.4, 0.4)},
                                         Body{"Medium", filled_glass(0.3, 1.3, 2, 0.8)}),
                         [](const auto& info) { return info.param.name; });

TEST(WorldRotation, IsRefusedWithoutAnImage) {
  Scene scene = under_sky(matte("Body", 0.7));
  scene.appearance.world.map = nullptr;
  EXPECT_THROW(SlotLayout(scene, {scene.find(kWorldName, "rotation")}), InvalidArgument);
}

}  // namespace
}  // namespace selenite
