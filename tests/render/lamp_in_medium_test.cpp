// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "render/media/equiangular.h"
#include "render/media_scenes.h"
#include "render/picture_statistics.h"
#include "scene/small_scenes.h"

namespace selenite {
namespace {

struct Stretch {
  float length, nearest, height;
};
void PrintTo(const Stretch& s, std::ostream* out) {
  *out << s.length << " long, lamp " << s.height << " off at " << s.nearest;
}

class EquiangularStretch : public testing::TestWithParam<Stretch> {};

TEST_P(EquiangularStretch, SamplesFollowADensityThatIntegratesToOne) {
  const auto [length, nearest, height] = GetParam();
  const Equiangular along({0, 0, 0}, {1, 0, 0}, length, {nearest, height, 0});
  ASSERT_TRUE(along);
  // Shares of the samples below a distance against the integral of the density up to there, by the
  // substitution x = nearest + height tan(a), under which it is constant.
  const auto angle = [&](double x) { return std::atan((x - nearest) / height); };
  const double begin = angle(0), end = std::isinf(length) ? kPi<double> / 2 : angle(length);
  const int steps = 2000;
  double whole = 0;
  for (int i = 0; i < steps; ++i) {
    const double a = begin + (i + 0.5) / steps * (end - begin);
    const double x = nearest + height * std::tan(a);
    whole += along.density(static_cast<float>(x)) * height / square(std::cos(a));
  }
  EXPECT_NEAR(whole * (end - begin) / steps, 1, 2e-3);
  for (const float u : {0.0f, 0.1f, 0.5f, 0.9f, 0.9999f}) {
    const float t = along.sample(u);
    EXPECT_GE(t, 0);
    EXPECT_LE(t, length);
    EXPECT_NEAR((angle(t) - begin) / (end - begin), u, 2e-3) << t;
  }
}
INSTANTIATE_TEST_SUITE_P(Places, EquiangularStretch,
                         testing::Values(Stretch{1, 0.5f, 0.3f}, Stretch{1, 0.5f, 1e-4f},
                                         Stretch{2, -3, 0.5f}, Stretch{2, 7, 0.01f},
                                         Stretch{std::numeric_limits<float>::infinity(), 4, 1},
                                         Stretch{1e-4f, 5e-5f, 2e-5f}, Stretch{1e5f, 2e4f, 3e3f}));

TEST(Equiangular, ALampOnTheRayHasNoDensity) {
  const Equiangular along({0, 0, 0}, {0, 0, 1}, 4, {0, 0, 2});
  EXPECT_FALSE(along);
  EXPECT_EQ(along.density(2), 0);
}

class LampInFog : public testing::TestWithParam<double> {};

TEST_P(LampInFog, ScattersOnceAsSolvedOnPaper) {
  const double size = GetParam(), sigma_t = 0.8 / size, albedo = 0.7, clip = 0.5 * size;
  SceneBuilder builder;
  Material m = matte("Fog", 0);
  m.values.alpha = 0;
  m.values.extinction = Color<double>(sigma_t);
  m.values.albedo = Color<double>(albedo);
  place(builder, box_mesh(3 * size, 3 * size, 3 * size), builder.add_material(m));
  Light lamp;
  lamp.name = "Lamp";
  lamp.kind = LightKind::kPoint;
  lamp.values.power = 60 * square(size);
  lamp.to_world = translation({0.1 * size, 0.4 * size, 0});
  builder.add_light(lamp);
  // One ray along +y, from inside the fog; it starts at the near clip plane.
  add_view(builder, {0, -2 * size, 0}, {0, 0, 0}, 1e5);
  builder.cameras.back().clip_start = clip;
  builder.cameras.back().clip_end = 100 * size;
  const Scene scene = builder.build();

  const Light& there = scene.appearance.lights[0];
  double want = 0;
  const int steps = 20000;
  const double first = -2 * size + clip, last = 3 * size;
  for (int i = 0; i < steps; ++i) {
    const double y = first + (i + 0.5) / steps * (last - first);
    const Vec3d x{0, y, 0};
    const auto s = there.sample(Vec3f(x - scene.geometry->origin()), 0.5f, 0.5f);
    ASSERT_TRUE(s);
    want += s->factor * there.values.power * sigma_t * albedo /
            (4 * kPi<double>)*std::exp(-sigma_t * (y - first + s->distance));
  }
  want *= (last - first) / steps;

  RenderSettings settings = settings_of(4, 4000);
  settings.depth = 1;
  const SlotLayout layout = ticked(scene, {{"Fog", "albedo"}});
  const Film film = render_view(scene, settings, layout);
  ASSERT_TRUE(complete(film));
  const Estimate light = mean_of(film), slope = slope_of(film, 0);
  EXPECT_LT(std::abs(light.mean - want), 4 * light.error + 1e-3 * want) << want;
  // Placed for the lamp, 64 000 samples leave next to no noise; free flights alone leave 2 %.
  EXPECT_LT(light.error, 2e-3 * want);
  EXPECT_LT(std::abs(slope.mean * albedo - want), 4 * slope.error * albedo + 1e-3 * want);
}
INSTANTIATE_TEST_SUITE_P(Sizes, LampInFog, testing::Values(1e-4, 1.0, 1e5));

/// Bodies out of which no light is sought must look the same as when it is: a lamp of next to no
/// power inside of them makes the difference, for a closed body and for one that is open at the top.
class SealedBody : public testing::TestWithParam<bool> {};

TEST_P(SealedBody, LooksTheSameWhereLightIsSoughtInside) {
  const bool open = GetParam();
  Tally difference, size;
  for (int seed = 0; seed < 8; ++seed) {
    double mean[2];
    for (const bool sought : {false, true}) {
      SceneBuilder builder;
      Mesh body = sphere_mesh(1, 16);
      if (open) {  // light of the lamp above falls in
        std::vector<std::array<int, 3>> kept;
        for (const auto& t : body.triangles)
          if (body.positions[t[0]].z < 0.6f) kept.push_back(t);
        body = make_mesh(body.positions, kept);
      }
      place(builder, body, builder.add_material(filled_glass(0.5, 1.2, 2, 0.95)));
      for (const double power : {sought ? 1e-9 : 0.0, 50.0}) {
        if (power == 0) continue;
        Light lamp;
        lamp.name = power > 1 ? "Above" : "Inside";
        lamp.kind = LightKind::kArea;
        lamp.size_x = lamp.size_y = power > 1 ? 5 : 0.1;
        lamp.values.power = power;
        lamp.to_world = translation({0, 0, power > 1 ? 2.5 : 0.0});  // it shines down
        builder.add_light(lamp);
      }
      add_view(builder, {0, -4, 0}, {0, 0, 0}, 90);
      const Film film = render_view(builder.build(), settings_of(8, 500, 10 + 2 * seed + sought));
      ASSERT_TRUE(complete(film));
      mean[sought] = mean_of(film).mean;
    }
    difference.add(mean[1] - mean[0]);
    size.add(mean[0]);
  }
  // Student's t of 7 degrees of freedom beyond 5.4: 1 false alarm in 1000.
  const Estimate e = difference.estimate();
  RecordProperty("error_per_light", std::to_string(e.error / size.mean()));
  EXPECT_LT(std::abs(e.mean), 5.4 * e.error) << size.mean();
  // What is sought in vain in a closed body is 14 % of the light in an open one.
  EXPECT_LT(5.4 * e.error, 0.1 * size.mean());
}
INSTANTIATE_TEST_SUITE_P(ClosedAndOpen, SealedBody, testing::Bool(),
                         [](const auto& info) { return info.param ? "Open" : "Closed"; });

}  // namespace
}  // namespace selenite
