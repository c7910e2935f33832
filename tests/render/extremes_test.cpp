// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "render/picture_statistics.h"
#include "scene/small_scenes.h"

// Ends of every range, and lights of every brightness and size: all numbers stay finite.
namespace selenite {
namespace {

constexpr const char* kTicked[] = {"base_color",   "roughness", "metallic",    "ior",
                                   "transmission", "alpha",     "coat_weight", "specular_level"};

/// A sphere of a material over a ground, lit from everywhere by everything.
Scene scene_of(const Material& material, double sky, double power, double radius) {
  SceneBuilder builder;
  place(builder, sphere_mesh(1, 8), builder.add_material(material));
  place(builder, quad_mesh(3), builder.add_material(matte("Ground", 0.5)), translation({0, 0, -1}));
  std::vector<Colorf> pixels(16 * 8, Colorf(0.5f));
  pixels[2 * 16 + 5] = Colorf(static_cast<float>(sky));
  builder.appearance.world.map = std::make_shared<EnvironmentMap>(16, 8, pixels);
  set_sky(builder, 1);
  Light lamp;
  lamp.name = "Lamp";
  lamp.radius = radius;
  lamp.values.power = power;
  lamp.to_world = translation({1, -1, 3});
  builder.add_light(lamp);
  add_view(builder, {0, -4, 1.5}, {0, 0, 0}, 50);
  return builder.build();
}

/// Renders with derivatives; everything must be finite and nothing lost.
void expect_finite(const Scene& scene) {
  std::vector<std::pair<std::string, std::string>> names;
  for (const char* name : kTicked) names.emplace_back("Body", name);
  names.emplace_back("Lamp", "power");
  names.emplace_back("World", "color");
  const Film film = render_view(scene, settings_of(10, 24, 3), ticked(scene, names));
  EXPECT_EQ(film.dropped, 0) << film.first_dropped;
  EXPECT_LE(film.truncated, 2);  // light caught inside smooth glass
  double sum = 0;
  const auto check = [&](const Picture& picture) {
    for (const Colorf& c : picture)
      for (int k = 0; k < 3; ++k) ASSERT_TRUE(std::isfinite(c[k]));
  };
  check(film.mean);
  check(film.variance);
  for (const SlotFilm& slot : film.slots) {
    check(slot.mean);
    check(slot.variance);
    check(slot.covariance);
  }
  for (const Colorf& c : film.mean) {
    ASSERT_GE(c.r, 0);
    sum += c.r;
  }
  EXPECT_GT(sum, 0);
}

class MaterialEnds : public testing::TestWithParam<std::tuple<double, double, double, double>> {};

TEST_P(MaterialEnds, IsFiniteAtTheEndsOfItsRanges) {
  const auto [roughness, ior, transmission, metallic] = GetParam();
  for (const double base : {0.0, 1.0})
    for (const double alpha : {0.0, 1.0}) {
      Material m = plastic("Body");
      m.values.base_color = Color<double>(base);
      m.values.roughness = roughness;
      m.values.ior = ior;
      m.values.transmission = transmission;
      m.values.metallic = metallic;
      m.values.alpha = alpha;
      m.values.coat_weight = base;
      m.values.coat_roughness = roughness;
      expect_finite(scene_of(m, 50, 100, 0.1));
    }
}
INSTANTIATE_TEST_SUITE_P(Ends, MaterialEnds,
                         testing::Combine(testing::Values(0.0, 0.001, 0.0038, 0.02, 1.0),
                                          testing::Values(1.0, 1.0001, 2.5),
                                          testing::Values(0.0, 1.0), testing::Values(0.0, 1.0)));

class Lights : public testing::TestWithParam<std::tuple<double, double, double>> {};

TEST_P(Lights, OfEveryBrightnessAndSizeStayFinite) {
  const auto [sky, power, radius] = GetParam();
  Material m = plastic("Body");
  m.values.transmission = 0.5;
  m.values.roughness = 0.2;
  expect_finite(scene_of(m, sky, power, radius));
}
INSTANTIATE_TEST_SUITE_P(
    Ends, Lights,
    testing::Combine(testing::Values(0.0, 1e-6, 1e6), testing::Values(0.0, 1e-6, 1e6),
                     testing::Values(0.0, 1e-6, 3.0)));  // 3: around everything

TEST(Extremes, EmptySceneShowsTheSky) {
  SceneBuilder builder;
  add_view(builder, {0, -4, 1}, {0, 0, 0});
  set_sky(builder, 0.25);
  const Scene scene = builder.build();
  const Film film = render_view(scene, settings_of(4, 2), ticked(scene, {{"World", "strength"}}));
  for (std::size_t i = 0; i < film.size(); ++i) {
    EXPECT_EQ(film.mean[i].r, 0.25f);
    EXPECT_EQ(film.slots[0].mean[i].r, 1);
  }
}

TEST(Extremes, LampsInWallsCamerasInObjectsAndSpecksAreHarmless) {
  // A lamp whose centre lies in a surface, a camera inside an object, an object of 1e-6 units.
  SceneBuilder builder;
  place(builder, sphere_mesh(2, 8), builder.add_material(plastic("Body")));
  place(builder, sphere_mesh(1e-6, 4), 0, translation({0, -0.5, 0}));
  Light lamp;
  lamp.name = "Lamp";
  lamp.radius = 0.1;
  lamp.to_world = translation({0, 0, 2});
  builder.add_light(lamp);
  add_view(builder, {0, -1, 0}, {0, 0, 0}, 20);
  const Film film = render_view(builder.build(), settings_of(12, 32));
  EXPECT_EQ(film.dropped, 0) << film.first_dropped;
}

class Scale : public testing::TestWithParam<std::tuple<double, double>> {};

TEST_P(Scale, DoesNotChangeThePicture) {
  // The same scene of glass and plastic at another size and place; lamps of power times size^2.
  const auto [scale, shift] = GetParam();
  const auto picture = [](double k, double moved) {
    SceneBuilder builder;
    const Vec3d at{moved, -moved, moved / 2};
    place(builder, sphere_mesh(1 * k, 12), builder.add_material(glass("Glass", 1.4, 0.2)),
          translation(at));
    place(builder, quad_mesh(3 * k), builder.add_material(plastic("Ground")),
          translation(at + Vec3d{0, 0, -k}));
    Light lamp;
    lamp.name = "Lamp";
    lamp.radius = 0.3 * k;
    lamp.values.power = 100 * k * k;
    lamp.to_world = translation(at + Vec3d{1, -1, 3} * k);
    builder.add_light(lamp);
    Camera camera;
    camera.name = "Camera";
    camera.clip_start = 1e-3 * k;
    camera.clip_end = 1e3 * k;
    camera.to_world = looking_at(at + Vec3d{0, -4, 1.5} * k, at);
    builder.add_camera(camera);
    set_sky(builder, 0.2);
    return render_view(builder.build(), settings_of(16, 64, 9));
  };
  const Film one = picture(1, 0), other = picture(scale, shift);
  ASSERT_EQ(other.dropped, 0) << other.first_dropped;
  for (int c = 0; c < 3; ++c) {
    // Same random numbers: the same paths but for rounding.
    EXPECT_NEAR(mean_of(other, c).mean, mean_of(one, c).mean, 0.01 * mean_of(one, c).mean);
    EXPECT_LT(std::abs(mean_of(other, c).z(mean_of(one, c))), 2);
  }
}
INSTANTIATE_TEST_SUITE_P(Sizes, Scale,
                         testing::Values(std::tuple{1e-4, 0.0}, std::tuple{1e-2, 0.0},
                                         std::tuple{1e5, 0.0}, std::tuple{1.0, 1e4},
                                         std::tuple{0.01, 100.0}));

}  // namespace
}  // namespace selenite
