// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "model/closure_cases.h"
#include "model/density_check.h"

namespace selenite {
namespace {

namespace c = closures;
using cases::Mixture;
using cases::placed;
using Colord = Color<double>;

Color<double> furnace(const SurfaceBsdf<double>& bsdf) {
  const int n = 1 << 14;
  Colord sum(0);
  for (int i = 0; i < n; ++i) {
    const auto turn = [&](double step) { return std::fmod(0.5 + step * (i + 1), 1.); };
    if (const auto s = bsdf.sample(turn(0.8191725134), turn(0.6710436067), turn(0.5497004779)))
      sum += s->weight;
  }
  return sum / static_cast<double>(n);
}

class Mixtures : public testing::TestWithParam<int> {
 protected:
  const cases::MixtureFamily& family() const { return cases::mixture_families()[GetParam()]; }
  SurfacePoint<double> point(double cosine) const {
    return cases::flat(cases::direction(cosine), family().backfacing);
  }
};

TEST_P(Mixtures, AreDrawnWithTheStatedDensity) {
  const std::vector<double> roughnesses{0.1, 0.3, 1}, cosines{1, 0.9, 0.5, 0.1};
  std::mt19937_64 engine(120 + GetParam());
  const int count =
      static_cast<int>(cases::mixture_families().size() * roughnesses.size() * cosines.size());
  for (const double roughness : roughnesses)
    for (const double cosine : cosines) {
      if (cosine < family().grazing) continue;
      SCOPED_TRACE(testing::Message() << "roughness " << roughness << ", cosine " << cosine);
      const Mixture mixture = family().make(roughness);
      const SurfaceBsdf<double> bsdf(mixture, point(cosine));
      const double eta = family().backfacing ? 1 / family().ior : family().ior;
      density_check::expect_stated_density(
          bsdf,
          {cases::direction(cosine), eta, roughness,
           cosine < 0.3 && roughness == 1 && !family().low ? 4 : 1, family().low, count},
          engine);
    }
}

TEST_P(Mixtures, WeightIsValueOverDensity) {
  std::mt19937_64 engine(140 + GetParam());
  std::uniform_real_distribution<double> u;
  int drawn = 0;
  for (const double roughness : {0.1, 0.5, 1.}) {
    const Mixture mixture = family().make(roughness);
    for (int i = 0; i < 1000; ++i) {
      const SurfaceBsdf<double> bsdf(mixture, point(u(engine)));
      const auto s = bsdf.sample(u(engine), u(engine), u(engine));
      if (!s) continue;
      ++drawn;
      Colord f;
      double p = 0;
      bsdf.value_and_density(s->wo, f, p);
      EXPECT_NEAR(s->density / p, 1, 1e-6);
      for (int k = 0; k < 3; ++k) EXPECT_NEAR(s->weight[k], f[k] / p, 1e-6 * (1 + s->weight[k]));
    }
  }
  EXPECT_GT(drawn, 500);
}

TEST_P(Mixtures, GainNoEnergy) {
  for (const double roughness : {0., 0.1, 0.3, 0.6, 1.})
    for (const double cosine : {1., 0.5, 0.1}) {
      const Mixture mixture = family().make(roughness);
      // See Furnace.GainsNoEnergy for what interpolated albedos add near grazing.
      EXPECT_LE(max_channel(furnace(SurfaceBsdf<double>(mixture, point(cosine)))),
                1 + (cosine < 0.3 ? 0.012 : 2e-3))
          << roughness << " " << cosine;
    }
}

INSTANTIATE_TEST_SUITE_P(Families, Mixtures,
                         testing::Range(0, static_cast<int>(cases::mixture_families().size())),
                         [](const auto& info) {
                           return cases::mixture_families()[info.param].name;
                         });

/// One closure alone.
Colord value(const Closure<double>& closure, const Vec3d& wi, const Vec3d& wo,
             Flavour::Distribution distribution = Flavour::Distribution::kMultiGgx) {
  Mixture one{placed(closure)};
  one[0].flavour.distribution = distribution;
  return SurfaceBsdf<double>(one, cases::flat(wi, false)).value(wo);
}
const Vec3d kView = cases::direction(0.6), kLight = cases::direction(0.7, 2.5);

TEST(Closures, PrincipledAloneIsThePrincipledBsdf) {
  std::mt19937_64 engine(5);
  std::uniform_real_distribution<double> u;
  for (int i = 0; i < 500; ++i) {
    const auto material = cases::random_material(engine);
    const auto point = cases::flat(cases::direction(0.05 + 0.95 * u(engine)), u(engine) < 0.5);
    const Vec3d wo = cases::random_direction(engine);
    const PrincipledBsdf<double> want(material, Flavour{.evaluate_unphysical_refraction = false},
                                      point);
    const Mixture one{placed(material)};
    const SurfaceBsdf<double> got(one, point);
    EXPECT_EQ(got.value(wo), want.value(wo));
    EXPECT_NEAR(got.density(wo), want.density(wo), 1e-12 * (1 + want.density(wo)));
    EXPECT_EQ(got.emission(), want.emission());
    EXPECT_EQ(got.transparency(), want.transparency());
    EXPECT_EQ(got.all_singular(), want.all_singular());
  }
}

TEST(Closures, MixtureIsTheWeightedSum) {
  const c::Diffuse<double> diffuse{{.9, .5, .2}, .3};
  const c::Glossy<double> glossy{{.3, .6, .9}, .5};
  Principled<double> principled;
  principled.coat_weight = 0.5, principled.emission_strength = 2, principled.alpha = 0.5;
  const Mixture mixture{placed(diffuse, .2), placed(glossy, .3), placed(principled, .5)};
  const SurfaceBsdf<double> bsdf(mixture, cases::flat(kView, false));
  const Colord got = bsdf.value(kLight), of_diffuse = value(diffuse, kView, kLight),
               of_glossy = value(glossy, kView, kLight),
               of_principled = value(principled, kView, kLight);
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(got[k], .2 * of_diffuse[k] + .3 * of_glossy[k] + .5 * of_principled[k], 1e-14);
  EXPECT_NEAR(bsdf.transparency().g, 0.25, 1e-15);
  const Mixture alone{placed(principled)};
  EXPECT_NEAR(bsdf.emission().g,
              0.5 * SurfaceBsdf<double>(alone, cases::flat(kView, false)).emission().g, 1e-15);
}

TEST(Closures, DiffuseIsTheDiffuseLobeOfThePrincipled) {
  Principled<double> m;
  m.specular_level = 0, m.base_color = {.9, .5, .2}, m.diffuse_roughness = 0.4;
  const Colord want = value(m, kView, kLight),
               got = value(c::Diffuse<double>{{.9, .5, .2}, .4}, kView, kLight);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(got[k], want[k], 1e-15);
  EXPECT_NEAR(value(c::Diffuse<double>{{.9, .5, .2}, 0}, kView, kLight).g, 0.5 * 0.7 / kPi<double>,
              1e-15);
}

TEST(Closures, MetallicIsTheMetalOfThePrincipled) {
  Principled<double> m;
  m.metallic = 1, m.base_color = {.9, .5, .2}, m.specular_tint = {.4, .8, 1}, m.roughness = 0.4;
  const Colord want = value(m, kView, kLight),
               got = value(c::Metallic<double>{{.9, .5, .2}, {.4, .8, 1}, .4}, kView, kLight);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(got[k], want[k], 1e-14);
}

TEST(Closures, AnisotropyOfThePrincipledIsThatOfMetallic) {
  c::FullPrincipled<double> m;
  m.metallic = 1, m.base_color = {.9, .5, .2}, m.specular_tint = {.4, .8, 1};
  for (const auto& [roughness, anisotropic] : {std::pair{.4, .6}, {.9, .9}, {.3, 1.}}) {
    m.roughness = roughness, m.anisotropic = anisotropic;
    const c::Metallic<double> metal{{.9, .5, .2}, {.4, .8, 1}, roughness, anisotropic};
    const Mixture of_principled = cases::of(Flavour::Distribution::kMultiGgx, m, {1, 2, .3}),
                  of_metal = cases::of(Flavour::Distribution::kMultiGgx, metal, {1, 2, .3});
    const auto at = cases::flat(kView, false);
    const Colord want = SurfaceBsdf<double>(of_metal, at).value(kLight),
                 got = SurfaceBsdf<double>(of_principled, at).value(kLight);
    EXPECT_GT(want.g, 0);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(got[k], want[k], 1e-13 * want[k]);
  }
}

TEST(Closures, AnisotropyLeavesGlassAndCoatAlone) {
  c::FullPrincipled<double> m;
  m.transmission = 1, m.roughness = 0.4, m.coat_weight = 1, m.coat_roughness = 0.3;
  const Mixture round = cases::of(Flavour::Distribution::kMultiGgx, m, {1, 2, 0});
  m.anisotropic = 0.9;
  const Mixture stretched = cases::of(Flavour::Distribution::kMultiGgx, m, {1, 2, 0});
  const auto at = cases::flat(kView, false);
  for (const Vec3d& wo : {kLight, cases::direction(0.5, -2), cases::direction(-0.8, 3)}) {
    const Colord want = SurfaceBsdf<double>(round, at).value(wo),
                 got = SurfaceBsdf<double>(stretched, at).value(wo);
    EXPECT_GT(want.g, 0);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(got[k], want[k], 1e-12 * want[k]);
  }
}

TEST(Closures, WhiteGlassIsTheGlassOfThePrincipled) {
  Principled<double> m;
  m.transmission = 1, m.base_color = Colord(1), m.roughness = 0.4;
  for (const Vec3d& wo : {kLight, cases::direction(-0.8, 3)}) {
    const Colord want = value(m, kView, wo),
                 got = value(c::Glass<double>{Colord(1), .4, 1.5}, kView, wo);
    EXPECT_GT(want.g, 0);
    EXPECT_NEAR(got.g, want.g, 1e-14);
  }
}

TEST(Closures, ColourOfGlassMultipliesBothSides) {
  const auto single = Flavour::Distribution::kGgx;
  for (const Vec3d& wo : {kLight, cases::direction(-0.8, 3)}) {
    const Colord white = value(c::Glass<double>{Colord(1), .4, 1.5}, kView, wo, single),
                 red = value(c::Glass<double>{{1, .5, .25}, .4, 1.5}, kView, wo, single);
    EXPECT_NEAR(red.g, 0.5 * white.g, 1e-15);
    EXPECT_NEAR(red.b, 0.25 * white.b, 1e-15);
  }
}

TEST(Closures, RefractionIsGlassWithoutItsFresnelTerm) {
  const auto single = Flavour::Distribution::kGgx;
  const Vec3d wo = cases::direction(-0.8, 3);
  const Colord glass = value(c::Glass<double>{Colord(1), .4, 1.5}, kView, wo, single),
               bare = value(c::Refraction<double>{Colord(1), .4, 1.5}, kView, wo, single);
  const Refraction<double> g(kView, wo, 1.5, nullptr);
  EXPECT_NEAR(glass.g, bare.g * (1 - fresnel_dielectric(g.cos_m, 1.25)), 1e-14);
  EXPECT_EQ(value(c::Refraction<double>{Colord(1), .4, 1.5}, kView, kLight).g, 0);
}

TEST(Closures, RefractionReflectsNothingInside) {
  Mixture one{placed(c::Refraction<double>{Colord(1), 0, 1.5})};
  // sin 0.8 / eta: beyond the critical angle of 42 degrees everything is lost.
  const SurfaceBsdf<double> beyond(one, cases::flat(cases::direction(0.6), true)),
      before(one, cases::flat(cases::direction(0.9), true));
  EXPECT_FALSE(beyond.sample(.3, .4, .5));
  const auto s = before.sample(.3, .4, .5);
  ASSERT_TRUE(s);
  EXPECT_TRUE(s->singular && s->transmits);
  EXPECT_NEAR(s->weight.g, 1, 1e-12);
}

TEST(Closures, GlossyReflectsItsColourFromAPerfectMirror) {
  Mixture one{placed(c::Glossy<double>{{.9, .5, .2}, 0})};
  const SurfaceBsdf<double> bsdf(one, cases::flat(kView, false));
  EXPECT_TRUE(bsdf.all_singular());
  const auto s = bsdf.sample(.3, .4, .5);
  ASSERT_TRUE(s);
  EXPECT_TRUE(s->singular && !s->transmits);
  EXPECT_NEAR(length(s->wo - Vec3d{-kView.x, -kView.y, kView.z}), 0, 1e-12);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(s->weight[k], (Colord{.9, .5, .2})[k], 1e-12);
}

TEST(Closures, WhiteRoughReflectionLosesNothing) {
  for (const double roughness : {0.3, 0.7, 1.})
    for (const double cosine : {0.3, 0.9}) {
      Mixture one{placed(c::Glossy<double>{Colord(1), roughness})};
      EXPECT_NEAR(furnace(SurfaceBsdf<double>(one, cases::flat(cases::direction(cosine), false))).g,
                  1, 3e-3);
      one[0].flavour.distribution = Flavour::Distribution::kGgx;
      EXPECT_LT(furnace(SurfaceBsdf<double>(one, cases::flat(cases::direction(cosine), false))).g,
                0.995);
    }
}

TEST(Closures, ConductorReflectsByItsComplexIndex) {
  const Colord n{.2, 2.5, 1}, k{3.9, 3, 0.5};
  Mixture one{placed(c::Conductor<double>{n, k, 0})};
  const auto s = SurfaceBsdf<double>(one, cases::flat({0, 0, 1}, false)).sample(.3, .4, .5);
  ASSERT_TRUE(s);
  for (int i = 0; i < 3; ++i)
    EXPECT_NEAR(s->weight[i],
                ((n[i] - 1) * (n[i] - 1) + k[i] * k[i]) / ((n[i] + 1) * (n[i] + 1) + k[i] * k[i]),
                1e-12);
}

TEST(Closures, TranslucentSendsItsColourToTheFarSide) {
  const c::Translucent<double> leaf{{.9, .5, .2}};
  EXPECT_EQ(value(leaf, kView, kLight).g, 0);
  EXPECT_NEAR(value(leaf, kView, cases::direction(-0.7, 2.5)).g, 0.5 * 0.7 / kPi<double>, 1e-15);
  Mixture one{placed(leaf)};
  const SurfaceBsdf<double> bsdf(one, cases::flat(kView, false));
  const auto s = bsdf.sample(.3, .4, .5);
  ASSERT_TRUE(s);
  EXPECT_TRUE(s->transmits && s->diffuse && !s->enters);
  EXPECT_EQ(s->kind(), kTransmissionRay);
  EXPECT_NEAR(furnace(bsdf).g, 0.5, 1e-12);
  EXPECT_EQ(bsdf.seen_by(kGlossyRay).value(cases::direction(-0.7)).g, 0);
}

TEST(Closures, EmissionAndTransparencyAddUp) {
  const Mixture mixture{placed(c::Emission<double>{{1, .5, .25}, 4}, .5),
                        placed(c::Emission<double>{Colord(1), 1}, .25),
                        placed(c::Transparent<double>{{1, .5, .25}}, .25)};
  const SurfaceBsdf<double> bsdf(mixture, cases::flat(kView, false));
  EXPECT_NEAR(bsdf.emission().g, 1.25, 1e-15);
  EXPECT_NEAR(bsdf.transparency().b, 0.0625, 1e-15);
  EXPECT_TRUE(bsdf.all_singular());
  EXPECT_FALSE(bsdf.sample(.3, .4, .5));
  EXPECT_EQ(bsdf.pass_probability(), 1);
}

TEST(Closures, PassingLeavesAShareToWhatIsAddedToTransparency) {
  const Mixture both{placed(c::Transparent<double>{Colord(1)}),
                     placed(c::Diffuse<double>{Colord(.5), 0})};
  const double p = SurfaceBsdf<double>(both, cases::flat(kView, false)).pass_probability();
  EXPECT_NEAR(p, 2. / 3, 1e-12);
}

TEST(Closures, SubsurfaceEntersWithItsOwnWalk) {
  c::Subsurface<double> m;
  m.color = {.9, .5, .2}, m.radius = {1, .5, 0}, m.scale = 0.1, m.anisotropy = 0.3;
  const Mixture mixture{placed(c::Diffuse<double>{Colord(.2), 0}, .5), placed(m, .5)};
  const SurfaceBsdf<double> bsdf(mixture, cases::flat(kView, false));
  std::mt19937_64 engine(6);
  std::uniform_real_distribution<double> u;
  Colord entered(0);
  const int n = 20000;
  for (int i = 0; i < n; ++i) {
    const auto s = bsdf.sample(u(engine), u(engine), u(engine));
    if (!s || !s->enters) continue;
    EXPECT_LT(s->wo.z, 0);
    entered += s->weight;
    const auto medium = bsdf.medium(*s);
    EXPECT_EQ(medium.sigma_t.b, 0);
    EXPECT_NEAR(medium.sigma_t.r * 2, medium.sigma_t.g, 1e-12);
    EXPECT_EQ(medium.anisotropy, 0.3);
  }
  // The mix weight, without the colour; the blue channel is reflected diffusely.
  EXPECT_NEAR(entered.r / n, 0.5, 0.02);
  EXPECT_EQ(entered.b, 0);
  EXPECT_NEAR(bsdf.value(kLight).b, (0.5 * 0.2 + 0.5 * 0.2) * 0.7 / kPi<double>, 1e-14);
  const SurfacePoint<double> after{{0, 0, 1}, {0, 0, 1}, kView, false, true};
  EXPECT_NEAR(SurfaceBsdf<double>(mixture, after).value(kLight).r,
              (0.5 * 0.2 + 0.5 * 0.9) * 0.7 / kPi<double>, 1e-14);
}

TEST(Closures, EachHasItsOwnNormal) {
  const Vec3d n = normalize(Vec3d{.2, .1, 1});
  const c::Diffuse<double> diffuse{{.8, .3, .1}, 0};
  const c::Metallic<double> metal{{.5, .6, .7}, Colord(1), .4};
  const Mixture mixture{placed(diffuse, .7), placed(metal, .3, n)};
  const auto point = cases::flat(kView, false);
  const SurfaceBsdf<double> bsdf(mixture, point);
  std::mt19937_64 engine(8);
  std::uniform_real_distribution<double> u;
  int compared = 0;
  for (int i = 0; i < 1000; ++i) {
    const auto s = bsdf.sample(u(engine), u(engine), u(engine));
    if (!s || dot(n, s->wo) <= 0) continue;
    Colord f;
    double p = 0;
    bsdf.value_and_density(s->wo, f, p);
    EXPECT_NEAR(s->density / p, 1, 1e-6);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(s->weight[k], f[k] / p, 1e-6 * (1 + s->weight[k]));
    // The metal's is that of a surface with this normal.
    const PrincipledBsdf<double> tilted(
        [&] {
          Principled<double> m;
          m.metallic = 1, m.base_color = {.5, .6, .7}, m.roughness = .4;
          return m;
        }(),
        Flavour{}, {point.ng, n, point.wi, false, false, {}, point.n});
    EXPECT_NEAR(f.g, .7 * .3 * s->wo.z / kPi<double> + .3 * tilted.value(s->wo).g, 1e-12);
    ++compared;
  }
  EXPECT_GT(compared, 900);
}

TEST(Closures, LightIsOnTheSideOfTheInterpolatedNormal) {
  const Vec3d n = normalize(Vec3d{.75, 0, 1}), face{0, 0, 1};
  const Mixture smooth{placed(c::Glossy<double>{Colord(1), .6}, 1, n)};
  const auto value = [&](const Vec3d& interpolated, const Vec3d& wo) {
    return SurfaceBsdf<double>(smooth, {face, interpolated, kView, false}).value(wo).g;
  };
  const Vec3d behind_face = normalize(Vec3d{1, 0, -.2}), before_both = normalize(Vec3d{1, 0, .2});
  EXPECT_GT(value(n, behind_face), 0.02);
  EXPECT_EQ(value(face, behind_face), 0);  // the normal is that of a bump
  EXPECT_GT(value(face, before_both), 0.1);
  EXPECT_EQ(value(face, before_both), value(n, before_both));
}

TEST(Closures, BumpedDiffuseEndsSoftlyWhereTheSurfaceTurnsAway) {
  const Vec3d n = normalize(Vec3d{0.6, 0, 1});
  const Mixture one{placed(c::Diffuse<double>{Colord(1), 0}, 1, n)};
  const SurfaceBsdf<double> bsdf(one, cases::flat({0, 0, 1}, false));
  const auto share = [&](const Vec3d& wo) { return bsdf.value(wo).g / (dot(n, wo) / kPi<double>); };
  EXPECT_GT(share({0, 0, 1}), 0.999);
  const double mid = share(normalize(Vec3d{1, 0, 0.5})), low = share(normalize(Vec3d{1, 0, 0.02}));
  EXPECT_LT(mid, 1);
  EXPECT_LT(low, 0.5);
  EXPECT_GT(low, 0);
  EXPECT_NEAR(bsdf.value(normalize(Vec3d{1, 0, -0.1})).g, 0, 1e-15);
  // At tan^2 = 0.36, width^2 0.045: 1 / (1 + Lambda) with tan of the light 2.
  EXPECT_NEAR(mid, 2 / (1 + std::sqrt(1 + 0.045 * 4)), 1e-9);
}

}  // namespace
}  // namespace selenite
