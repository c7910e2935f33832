// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "render/media_scenes.h"
#include "render/picture_statistics.h"
#include "scene/small_scenes.h"

// Media whose density or albedo is a grid: a constant grid is a homogeneous medium.
namespace selenite {
namespace {

/// A grid over the cube from -half to half.
PlacedGrid over_cube(double half, std::array<int, 3> size, int channels,
                     std::vector<float> values) {
  PlacedGrid placed;
  placed.grid = std::make_shared<Grid>("grid", size, channels, std::move(values));
  const double s = 0.5 / half;
  placed.to_unit = matrix({s, 0, 0}, {0, s, 0}, {0, 0, s}, {0.5, 0.5, 0.5});
  return placed;
}
PlacedGrid constant_grid(float value, int channels = 1) {
  return over_cube(1, {3, 2, 4}, channels,
                   std::vector<float>(static_cast<std::size_t>(24 * channels), value));
}

Material filled(const Color<double>& extinction, double albedo, double g, bool glassy = true) {
  Material m = glassy ? glass("Medium", 1.35, 0.3) : matte("Medium", 0);
  if (!glassy) m.values.alpha = 0;
  m.values.extinction = extinction;
  m.values.albedo = Color<double>(albedo);
  m.values.anisotropy = g;
  return m;
}

struct Case {
  Color<double> extinction;
  double albedo, g;
  bool glassy = true;  ///< else lamps are seen from inside
};
void PrintTo(const Case& c, std::ostream* out) {
  *out << "extinction " << c.extinction.r << ", " << c.extinction.g << ", " << c.extinction.b
       << ", albedo " << c.albedo << ", g " << c.g;
}
class ConstantGrid : public testing::TestWithParam<Case> {
 protected:
  /// Every channel of the image and of the three slopes of both scenes, with independent seeds; an
  /// extinction of the second scene counts `share` times that of the first.
  static void compare(const Scene& plain, const Scene& grid, double share, bool albedo) {
    std::vector<std::pair<std::string, std::string>> names = {{"Medium", "extinction"},
                                                              {"Medium", "anisotropy"}};
    if (albedo) names.emplace_back("Medium", "albedo");
    const Film a = render_view(plain, settings_of(8, 800, 1), ticked(plain, names));
    const Film b = render_view(grid, settings_of(8, 800, 2), ticked(grid, names));
    ASSERT_TRUE(complete(a) && complete(b));
    for (int c = 0; c < 3; ++c) {
      // 9 to 12 comparisons a case, 7 cases: 1 false alarm in 150 runs with other seeds.
      EXPECT_LT(std::abs(mean_of(a, c).z(mean_of(b, c))), 4) << c;
      EXPECT_LT(mean_of(b, c).error, 0.02 * mean_of(b, c).mean);
      for (std::size_t s = 0; s < names.size(); ++s) {
        Estimate one = slope_of(a, static_cast<int>(s), c),
                 two = slope_of(b, static_cast<int>(s), c);
        if (s == 0) {
          one.mean *= share;
          one.error *= share;
        }
        // An extinction of 0 leaves other slopes at exactly 0.
        EXPECT_LE(std::abs(one.mean - two.mean), 4 * std::hypot(one.error, two.error))
            << names[s].second << " " << c << ": " << one.mean << " +- " << one.error << ", "
            << two.mean << " +- " << two.error;
        RecordProperty(names[s].second + std::to_string(c), std::to_string(two.mean));
      }
    }
  }
};

TEST_P(ConstantGrid, OfDensityIsTheHomogeneousMedium) {
  const auto [extinction, albedo, g, glassy] = GetParam();
  constexpr float kDensity = 0.7f;
  Material m = filled(extinction / double(kDensity), albedo, g, glassy);
  m.density_grid = constant_grid(kDensity);
  compare(lit_ball(filled(extinction, albedo, g, glassy)), lit_ball(m), kDensity, true);
}

TEST_P(ConstantGrid, OfAlbedoIsTheHomogeneousMedium) {
  const auto [extinction, albedo, g, glassy] = GetParam();
  Material m = filled(extinction, 0.123, g, glassy);
  m.albedo_grid = constant_grid(static_cast<float>(albedo), 3);
  compare(lit_ball(filled(extinction, albedo, g, glassy)), lit_ball(m), 1, false);
}
INSTANTIATE_TEST_SUITE_P(Media, ConstantGrid,
                         testing::Values(Case{Color<double>(3), 0.8, 0.4},
                                         Case{{0.5, 2, 6}, 0.9, 0}, Case{Color<double>(1), 0, 0.2},
                                         Case{Color<double>(0), 0.5, 0.3},
                                         Case{Color<double>(20), 0.6, -0.5},
                                         Case{Color<double>(2), 0.9, 0.4, false},
                                         Case{{0.5, 2, 6}, 0.7, 0, false}));

/// A boundary that is not seen: only its medium is, which scatters nothing.
Material smoke(const Color<double>& extinction, const PlacedGrid& density) {
  Material m = matte("Medium", 0);
  m.values.alpha = 0;
  m.values.extinction = extinction;
  m.values.albedo = Color<double>(0);
  m.density_grid = density;
  return m;
}

/// Two halves of density a and b along y, a slope between their middles: over the whole way of 2 the
/// integral is a + b.
constexpr float kThin = 0.3f, kThick = 1.1f;
PlacedGrid halves() { return over_cube(1, {1, 2, 1}, 1, {kThin, kThick}); }

class Slab : public testing::TestWithParam<double> {};

TEST_P(Slab, LetsThroughWhatTheIntegralOfItsDensitySays) {
  const double scale = GetParam();
  const Color<double> sigma = Color<double>{0.3, 1, 2} * scale;
  SceneBuilder builder;
  place(builder, box_mesh(20, 1, 20), builder.add_material(smoke(sigma, halves())));
  add_view(builder, {0, -4, 0}, {0, 0, 0}, 500);
  set_sky(builder, 1);
  const Scene scene = builder.build();
  for (const bool derivative : {false, true}) {
    const Film film =
        render_view(scene, settings_of(4, 4000),
                    derivative ? ticked(scene, {{"Medium", "extinction"}}) : SlotLayout());
    ASSERT_TRUE(complete(film));
    for (int c = 0; c < 3; ++c) {
      const double way = kThin + kThick, want = std::exp(-sigma[c] * way);
      const Estimate light = mean_of(film, c);
      EXPECT_LT(std::abs(light.mean - want), 4 * light.error + 1e-3 * want) << c;
      if (!derivative) continue;
      const Estimate slope = slope_of(film, 0, c);
      EXPECT_LT(std::abs(slope.mean + way * want), 4 * slope.error + 1e-3 * way * want) << c;
      EXPECT_LT(slope.error, 0.1 * way * want + 0.01) << c;
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Extinctions, Slab, testing::Values(0.0, 0.2, 1.0, 3.0));

TEST(GridMedium, ShadowRaysSeeTheSameSlab) {
  // A floor under the slab, which lies across y; the sun shines along y.
  const Color<double> sigma{0.3, 1, 2};
  const auto floor_under = [&](bool with_slab) {
    SceneBuilder builder;
    place(builder, quad_mesh(5), builder.add_material(matte("Floor", 0.8)),
          matrix({1, 0, 0}, {0, 0, 1}, {0, -1, 0}, {0, 3, 0}));
    const int material = builder.add_material(smoke(sigma, halves()));
    if (with_slab) place(builder, box_mesh(20, 1, 20), material);
    Light sun;
    sun.name = "Sun";
    sun.kind = LightKind::kSun;
    sun.values.power = 3;
    sun.to_world = looking_at({0, -5, 0}, {0, 0, 0});
    builder.add_light(sun);
    add_view(builder, {0, 2, 0}, {0, 3, 0});
    return builder.build();
  };
  const Scene scene = floor_under(true);
  const Film clear = render_view(floor_under(false), settings_of(4, 400, 1, 1));
  const Film film =
      render_view(scene, settings_of(4, 4000, 1, 1), ticked(scene, {{"Medium", "extinction"}}));
  ASSERT_TRUE(complete(film));
  for (int c = 0; c < 3; ++c) {
    const double way = kThin + kThick;
    const double want = mean_of(clear, c).mean * std::exp(-sigma[c] * way);
    const Estimate light = mean_of(film, c), slope = slope_of(film, 0, c);
    EXPECT_LT(std::abs(light.mean - want), 4 * light.error + 1e-3 * want) << c;
    EXPECT_LT(std::abs(slope.mean + way * want), 4 * slope.error + 1e-3 * way * want) << c;
    EXPECT_GT(want, 0.01);
  }
}

TEST(GridMedium, WhiteSmokeLosesNothing) {
  Material m = smoke(Color<double>(4), halves());
  m.values.albedo = Color<double>(1);
  SceneBuilder builder;
  place(builder, sphere_mesh(1, 16), builder.add_material(m));
  add_view(builder, {0, -4, 0}, {0, 0, 0}, 90);
  set_sky(builder, 1);
  const Film film = render_view(builder.build(), settings_of(8, 300));
  ASSERT_TRUE(complete(film));
  const Estimate e = mean_of(film);
  EXPECT_LT(std::abs(e.mean - 1), 4 * e.error + 1e-3) << e.mean << " +- " << e.error;
}

TEST(GridMedium, EmptyGridIsNoMedium) {
  const Scene scene = lit_ball([] {
    Material m = filled(Color<double>(5), 0.5, 0);
    m.density_grid = constant_grid(0);
    return m;
  }());
  const Scene clear = lit_ball(filled(Color<double>(0), 0.5, 0));
  const Film a = render_view(scene, settings_of(6, 50)), b = render_view(clear, settings_of(6, 50));
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a.mean[i].g, b.mean[i].g);
}

TEST(GridMedium, OpenBoundaryEndsThePath) {
  // Nothing closes the medium behind the quad: rays go on inside it for ever.
  for (const float edge : {0.0f, 1.0f}) {
    SceneBuilder builder;
    place(builder, quad_mesh(3),
          builder.add_material(smoke(Color<double>(1), over_cube(1, {1, 1, 2}, 1, {1, edge}))));
    add_view(builder, {0, 0, 4}, {0, 0, 0});
    set_sky(builder, 1);
    const Scene scene = builder.build();
    const Film film =
        render_view(scene, settings_of(4, 50), ticked(scene, {{"Medium", "extinction"}}));
    EXPECT_TRUE(complete(film));
    EXPECT_LE(mean_of(film).mean, 1);
  }
}

}  // namespace
}  // namespace selenite
