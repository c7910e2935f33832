// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/sheen.h"

#include <gtest/gtest.h>

#include "model/cases.h"

namespace selenite {
namespace {

const Vec3d kUp{0, 0, 1};

TEST(Sheen, DensityIntegratesToOne) {
  for (const double roughness : {0.2, 0.3, 0.6, 1.})
    for (const double cosine : {0.02, 0.4, 1.}) {
      const Sheen<double> lobe(roughness, kUp, cases::direction(cosine));
      ASSERT_TRUE(lobe.exists());
      double sum = 0;
      const int heights = 600, turns = 600;
      for (int i = 0; i < heights; ++i)
        for (int j = 0; j < turns; ++j)
          sum += lobe.density(
              cases::direction((i + 0.5) / heights, 2 * kPi<double> * (j + 0.5) / turns));
      EXPECT_NEAR(sum * 2 * kPi<double> / (heights * turns), 1, 1e-3) << roughness << " " << cosine;
    }
}

TEST(Sheen, LooksAlongTheViewersPlane) {
  // Turning viewer and light about the normal changes nothing; mirroring at the viewer's plane neither.
  const double cosine = 0.3, turn = 1.7;
  const Sheen<double> lobe(0.4, kUp, cases::direction(cosine, 0)),
      turned(0.4, kUp, cases::direction(cosine, turn));
  for (const double phi : {0.2, 1.1, 2.9}) {
    const double value = lobe.value(cases::direction(0.6, phi));
    EXPECT_NEAR(turned.value(cases::direction(0.6, phi + turn)), value, 1e-12);
    EXPECT_NEAR(lobe.value(cases::direction(0.6, -phi)), value, 1e-12);
  }
  // b < 0: against the viewer less is reflected than back to him.
  EXPECT_GT(lobe.value(cases::direction(0.3, 0)), lobe.value(cases::direction(0.3, kPi<double>)));
}

TEST(Sheen, HasADirectionEvenAlongTheNormal) {
  for (const Vec3d& n : {kUp, -kUp, Vec3d{1, 0, 0}, normalize(Vec3d{1, 1, 1}),
                         normalize(Vec3d{-1, 1, 1}), normalize(Vec3d{-1, -1, -1})}) {
    const Sheen<double> lobe(0.5, n, n);
    const Vec3d wo = lobe.sample(0.3, 0.6);
    EXPECT_NEAR(length(wo), 1, 1e-12);
    EXPECT_GT(dot(wo, n), 0);
    EXPECT_NEAR(lobe.value(wo), lobe.density(wo), 1e-12);
  }
  // In Cycles the axis of a normal along z is (1, -1, 0).
  const Sheen<double> lobe(0.5, kUp, kUp);
  const auto at = [&](double degrees) {
    return lobe.value(cases::direction(0.6, degrees * kPi<double> / 180));
  };
  EXPECT_GT(std::abs(at(-45) - at(135)), 1e-5);
  EXPECT_NEAR(at(45), at(225), 1e-12);
}

TEST(Sheen, IsLeftOutWhereThereIsNextToNothing) {
  EXPECT_FALSE(Sheen<double>(0, kUp, cases::direction(0.9)).exists());
  EXPECT_FALSE(Sheen<double>(0.02, kUp, cases::direction(0.9)).exists());
  EXPECT_TRUE(Sheen<double>(0.2, kUp, cases::direction(0.9)).exists());
}

TEST(Sheen, StartsAtRoughnessOneThousandth) {
  const Vec3d wi = cases::direction(0.01), wo = cases::direction(0.2, 1);
  const Sheen<double> least(0, kUp, wi), clamped(1e-3, kUp, wi), above(2e-3, kUp, wi);
  ASSERT_TRUE(least.exists());
  EXPECT_EQ(least.value(wo), clamped.value(wo));
  EXPECT_NE(above.value(wo), clamped.value(wo));
}

TEST(Sheen, TakesItsAlbedoFromTheLayersBelow) {
  Principled<double> m;
  m.specular_level = 0;
  m.emission_strength = 1;
  m.sheen_roughness = 0.4;
  const Vec3d wi = cases::direction(0.3), wo = cases::direction(0.7, 2);
  const auto bsdf = [&] { return PrincipledBsdf<double>(m, Flavour{}, cases::flat(wi, false)); };
  const Color<double> bare = bsdf().value(wo);
  m.sheen_weight = 0.6;
  m.sheen_tint = {0.2, 1, 0.5};
  const Sheen<double> lobe(0.4, kUp, wi);
  const double left = 1 - 0.6 * lobe.albedo();  // of the largest channel, for all of them
  EXPECT_NEAR(bsdf().emission().r, left, 1e-12);
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(bsdf().value(wo)[c],
                left * bare[c] + 0.6 * m.sheen_tint[c] * lobe.albedo() * lobe.value(wo), 1e-12);
}

TEST(Sheen, HasNoPartInVersionOne) {
  Principled<double> m;
  const auto value = [&] {
    const auto point = cases::flat(cases::direction(0.3), false);
    return PrincipledBsdf<double>(m, Flavour{.version = Flavour::Version::kV1}, point)
        .value(cases::direction(0.7, 2))
        .g;
  };
  const double without = value();
  m.sheen_weight = 1;
  EXPECT_EQ(value(), without);
}

}  // namespace
}  // namespace selenite
