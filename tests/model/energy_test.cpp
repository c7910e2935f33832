// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "model/cases.h"

namespace selenite {
namespace {

/// Light that a white environment sends to the viewer: mean weight over a lattice of `sample`.
Color<double> furnace(const PrincipledBsdf<double>& bsdf) {
  const int n = 1 << 14;
  Color<double> sum(0);
  for (int i = 0; i < n; ++i) {
    // Additive recurrence with powers of the plastic number's generalisation to three dimensions.
    const auto turn = [&](double step) { return std::fmod(0.5 + step * (i + 1), 1.); };
    const auto s = bsdf.sample(turn(0.8191725134), turn(0.6710436067), turn(0.5497004779));
    if (s) sum += s->weight;
  }
  return sum / static_cast<double>(n) + bsdf.transparency();
}

/// White in every respect: nothing is absorbed on purpose.
Principled<double> whitened(Principled<double> m) {
  m.base_color = m.specular_tint = m.coat_tint = Color<double>(1);
  return m;
}

class Furnace : public testing::TestWithParam<Flavour::Distribution> {};

TEST_P(Furnace, GainsNoEnergy) {
  for (const cases::Family& family : cases::families()) {
    // Version 1 adds its diffuse and specular parts without layering: an opaque white one gains.
    if (family.version == Flavour::Version::kV1 && family.material(1).transmission < 1) continue;
    const Flavour flavour{.distribution = GetParam(),
                          .version = family.version,
                          .evaluate_unphysical_refraction = false};
    for (const double roughness : {0., 0.02, 0.1, 0.3, 0.6, 1.}) {
      for (const double cosine : {1., 0.8, 0.5, 0.3, 0.1, 0.02}) {
        const PrincipledBsdf<double> bsdf(whitened(family.material(roughness)), flavour,
                                          cases::flat(cases::direction(cosine), family.backfacing));
        const double most = max_channel(furnace(bsdf));
        // Layering and compensation read albedos interpolated between nodes, as Cycles does; near
        // grazing, where those curve between cosine 0 and 1/15, up to 1.04 % of energy is gained.
        const double excess = cosine < 0.3 ? 0.012 : 2e-3;
        EXPECT_LE(most, 1 + excess) << family.name << " " << roughness << " " << cosine;
      }
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Distributions, Furnace,
                         testing::Values(Flavour::Distribution::kGgx,
                                         Flavour::Distribution::kMultiGgx),
                         [](const auto& info) {
                           return info.param == Flavour::Distribution::kGgx ? "ggx" : "multi_ggx";
                         });

TEST(Furnace, CompensationGivesBackWhatSingleScatteringLoses) {
  for (const double cosine : {0.3, 0.9}) {
    for (const bool inside : {false, true}) {
      Principled<double> m;
      m.transmission = 1, m.roughness = 0.6, m.base_color = Color<double>(1);
      const auto point = cases::flat(cases::direction(cosine), inside);
      Flavour flavour{.evaluate_unphysical_refraction = false};
      const double multi = furnace(PrincipledBsdf<double>(m, flavour, point)).g;
      flavour.distribution = Flavour::Distribution::kGgx;
      const double single = furnace(PrincipledBsdf<double>(m, flavour, point)).g;
      EXPECT_GT(multi, single + 0.02);
      // From inside the table also counts directions that are dropped, so that less is given back.
      EXPECT_NEAR(multi, 1, inside ? 0.1 : 3e-3);
    }
  }
}

TEST(Layers, OpaqueWithoutReflectionIsLambert) {
  Principled<double> m;
  m.ior = 1, m.base_color = {0.2, 0.5, 0.9};
  const PrincipledBsdf<double> bsdf(m, Flavour{}, cases::flat(cases::direction(0.4), false));
  for (const double c : {0.1, 0.5, 1.}) {
    const Color<double> f = bsdf.value(cases::direction(c, 2));
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(f[k], m.base_color[k] * c / kPi<double>, 1e-15);
  }
  EXPECT_EQ(bsdf.value({0, 0.6, -0.8}).g, 0);
}

TEST(Layers, RoughDiffuseStartsAtLambert) {
  const Vec3d wi = cases::direction(0.4), wo = cases::direction(0.7, 2);
  Principled<double> m;
  const auto value = [&] {
    return PrincipledBsdf<double>(m, Flavour{}, cases::flat(wi, false)).value(wo).g;
  };
  const double lambert = value();
  m.diffuse_roughness = 2e-5;  // above Cycles' threshold of 1e-5
  EXPECT_NEAR(value(), lambert, 1e-5);
  m.diffuse_roughness = 1;
  EXPECT_GT(std::abs(value() - lambert), 0.01);
}

TEST(Layers, AlphaSplitsLightBetweenTheSurfaceAndWhatLiesBehind) {
  const auto point = cases::flat(cases::direction(0.4), false);
  Principled<double> m;
  m.emission_strength = 2, m.emission_color = {1, 0.5, 0.25};
  const Vec3d wo = cases::direction(0.7, 2);
  const PrincipledBsdf<double> whole(m, Flavour{}, point);
  m.alpha = 0.25;
  const PrincipledBsdf<double> part(m, Flavour{}, point);
  EXPECT_EQ(part.transparency().g, 0.75);
  EXPECT_NEAR(part.value(wo).g, 0.25 * whole.value(wo).g, 1e-15);
  EXPECT_EQ(whole.emission().b, 0.5);
  EXPECT_EQ(part.emission().b, 0.125);
  EXPECT_NEAR(part.density(wo), whole.density(wo),
              1e-15);  // of what is not passed straight through
}

TEST(Layers, OneChannelOfTheTintDarkensAllBelow) {
  // The layer below is attenuated by the largest channel, so that it keeps its own colour.
  const auto point = cases::flat(cases::direction(0.4), false);
  Principled<double> m;
  m.base_color = Color<double>(0.5);
  m.roughness = 0.05;
  const Vec3d wo = cases::direction(0.9, 2);  // far from the mirror direction
  m.specular_tint = {1, 0, 0};
  const Color<double> f = PrincipledBsdf<double>(m, Flavour{}, point).value(wo);
  m.specular_tint = Color<double>(1);
  const Color<double> white = PrincipledBsdf<double>(m, Flavour{}, point).value(wo);
  EXPECT_NEAR(f.g, f.r, 1e-4);
  EXPECT_NEAR(f.g, white.g, 1e-4);
}

TEST(Layers, FacingMattersToGlassAlone) {
  Principled<double> m;
  const Vec3d wi = cases::direction(0.4), wo = cases::direction(0.7, 2);
  const auto value = [&](bool backfacing) {
    return PrincipledBsdf<double>(m, Flavour{}, cases::flat(wi, backfacing)).value(wo).g;
  };
  EXPECT_EQ(value(false), value(true));
  m.transmission = 0.5;
  EXPECT_NE(value(false), value(true));
}

/// Of a face and a bent normal; the interpolated normal decides between those of a face and its own.
TEST(Layers, DirectionsBetweenTheNormalsBelongToNeitherSide) {
  const Vec3d n = normalize(Vec3d{0, 0.5, 1});
  const Vec3d behind_face = normalize(Vec3d{0, 1, -0.1}),
              behind_normal = normalize(Vec3d{0, -1, 0.1});
  SurfacePoint<double> point{{0, 0, 1}, n, cases::direction(0.6), false};
  Principled<double> m;
  m.metallic = 1;
  const PrincipledBsdf<double> interpolated(m, Flavour{}, point);
  EXPECT_GT(interpolated.value(normalize(Vec3d{-0.5, 0.3, 0.6})).g, 0);
  EXPECT_GT(interpolated.value(behind_face).g, 0);
  EXPECT_EQ(interpolated.value(behind_normal).g, 0);
  point.smooth = {0, 0, 1};
  const PrincipledBsdf<double> bent(m, Flavour{}, point);
  EXPECT_EQ(bent.value(behind_face).g, 0);
  EXPECT_EQ(bent.value(behind_normal).g, 0);
}

}  // namespace
}  // namespace selenite
