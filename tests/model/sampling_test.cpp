// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "model/cases.h"
#include "model/density_check.h"

namespace selenite {
namespace {

using density_check::View;

const std::vector<double> kRoughness{0.02, 0.1, 0.3, 1};
const std::vector<double> kCosines{1, 0.7, 0.3, 0.02};

class Sampling : public testing::TestWithParam<int> {
 protected:
  const cases::Family& family() const { return cases::families()[GetParam()]; }
  // What sampling can reach: the unphysical refractions are no part of its density.
  Flavour flavour{.version = family().version, .evaluate_unphysical_refraction = false};
};

TEST_P(Sampling, DrawsWithTheStatedDensity) {
  const int tests =
      static_cast<int>(cases::families().size() * kRoughness.size() * kCosines.size());
  std::mt19937_64 engine(20 + GetParam());
  for (const double roughness : kRoughness) {
    for (const double cosine : kCosines) {
      SCOPED_TRACE(testing::Message() << "roughness " << roughness << ", cosine " << cosine);
      const Vec3d wi = cases::direction(cosine);
      const auto material = family().material(roughness);
      const PrincipledBsdf<double> bsdf(material, flavour, cases::flat(wi, family().backfacing));
      const double eta = family().backfacing ? 1 / material.ior : material.ior;
      // Seen from low above the horizon, sheen has a peak there, beside the other lobes.
      const bool peaked = family().name == "mixture" && cosine < 0.1;
      density_check::expect_stated_density(
          bsdf, View{wi, eta, roughness, 1, family().name == "sheen", tests, peaked}, engine);
    }
  }
}

TEST_P(Sampling, WeightIsValueOverDensity) {
  std::mt19937_64 engine(40 + GetParam());
  std::uniform_real_distribution<double> u;
  for (const double roughness : {0.1, 0.5, 1.}) {
    for (int i = 0; i < 2000; ++i) {
      const PrincipledBsdf<double> bsdf(
          family().material(roughness), Flavour{.version = family().version},
          cases::flat(cases::direction(u(engine)), family().backfacing));
      const auto s = bsdf.sample(u(engine), u(engine), u(engine));
      if (!s) continue;
      Color<double> f;
      double p = 0;
      bsdf.value_and_density(s->wo, f, p);
      EXPECT_NEAR(length(s->wo), 1, 1e-12);
      EXPECT_NEAR(s->density / p, 1, 1e-6);
      EXPECT_EQ(p, bsdf.density(s->wo));
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(s->weight[c], f[c] / p, 1e-6 * (1 + s->weight[c]));
        EXPECT_EQ(f[c], bsdf.value(s->wo)[c]);
      }
    }
  }
}

TEST_P(Sampling, UnphysicalRefractionOnlyAddsToValueAndDensity) {
  std::mt19937_64 engine(60 + GetParam());
  const Vec3d wi = cases::direction(0.4);
  const auto point = cases::flat(wi, family().backfacing);
  const auto material = family().material(0.6);
  const PrincipledBsdf<double> all(material, Flavour{.version = family().version}, point),
      valid(material, flavour, point);
  int added = 0;
  for (int i = 0; i < 5000; ++i) {
    const Vec3d wo = cases::random_direction(engine);
    EXPECT_GE(all.value(wo).g, valid.value(wo).g);
    EXPECT_GE(all.density(wo), valid.density(wo));
    if (wo.z > 0) {
      EXPECT_EQ(all.value(wo).g, valid.value(wo).g);
    }
    added += all.value(wo).g > valid.value(wo).g;
  }
  EXPECT_EQ(added > 0, material.transmission > 0);
}

INSTANTIATE_TEST_SUITE_P(Families, Sampling,
                         testing::Range(0, static_cast<int>(cases::families().size())),
                         [](const auto& info) { return cases::families()[info.param].name; });

TEST(Singular, MirrorsOfOneDirectionAreDrawnAsOne) {
  Principled<double> m;
  m.roughness = 0, m.metallic = 0.4, m.transmission = 0.5, m.coat_weight = 0.5,
  m.coat_roughness = 0;
  const Vec3d wi = cases::direction(0.6);
  const PrincipledBsdf<double> bsdf(m, Flavour{}, cases::flat(wi, false));
  // Towards a light only the diffuse part is seen.
  EXPECT_NEAR(bsdf.value({-wi.x, -wi.y, wi.z}).g / 0.6, bsdf.value(cases::direction(0.2)).g / 0.2,
              1e-12);
  std::mt19937_64 engine(3);
  std::uniform_real_distribution<double> u;
  double reflected = -1, share = 0;
  int singular = 0, mirrored = 0;
  const int n = 20000;
  for (int i = 0; i < n; ++i) {
    const auto s = bsdf.sample(u(engine), u(engine), u(engine));
    ASSERT_TRUE(s);
    if (!s->singular) continue;
    ++singular;
    if (s->transmits) continue;
    ++mirrored;
    EXPECT_NEAR(length(s->wo - Vec3d{-wi.x, -wi.y, wi.z}), 0, 1e-12);
    if (reflected >= 0) {
      EXPECT_EQ(s->weight.g, reflected);  // whichever mirror was picked
    }
    reflected = s->weight.g;
    share = s->density;
  }
  EXPECT_NEAR(mirrored / static_cast<double>(n), share, 5 * std::sqrt(0.25 / n));
  EXPECT_LT(singular, n);  // the diffuse part remains
}

TEST(Singular, NothingIsLeftForALightSample) {
  Principled<double> m;
  m.transmission = 1, m.roughness = 0;
  const auto point = cases::flat(cases::direction(0.6), false);
  EXPECT_TRUE(PrincipledBsdf<double>(m, Flavour{}, point).all_singular());
  m.roughness = 0.0038;  // Cycles' threshold lies between 0.0037 and 0.0038
  EXPECT_FALSE(PrincipledBsdf<double>(m, Flavour{}, point).all_singular());
  m.roughness = 0.0037, m.transmission = 0.5;
  EXPECT_FALSE(PrincipledBsdf<double>(m, Flavour{}, point).all_singular());
}

TEST(Singular, IndexOneLetsEverythingThrough) {
  // Measured in Cycles: base .25 .36 .49 gives .25 .36 .49 on a sphere, the root per crossing, at any
  // roughness.
  Principled<double> m;
  m.transmission = 1, m.ior = 1, m.base_color = {0.25, 0.36, 0.49};
  for (const double roughness : {0., 0.3, 1.}) {
    m.roughness = roughness;
    const Vec3d wi = cases::direction(0.4);
    const auto s = PrincipledBsdf<double>(m, Flavour{}, cases::flat(wi, false)).sample(.3, .4, .5);
    ASSERT_TRUE(s);
    EXPECT_TRUE(s->singular && s->transmits);
    EXPECT_NEAR(length(s->wo + wi), 0, 1e-12);
    EXPECT_NEAR(s->weight.r, 0.5, 1e-12);
    EXPECT_NEAR(s->weight.g, 0.6, 1e-12);
    EXPECT_NEAR(s->weight.b, 0.7, 1e-12);
  }
}

}  // namespace
}  // namespace selenite
