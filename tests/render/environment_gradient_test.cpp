// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "math/error.h"
#include "math/statistics.h"
#include "render/driver/field_gradient.h"
#include "render/media_scenes.h"

namespace selenite {
namespace {

constexpr int kWidth = 8, kHeight = 4;

/// A sky of many levels, with a bright pixel and a black one.
std::vector<Colorf> sky() {
  std::vector<Colorf> pixels;
  for (int i = 0; i < kWidth * kHeight; ++i)
    pixels.emplace_back(0.2f + 0.05f * static_cast<float>(i % 7), 0.4f,
                        0.1f + 0.1f * static_cast<float>(i % 3));
  pixels[11] = Colorf(20, 18, 15);
  pixels[3] = Colorf(0);
  return pixels;
}

/// A body over a ground, whose only light is the sky.
Scene under_sky(const Material& body, const std::vector<Colorf>& pixels, bool turned = true) {
  SceneBuilder builder;
  place(builder, sphere_mesh(1, 12), builder.add_material(body));
  place(builder, quad_mesh(4), builder.add_material(matte("Ground", 0.3)),
        translation({0, 0, -1.1}));
  add_view(builder, {0, -4, 1}, {0, 0, 0}, 70);
  World world;
  world.values.color = Color<double>(1);
  world.values.strength = 1.5;
  world.map = std::make_shared<EnvironmentMap>(kWidth, kHeight, pixels);
  if (turned) world.to_map = {Vec3f{0, 1, 0}, Vec3f{-1, 0, 0}, Vec3f{0, 0, 1}};
  builder.appearance.world = world;
  return builder.build();
}

RenderSettings settings_of(int spp) {
  RenderSettings settings;
  settings.width = settings.height = 12;
  settings.spp = spp;
  settings.seed = 7;
  return settings;
}

struct Body {
  const char* name;
  Material material;
};
void PrintTo(const Body& body, std::ostream* out) { *out << body.name; }
class UnderUnknownSky : public testing::TestWithParam<Body> {};

/// Light is linear: what a pixel shows is the sum of its derivatives times the sky, sample by sample.
TEST_P(UnderUnknownSky, DerivativesTimesTheSkyAreThePicture) {
  const std::vector<Colorf> pixels = sky();
  const Scene scene = under_sky(GetParam().material, pixels);
  const RenderSettings settings = settings_of(8);
  const std::vector<float> weights(settings.width * settings.height, 1);
  const FieldJacobian found =
      render_field_jacobian(scene, scene.cameras[0], {EnvironmentRef{}}, settings, weights, 1);
  ASSERT_EQ(found.fields[0].cols(), 3 * kWidth * kHeight);
  for (std::size_t p = 0; p < weights.size(); ++p)
    for (int c = 0; c < 3; ++c) {
      double sum = 0;
      for (std::size_t k = 0; k < pixels.size(); ++k)
        sum += static_cast<double>(found.fields[0](static_cast<Eigen::Index>(p),
                                                   static_cast<Eigen::Index>(3 * k) + c)) *
               pixels[k][c];
      EXPECT_NEAR(sum, found.film.mean[p][c], 2e-4 * found.film.mean[p][c] + 1e-6) << p;
    }
}

INSTANTIATE_TEST_SUITE_P(Bodies, UnderUnknownSky,
                         testing::Values(Body{"Matte", matte("Body", 0.7)},
                                         Body{"Mirror", mirror("Body", 0.8, 0)},
                                         Body{"RoughMirror", mirror("Body", 0.8, 0.4)},
                                         Body{"Glass", glass("Body")},
                                         Body{"RoughGlass", glass("Body", 1.4, 0.4)},
                                         Body{"Medium", filled_glass(0.3, 1.3, 2, 0.8)},
                                         Body{"Fog", fog(Color<double>(1.5), 0.9, 0.3)}),
                         [](const auto& info) { return info.param.name; });

/// The derivative by a pixel does not depend on how bright the sky is, although samples go elsewhere: a
/// black pixel is no worse known.
TEST(EnvironmentGradient, IsThatOfTheWholePictureWhateverTheSkyIs) {
  const RenderSettings settings = settings_of(256);
  const std::vector<float> weights(settings.width * settings.height, 1);
  const auto derivatives = [&](const std::vector<Colorf>& pixels, std::uint64_t seed) {
    const Scene from = under_sky(matte("Body", 0.7), sky());
    const Scene scene = from.with_environment(pixels);
    RenderSettings mine = settings;
    mine.seed = seed;
    return render_field_jacobian(scene, scene.cameras[0], {EnvironmentRef{}}, mine, weights, 1)
        .fields[0];
  };
  std::vector<Colorf> night(kWidth * kHeight, Colorf(0));
  night[20] = Colorf(3);
  for (const int pixel : {3, 9, 11}) {
    Tally of_day, of_night;
    for (std::uint64_t seed = 0; seed < 6; ++seed) {
      of_day.add(derivatives(sky(), 100 + seed).col(3 * pixel).sum());
      of_night.add(derivatives(night, 200 + seed).col(3 * pixel).sum());
    }
    ASSERT_GT(of_day.mean(), 0) << pixel;
    EXPECT_NEAR(of_day.mean(), of_night.mean(),
                5 * std::hypot(of_day.estimate().error, of_night.estimate().error))
        << pixel;
    EXPECT_LT(of_night.estimate().error, 0.05 * of_night.mean()) << pixel;
  }
}

TEST(EnvironmentGradient, NamesWhatDoesNotFit) {
  const Scene scene = under_sky(matte("Body", 0.7), sky());
  EXPECT_THROW((void)scene.with_environment(std::vector<Colorf>(5)), InvalidArgument);
  EXPECT_THROW(
      (void)scene.with_environment(std::vector<Colorf>(kWidth * kHeight, Colorf(1, -0.1f, 1))),
      InvalidArgument);
  Scene tinted = scene;
  tinted.appearance.world.values.color = {1, 0.9, 1};
  EXPECT_THROW((void)tinted.environment(), InvalidArgument);
  Scene even = scene;
  even.appearance.world.map = nullptr;
  EXPECT_THROW((void)even.environment(), InvalidArgument);
}

}  // namespace
}  // namespace selenite
