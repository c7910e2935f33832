// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/world.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "math/error.h"
#include "math/rng.h"
#include "math/sampling.h"
#include "math/statistics.h"

namespace selenite {
namespace {

using Pixels = std::vector<Colorf>;

Pixels black(int width, int height) { return Pixels(static_cast<std::size_t>(width) * height); }

/// Random sky with a few bright spots, some of them beside black.
Pixels spotty(int width, int height) {
  Pixels pixels = black(width, height);
  Random random(8, 0, 0);
  for (std::uint32_t i = 0; i < pixels.size(); ++i) {
    const float u = random.uniform(3 * i);
    pixels[i] = u < 0.3f ? Colorf(0) : Colorf(u, u * u, 0.2f);
    if (u > 0.98f) pixels[i] = Colorf(500);
  }
  return pixels;
}

World world_of(int width, int height, const Pixels& pixels, float even = 0) {
  World world;
  world.map = std::make_shared<EnvironmentMap>(width, height, pixels, even);
  return world;
}

TEST(EnvironmentMap, DirectionsFollowBlendersPanorama) {
  // docs/method/rendering.md, "World": centre column +X, right of it -Y, v up.
  constexpr int kWidth = 16, kHeight = 8;
  const auto at = [&](int column, int row, const Vec3f& direction) {
    Pixels pixels = black(kWidth, kHeight);
    pixels[static_cast<std::size_t>(row) * kWidth + column] = Colorf(1);
    return EnvironmentMap(kWidth, kHeight, pixels).radiance(direction).r;
  };
  const auto texel = [&](int column, int row) {  // centre of a texel
    const float u = (column + 0.5f) / kWidth,
                elevation = (0.5f - (row + 0.5f) / kHeight) * kPi<float>;
    const float azimuth = (0.5f - u) * 2 * kPi<float>;
    return Vec3f{std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                 std::sin(elevation)};
  };
  for (int column = 0; column < kWidth; ++column)
    for (int row = 0; row < kHeight; ++row)
      EXPECT_NEAR(at(column, row, texel(column, row)), 1, 1e-5) << column << " " << row;
  // By hand, without the formula: halfway between the two middle texels on each side.
  const float tilt = std::sin(kPi<float> / 16), flat = std::cos(kPi<float> / 16);
  EXPECT_NEAR(at(8, 3, {flat, 0, tilt}), 0.5f, 1e-5);  // +X, a little up: right of the centre line
  EXPECT_NEAR(at(7, 3, {flat, 0, tilt}), 0.5f, 1e-5);
  EXPECT_NEAR(at(12, 3, {0, -flat, tilt}), 0.5f, 1e-5);  // -Y at three quarters
  EXPECT_NEAR(at(4, 3, {0, flat, tilt}), 0.5f, 1e-5);
  EXPECT_NEAR(at(0, 4, {-flat, 0, -tilt}), 0.5f, 1e-5);  // -X at the seam, from both sides
  EXPECT_NEAR(at(15, 4, {-flat, 0, -tilt}), 0.5f, 1e-5);
  Pixels top = black(kWidth, kHeight);
  for (int column = 0; column < kWidth; ++column) top[column] = Colorf(1);
  const EnvironmentMap zenith(kWidth, kHeight, top);
  EXPECT_NEAR(zenith.radiance({0, 0, 1}).r, 1, 1e-5);
  EXPECT_EQ(zenith.radiance({0, 0, -1}).r, 0);
}

struct Sky {
  const char* name;
  int width, height;
  float even = 0;  ///< share of the samples
};
void PrintTo(const Sky& s, std::ostream* out) { *out << s.name; }
class Map : public testing::TestWithParam<Sky> {
 protected:
  World world() const {
    const auto& [name, width, height, even] = GetParam();
    World w = world_of(width, height, spotty(width, height), even);
    // Turned about an odd axis.
    const Vec3f z = normalize(Vec3f{1, 2, 3});
    const Frame<float> frame = Frame<float>::from_normal(z);
    w.to_map = {frame.s, frame.t, frame.n};
    w.values.rotation = 0.7;
    return w;
  }
};

/// Midpoint rule over the map's own sphere.
template <class F>
double over_the_sphere(const World& world, F&& f) {
  constexpr int kRows = 700, kColumns = 1400;
  double sum = 0;
  for (int i = 0; i < kRows; ++i) {
    const double theta = kPi<double> * (i + 0.5) / kRows;
    for (int j = 0; j < kColumns; ++j) {
      const double phi = 2 * kPi<double> * (j + 0.5) / kColumns;
      const Vec3d m{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                    std::cos(theta)};
      const Vec3f d(Vec3d(world.to_map[0]) * m.x + Vec3d(world.to_map[1]) * m.y +
                    Vec3d(world.to_map[2]) * m.z);
      sum += f(d) * std::sin(theta);
    }
  }
  return sum * kPi<double> / kRows * 2 * kPi<double> / kColumns;
}

/// As a Mapping node of type Point rotates the direction in which the image is looked up.
TEST_P(Map, RotationRotatesTheLookup) {
  World w = world(), at_0 = w;
  at_0.values.rotation = 0;
  const auto& t = w.to_map;
  const double c = std::cos(w.values.rotation), s = std::sin(w.values.rotation);
  for (const Vec3f& d : {normalize(Vec3f{1, 2, 0.3f}), normalize(Vec3f{-2, 0.4f, -1})}) {
    const Vec3d m{dot(t[0], d), dot(t[1], d), dot(t[2], d)};
    const Vec3d there{c * m.x - s * m.y, s * m.x + c * m.y, m.z};
    const auto same = Vec3f(Vec3d(t[0]) * there.x + Vec3d(t[1]) * there.y + Vec3d(t[2]) * there.z);
    constexpr double kStep = 1e-3;
    World up = w, down = w;
    up.values.rotation += kStep;
    down.values.rotation -= kStep;
    for (int k = 0; k < 3; ++k) {
      const float size = w.factor(d)[k];
      EXPECT_NEAR(size, at_0.factor(same)[k], 1e-3f * size + 1e-3f);
      EXPECT_NEAR(size, w.at_rotation_0().factor(d)[k], 1e-3f * size + 1e-3f);
      const double slope = (up.factor(d)[k] - down.factor(d)[k]) / (2 * kStep);
      EXPECT_NEAR(w.rotation_slope(d)[k], slope, 0.02 * std::abs(slope) + 0.05 * size + 1e-3);
    }
  }
}

TEST_P(Map, DensityIntegratesToOne) {
  const World w = world();
  EXPECT_NEAR(over_the_sphere(w, [&](const Vec3f& d) { return w.density(d); }), 1, 5e-3);
  EXPECT_NEAR(over_the_sphere(w, [&](const Vec3f& d) { return w.cycles_density(d); }), 1, 2e-2);
}

TEST_P(Map, SamplesFollowTheDensityAndCoverAllRadiance) {
  const World w = world().at_rotation_0();  // as a render has it
  const Vec3f up = normalize(Vec3f{0.3f, -0.5f, 1});
  Tally light[3], above;
  Random random(4, 0, 0);
  for (std::uint32_t i = 0; i < 300000; ++i) {
    random.start_bounce(i);
    float density = 0;
    const Vec3f d = w.sample(random.uniform(0), random.uniform(1), density);
    ASSERT_NEAR(dot(d, d), 1, 1e-5);
    ASSERT_GT(density, 0);
    EXPECT_NEAR(w.density(d), density, 0.02 * density + 1e-3);
    for (int c = 0; c < 3; ++c) light[c].add(w.factor(d)[c] / density);
    above.add(dot(d, up) > 0);
  }
  for (int c = 0; c < 3; ++c) {
    const double truth = over_the_sphere(w, [&](const Vec3f& d) { return w.factor(d)[c]; });
    EXPECT_NEAR(light[c].mean(), truth, 4 * light[c].estimate().error + 2e-3 * truth);
  }
  const double truth =
      over_the_sphere(w, [&](const Vec3f& d) { return dot(d, up) > 0 ? w.density(d) : 0; });
  EXPECT_NEAR(above.mean(), truth, 4 * above.estimate().error + 5e-3);
  // No direction with radiance is left to chance: weights are bounded.
  const double mean = over_the_sphere(w, [&](const Vec3f& d) { return w.factor(d).g; });
  EXPECT_LT(over_the_sphere(w,
                            [&](const Vec3f& d) {
                              return w.density(d) > 0 || w.factor(d).g == 0 ? 0 : w.factor(d).g;
                            }),
            1e-3 * mean);
}
INSTANTIATE_TEST_SUITE_P(Sizes, Map,
                         testing::Values(Sky{"Usual", 32, 16}, Sky{"OneTexel", 1, 1},
                                         Sky{"Column", 1, 8}, Sky{"Row", 8, 1},
                                         Sky{"HalfEven", 32, 16, 0.5f}),
                         [](const auto& info) { return info.param.name; });

TEST(EnvironmentMap, DensityKeepsItsDigitsAtThePoles) {
  // One texel: density 1 / (2 pi^2 sin), whose sine must not come from 1 - z^2 in float.
  const EnvironmentMap map(1, 1, Pixels(1, Colorf(1)));
  for (const float sine : {0.3f, 1e-2f, 1e-3f, 3e-4f})
    for (const float side : {1.0f, -1.0f}) {
      const Vec3f d =
          normalize(Vec3f{sine * 0.6f, -sine * 0.8f, side * std::sqrt(1 - sine * sine)});
      EXPECT_NEAR(map.density(d) * 2 * kPi<double> * kPi<double> * sine, 1, 1e-3) << sine;
    }
}

TEST(EnvironmentMap, ABlackMapIsSampledEvenly) {
  const World w = world_of(8, 4, black(8, 4));
  float density = 0;
  const Vec3f d = w.sample(0.3f, 0.7f, density);
  EXPECT_TRUE(std::isfinite(d.x + d.y + d.z + density));
  EXPECT_EQ(w.factor(d).r, 0);
  EXPECT_EQ(w.map->mean_luminance(), 0);
}

TEST(EnvironmentMap, ASharedOutPartReachesBlackPixels) {
  Pixels pixels = black(16, 8);
  pixels[4 * 16 + 3] = Colorf(10);
  const World w = world_of(16, 8, pixels, EnvironmentMap::kUnknownEven);
  const double per_solid_angle = EnvironmentMap::kUnknownEven / (4 * kPi<double>);
  // At the middle of a row, far from the bright pixel. The sum over rows is 0.7 % off the integral.
  for (const double theta : {1.5 / 8 * kPi<double>, 3.5 / 8 * kPi<double>, 6.5 / 8 * kPi<double>}) {
    const Vec3f d(Vec3d{std::sin(theta), 0, std::cos(theta)});
    EXPECT_NEAR(w.density(d), per_solid_angle, 0.01 * per_solid_angle) << theta;
  }
  EXPECT_EQ(world_of(16, 8, pixels).density({1, 0, 0}), 0);
}

TEST(EnvironmentMap, MeanLuminanceIsOverTheSphere) {
  Pixels pixels(64 * 32, Colorf(0));
  for (int x = 0; x < 64; ++x)
    for (int y = 0; y < 16; ++y) pixels[y * 64 + x] = Colorf(1, 0, 0);  // upper half red
  EXPECT_NEAR(EnvironmentMap(64, 32, pixels).mean_luminance(), 0.5 * 0.2126, 1e-4);
}

TEST(World, WithoutAMapIsConstantAndNotSampled) {
  World w;
  for (const Vec3f& d : {Vec3f{0, 0, 1}, {1, 0, 0}, {0, -1, 0}}) {
    EXPECT_EQ(w.factor(d).g, 1);
    EXPECT_EQ(w.density(d), 0);
  }
}

TEST(World, RefusesBadValuesAndMappings) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  World good;
  EXPECT_NO_THROW(good.check());
  World w = good;
  w.values.color.r = -1;
  EXPECT_THROW(w.check(), InvalidArgument);
  w = good;
  w.values.strength = kNan;
  EXPECT_THROW(w.check(), InvalidArgument);
  w = good;
  w.to_map[0] = {2, 0, 0};
  EXPECT_THROW(w.check(), InvalidArgument);
  w = good;
  w.to_map[2] = {kNan, 0, 1};
  EXPECT_THROW(w.check(), InvalidArgument);
  EXPECT_THROW(EnvironmentMap(2, 2, black(2, 1)), InvalidArgument);
  EXPECT_THROW(EnvironmentMap(0, 0, {}), InvalidArgument);
  Pixels bad = black(2, 2);
  bad[3].g = kNan;
  EXPECT_THROW(EnvironmentMap(2, 2, bad), InvalidArgument);
}

TEST(EnvironmentMap, NegativePixelsAreNegativeLightThatIsNotSampled) {
  constexpr int kWidth = 16, kHeight = 8;
  Pixels pixels(kWidth * kHeight, Colorf(1));
  std::fill(pixels.begin() + kWidth * kHeight / 2, pixels.end(), Colorf(-2));
  const World w = world_of(kWidth, kHeight, pixels);
  const Vec3f down{0, 0, -1};
  EXPECT_EQ(w.factor(down).g, -2);
  EXPECT_EQ(w.density(down), 0);
  EXPECT_EQ(w.cycles_density(down), 0);
  EXPECT_NEAR(over_the_sphere(w, [&](const Vec3f& d) { return w.density(d); }), 1, 5e-3);
  EXPECT_NEAR(over_the_sphere(w, [&](const Vec3f& d) { return w.cycles_density(d); }), 1, 2e-2);
}

}  // namespace
}  // namespace selenite
