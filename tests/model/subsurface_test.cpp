// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/subsurface.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "model/bsdf.h"

namespace selenite {
namespace {

using Medium = SubsurfaceMedium<double>;

TEST(Subsurface, AlbedoInversionIsThatOfCycles) {
  // docs/method/rendering.md
  EXPECT_NEAR(Medium::invert(0.2, 0.0), 0.6134, 5e-5);
  EXPECT_NEAR(Medium::invert(0.5, 0.0), 0.9137, 5e-5);
  EXPECT_NEAR(Medium::invert(0.9, 0.0), 0.9992, 5e-5);
  EXPECT_EQ(Medium::invert(0.0, 0.0), 0);
}

class AlbedoInversion : public testing::TestWithParam<double> {};

TEST_P(AlbedoInversion, GrowsWithTheColourAndItsDerivativesAreDifferences) {
  const double g = GetParam();
  using D = Dual<double, 2>;
  double before = 0;
  for (double color = 0.01; color < 0.96; color += 0.05) {
    const D a = SubsurfaceMedium<D>::invert(D::variable(color, 0), D::variable(g, 1));
    if (before < 0.999999) {
      EXPECT_GT(a.v, before) << color;
    }
    before = a.v;
    const double h = 1e-6;
    EXPECT_NEAR(a.d[0], (Medium::invert(color + h, g) - Medium::invert(color - h, g)) / (2 * h),
                1e-5 * std::abs(a.d[0]) + 1e-8);
    EXPECT_NEAR(a.d[1], (Medium::invert(color, g + h) - Medium::invert(color, g - h)) / (2 * h),
                1e-4 * std::abs(a.d[1]) + 1e-6);
  }
}
INSTANTIATE_TEST_SUITE_P(Anisotropies, AlbedoInversion, testing::Values(0.01, 0.3, 0.6, 0.89));

TEST(Subsurface, DipoleAlbedoInvertsTheReflectance) {
  using D = Dual<double, 2>;
  for (double color : {0.01, 0.2, 0.5, 0.8, 0.95}) {
    const auto a = [](double c, double eta) { return dipole_albedo(c, eta); };
    const D got = dipole_albedo(D::variable(color, 0), D::variable(1.4, 1));
    EXPECT_NEAR(got.v, a(color, 1.4), 1e-10);
    const double h = 1e-4;
    EXPECT_NEAR(got.d[0], (a(color + h, 1.4) - a(color - h, 1.4)) / (2 * h), 1e-3 * got.d[0]);
    EXPECT_NEAR(got.d[1], (a(color, 1.4 + h) - a(color, 1.4 - h)) / (2 * h),
                1e-3 * std::abs(got.d[1]) + 1e-6);
  }
}

TEST(Subsurface, FreePathIsTheRadiusOverFourPi) {
  Principled<double> m;
  m.subsurface_radius = {1, 0.5, 0};
  m.subsurface_scale = 2;
  m.subsurface_anisotropy = 0.5;
  const Medium medium(m, Flavour{}, 1.5);
  EXPECT_NEAR(medium.sigma_t.r, 4 * kPi<double> / 2 / 0.5, 1e-9);
  EXPECT_NEAR(medium.sigma_t.g, 4 * kPi<double> / 1 / 0.5, 1e-9);
  EXPECT_EQ(medium.sigma_t.b, 0);
  EXPECT_EQ(medium.entry.b, 0);
}

TEST(Subsurface, DarkColoursKeepTheirAlbedoAndLoseWeight) {
  Principled<double> m;
  m.base_color = {0.01, 0.2, 0};
  const Medium medium(m, Flavour{}, 1.5);
  EXPECT_EQ(medium.albedo.r, 0.2);
  EXPECT_NEAR(medium.entry.r, Medium::invert(0.01, 0.0) / 0.2, 1e-12);
  EXPECT_EQ(medium.entry.g, 1);
  EXPECT_EQ(medium.entry.b, 0);
}

TEST(Subsurface, MediumIsFiniteAtTheEndsOfEveryRange) {
  using D = Dual<float, 5>;
  for (const float color : {0.f, 1e-30f, 1e-6f, 0.5f, 1.f})
    for (const float scale : {0.f, 1e-8f, 1.f, 1e6f})
      for (const float g : {0.f, 1.f})
        for (const float eta : {1.01f, 3.8f})
          for (const auto method :
               {Flavour::Subsurface::kRandomWalk, Flavour::Subsurface::kRandomWalkSkin}) {
            Principled<D> m;
            m.base_color = Color<D>(D::variable(color, 0));
            m.subsurface_radius = Color<D>(D::variable(1, 1));
            m.subsurface_scale = D::variable(scale, 2);
            m.subsurface_anisotropy = D::variable(g, 3);
            const SubsurfaceMedium<D> medium(m, Flavour{.subsurface = method}, D::variable(eta, 4));
            for (const D& x : {medium.entry.g, medium.sigma_t.g, medium.albedo.g}) {
              EXPECT_TRUE(std::isfinite(x.v) && x.v >= 0) << color << " " << scale << " " << g;
              for (const float d : x.d)
                EXPECT_TRUE(std::isfinite(d)) << color << " " << scale << " " << g << " " << eta;
            }
          }
}

TEST(Subsurface, EntryRefractsBySnellsLaw) {
  // A smooth entry has one direction.
  Principled<double> m;
  m.subsurface_weight = 1;
  m.specular_level = 0.5;
  m.roughness = 1e-3;
  m.ior = 1.5;
  const double sine = 0.6;
  const SurfacePoint<double> point{{0, 0, 1}, {0, 0, 1}, {sine, 0, 0.8}, false};
  const PrincipledBsdf<double> bsdf(m, Flavour{}, point);
  int entered = 0;
  for (double u = 0.005; u < 1; u += 0.01) {
    const auto s = bsdf.sample(u, 0.3, 0.4);
    if (!s || !s->enters) continue;
    ++entered;
    EXPECT_NEAR(s->wo.x, -sine / 1.5, 1e-5);
    EXPECT_NEAR(s->wo.y, 0, 1e-5);
    EXPECT_LT(s->wo.z, 0);
  }
  EXPECT_GT(entered, 10);
}

class Entry : public testing::TestWithParam<const char*> {};

TEST_P(Entry, MeanDirectionFollowsTheParameter) {
  // The derivative of a mean over drawn directions, against the difference of such means. Much
  // rougher, the micronormals' end at the horizon would show: 5 % of the slope at roughness 0.5.
  using D = Dual<double, 1>;
  const bool ior = GetParam() == std::string("ior");
  const SurfacePoint<double> point{
      {0, 0, 1}, {0, 0, 1}, {0.95, 0, std::sqrt(1 - 0.95 * 0.95)}, false};
  constexpr int kDraws = 400000;
  const auto draw = [&](double shift, auto&& each) {
    Principled<D> m;
    m.subsurface_weight = D(1);
    m.roughness = D(0.3);
    (ior ? m.ior : m.roughness) = D::variable((ior ? 1.5 : 0.3) + shift, 0);
    const PrincipledBsdf<D> bsdf(m, Flavour{}, point);
    std::mt19937_64 engine(3);
    std::uniform_real_distribution<double> u;
    for (int i = 0; i < kDraws; ++i) {
      const double a = u(engine), b = u(engine), c = u(engine);
      if (const auto s = bsdf.sample(a, b, c); s && s->enters) each(*s);
    }
  };
  const auto mean_z = [&](double shift) {
    double sum = 0, count = 0;
    draw(shift, [&](const auto& s) { sum += s.wo.z, count += 1; });
    return sum / count;
  };
  const double h = 0.05, want = (mean_z(h) - mean_z(-h)) / (2 * h);
  // The weight's own derivative is common to all directions: a covariance leaves it out.
  double z = 0, score = 0, both = 0, squares = 0, count = 0;
  draw(0, [&](const auto& s) {
    const double d = s.weight.g.d[0] / s.weight.g.v;
    z += s.wo.z, score += d, both += s.wo.z * d, squares += d * d, count += 1;
  });
  const double got = both / count - z / count * (score / count);
  EXPECT_LT(std::abs(got - want), 4 * std::sqrt(squares / count) * 0.15 / std::sqrt(count) + 0.005)
      << got << " " << want;
  EXPECT_GT(std::abs(want), 0.03);
}
INSTANTIATE_TEST_SUITE_P(Parameters, Entry, testing::Values("ior", "roughness"),
                         [](const auto& info) { return std::string(info.param); });

}  // namespace
}  // namespace selenite
