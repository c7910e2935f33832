// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/lights/sun_disc.h"

#include <gtest/gtest.h>

#include "math/error.h"
#include "math/rng.h"
#include "math/statistics.h"
#include "scene/world.h"

namespace selenite {
namespace {

constexpr double kRadius = 0.00465;  // of the sun
const Vec3d kAxis{0.48, -0.6, 0.64}, kUp{0, 0, 1};

SunDisc disc(double radius = kRadius, const std::vector<Colorf>& pixels = {Colorf(100)}) {
  return {kAxis, kUp, radius, pixels.size() == 1 ? 1 : 2, pixels};
}

/// A direction so many radii to the right of the axis and above it.
Vec3f away(double right, double up, double radius = kRadius) {
  const Vec3d side = normalize(cross(kAxis, kUp)), top = cross(side, kAxis);
  return Vec3f(normalize(kAxis + side * (right * radius) + top * (up * radius)));
}

TEST(SunDisc, ShinesInsideItsRadiusAlone) {
  EXPECT_EQ(disc().radiance(Vec3f(kAxis)).r, 100);
  EXPECT_EQ(disc().radiance(away(0.98, 0)).r, 100);
  EXPECT_EQ(disc().radiance(away(0, -0.98)).r, 100);
  EXPECT_EQ(disc().radiance(away(1.02, 0)).r, 0);
  EXPECT_EQ(disc().radiance(Vec3f(-kAxis)).r, 0);
}

TEST(SunDisc, ItsPictureStandsUpright) {
  // Row by row from the top: left, right.
  const SunDisc four = disc(kRadius, {Colorf(1), Colorf(2), Colorf(3), Colorf(4)});
  EXPECT_NEAR(four.radiance(away(-0.6, 0.6)).r, 1, 1e-3);
  EXPECT_NEAR(four.radiance(away(0.6, 0.6)).r, 2, 1e-3);
  EXPECT_NEAR(four.radiance(away(-0.6, -0.6)).r, 3, 1e-3);
  EXPECT_NEAR(four.radiance(away(0.6, -0.6)).r, 4, 1e-3);
}

TEST(SunDisc, SamplesLieInsideAndDensityIsTheInverseOfItsSolidAngle) {
  for (const double radius : {1e-4, kRadius, 0.5}) {
    const SunDisc one = disc(radius);
    const double solid = 2 * kPi<double> * 2 * std::pow(std::sin(radius / 2), 2);
    Random random(4, 0, 0);
    for (std::uint32_t i = 0; i < 1000; ++i) {
      const Vec3f d = one.sample(random.uniform(2 * i), random.uniform(2 * i + 1));
      EXPECT_NEAR(dot(d, d), 1, 1e-5);
      // The outermost samples may round to the other side.
      const Vec3d across = cross(Vec3d(d), kAxis);  // acos has no digits there
      EXPECT_LT(std::sqrt(dot(across, across)), std::sin(radius) * 1.01) << radius;
    }
    EXPECT_NEAR(one.density(Vec3f(kAxis)) * solid, 1, 1e-4) << radius;
    const SunDisc fine(kAxis, kUp, radius, 64, std::vector<Colorf>(64 * 64, Colorf(100)));
    EXPECT_NEAR(fine.flux() / solid, 100, 2) << radius;  // pixels at the edge are squares
  }
}

TEST(SunDisc, LightSamplesOfASkyFindItsLight) {
  constexpr int kWidth = 16, kHeight = 8;
  const std::vector<Colorf> sky(kWidth * kHeight, Colorf(0.4f));
  const double solid = 2 * kPi<double> * 2 * std::pow(std::sin(kRadius / 2), 2);
  const EnvironmentMap map(
      kWidth, kHeight, sky, 0,
      SunDisc(kAxis, kUp, kRadius, 64, std::vector<Colorf>(64 * 64, Colorf(50000))));
  Tally found;
  Random random(4, 0, 0);
  for (std::uint32_t i = 0; i < 20000; ++i) {
    float density = 0;
    const Vec3f d = map.sample(random.uniform(2 * i), random.uniform(2 * i + 1), density);
    ASSERT_GT(density, 0);
    EXPECT_EQ(density, map.density(d));
    found.add(map.radiance(d).r / density);
  }
  const double wanted = 4 * kPi<double> * 0.4 + 50000 * solid;
  // False alarms: one in 10,000 seeds.
  EXPECT_NEAR(found.mean(), wanted, 4 * found.estimate().error + 0.005 * wanted);
  EXPECT_NEAR(map.mean_luminance(), wanted / (4 * kPi<double>), 0.05 * wanted / (4 * kPi<double>));
}

TEST(SunDisc, RefusesWhatIsNoDisc) {
  EXPECT_THROW(disc(0), InvalidArgument);
  EXPECT_THROW(disc(SunDisc::kLargest * 1.01), InvalidArgument);
  EXPECT_NO_THROW(disc(SunDisc::kLargest));
  EXPECT_THROW(SunDisc(kAxis, kAxis, kRadius, 1, {Colorf(1)}), InvalidArgument);
  EXPECT_THROW(SunDisc(kAxis, kUp, kRadius, 2, {Colorf(1)}), InvalidArgument);
  const float nan = std::nanf("");
  EXPECT_THROW(SunDisc(kAxis, kUp, kRadius, 1, {Colorf(nan)}), InvalidArgument);
}

}  // namespace
}  // namespace selenite
