// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <functional>

#include "model/cases.h"
#include "model/refraction.h"

// Dual numbers against finite differences of the values, for every parameter that `fields` lists: a
// new field is tested the day it is added.
namespace selenite {
namespace {

using D = Dual<double, 1>;

/// A scalar of the material: a parameter, or channel `channel` of a colour (all three at once if -1).
struct Entry {
  Parameter parameter;
  int index, channel;

  std::string name() const {
    return std::string(parameter.name) + (channel < 0 ? "" : std::string("_") + "rgb"[channel]);
  }
  /// Puts x into the entry, with derivative 1.
  void put(Principled<D>& m, double x) const {
    int k = 0;
    Principled<D>::fields(m, [&](const Parameter&, auto& member) {
      if (k++ != index) return;
      if constexpr (requires { member.r; }) {
        for (int c = 0; c < 3; ++c)
          if (channel < 0 || channel == c) member[c] = D::variable(x, 0);
      } else {
        member = D::variable(x, 0);
      }
    });
  }
};

std::vector<Entry> entries() {
  std::vector<Entry> all;
  Principled<D> m;
  int k = 0;
  Principled<D>::fields(m, [&](const Parameter& p, const auto& member) {
    constexpr bool colour = requires { member.r; };
    if (colour && !p.diagonal) {
      for (int c = 0; c < 3; ++c) all.push_back({p, k, c});
    } else {
      all.push_back({p, k, -1});
    }
    ++k;
  });
  return all;
}

struct Place {
  const char* name;
  double (*in)(const Parameter& p);
};
const Place kPlaces[] = {
    {"lower", [](const Parameter& p) { return p.lower; }},
    {"upper", [](const Parameter& p) { return p.upper; }},
    {"fit_lower", [](const Parameter& p) { return p.fit_lower; }},
    {"fit_upper", [](const Parameter& p) { return p.fit_upper; }},
    {"inside", [](const Parameter& p) { return 0.63 * p.fit_lower + 0.37 * p.fit_upper; }},
};

/// Everything a light path reads off the BSDF, with its derivative.
std::array<D, 9> outputs(const Principled<D>& m, const Flavour& flavour,
                         const SurfacePoint<double>& point, const Vec3d& wo) {
  const PrincipledBsdf<D> bsdf(m, flavour, point);
  const Color<D> f = bsdf.value(wo), e = bsdf.emission(), t = bsdf.transparency();
  return {f.r, f.g, f.b, e.r, e.g, e.b, t.r, t.g, t.b};
}

class FiniteDifference : public testing::TestWithParam<int> {};

TEST_P(FiniteDifference, AgreesWithDual) {
  const Entry entry = entries()[GetParam()];
  const Parameter& p = entry.parameter;
  for (const Place& place : kPlaces) {
    SCOPED_TRACE(place.name);
    const double x = place.in(p);
    std::mt19937_64 engine(7);
    std::uniform_real_distribution<double> u;
    int agreed = 0, kinks = 0, moved = 0;
    for (int i = 0; i < 400; ++i) {
      auto material = lift<D>(cases::random_material(engine));
      const Flavour flavour{
          .distribution = i % 2 ? Flavour::Distribution::kMultiGgx : Flavour::Distribution::kGgx,
          .version =
              i % 4 && p.versions != Versions::k1 ? Flavour::Version::kV2 : Flavour::Version::kV1};
      const auto point = cases::flat(cases::direction(0.05 + 0.95 * u(engine)), u(engine) < 0.5);
      const Vec3d wo = cases::random_direction(engine);
      const auto at = [&](double value) {
        entry.put(material, value);
        return outputs(material, flavour, point, wo);
      };
      const auto here = at(x);
      // Second-order differences that stay inside the range, at two steps: where they disagree there
      // is a kink (a clamp, a node of a table, the largest channel changes) or an infinite slope.
      const double side = x <= p.lower ? 1 : x >= p.upper ? -1 : 0;
      const auto difference = [&](double h) {
        std::array<double, 9> slope{};
        const auto a = at(side == 0 ? x - h : x + side * h);
        const auto b = at(side == 0 ? x + h : x + 2 * side * h);
        for (int k = 0; k < 9; ++k)
          slope[k] = side == 0 ? (b[k].v - a[k].v) / (2 * h)
                               : side * (4 * a[k].v - 3 * here[k].v - b[k].v) / (2 * h);
        return slope;
      };
      const double h = 1e-6 * std::max(1., std::abs(x));
      const auto coarse = difference(h), fine = difference(h / 4);
      for (int k = 0; k < 9; ++k) {
        ASSERT_TRUE(std::isfinite(here[k].v));
        ASSERT_TRUE(std::isfinite(here[k].d[0])) << "output " << k;
        const double scale = std::abs(fine[k]) + std::abs(coarse[k]);
        const double rounding = 4e-15 * std::abs(here[k].v) / (h / 4);
        if (std::abs(fine[k] - coarse[k]) > 1e-5 * scale + rounding) {
          ++kinks;
          continue;
        }
        EXPECT_NEAR(here[k].d[0], fine[k], 2e-5 * scale + 10 * rounding + 1e-8)
            << entry.name() << " = " << x << ", output " << k << ", case " << i;
        ++agreed;
        moved += std::abs(fine[k]) > 1e-6;
      }
    }
    // The test did test something; where a root or a power begins, most slopes are infinite.
    const bool begins = (x == 1 && p.scale == Scale::kLogExcess) ||
                        (x == 0 && (p.name == "specular_level" || p.name == "coat_tint"));
    EXPECT_GT(agreed, begins ? 1500 : 2900) << kinks << " kinks";
    // The walk under the surface begins where the BSDF ends: subsurface_test.cpp of model and render.
    const bool walk = p.name.starts_with("subsurface_") && p.name != "subsurface_weight";
    const bool clamped = x == 0 && p.name == "sheen_roughness";  // Cycles starts at 0.001
    if (!begins && !walk && !clamped) {
      EXPECT_GT(moved, 90);
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Fields, FiniteDifference,
                         testing::Range(0, static_cast<int>(entries().size())),
                         [](const auto& info) { return entries()[info.param].name(); });

/// Slope of the green channel by whatever `seed` seeds, at the black end or another bound.
struct AtABound : testing::Test {
  Principled<D> m = lift<D>(Principled<double>{});
  Vec3d wi = cases::direction(0.6), wo = cases::direction(0.7, 2.5);
  static D on(double value) { return D::variable(value, 0); }
  PrincipledBsdf<D> bsdf(bool inside = false) const {
    return {m, Flavour{.evaluate_unphysical_refraction = false}, cases::flat(wi, inside)};
  }
  /// What sampling finds of the slope of a white furnace, against the difference of the furnace.
  static double furnace(const PrincipledBsdf<D>& b, double D::*value, std::size_t slot) {
    const int n = 1 << 15;
    double sum = 0;
    for (int i = 0; i < n; ++i) {
      const auto turn = [&](double step) { return std::fmod(0.5 + step * (i + 1), 1.); };
      const auto s = b.sample(turn(0.8191725134), turn(0.6710436067), turn(0.5497004779));
      if (s) sum += value ? s->weight.g.*value : s->weight.g.d[slot];
    }
    return sum / n;
  }
  /// `set` writes the parameter; the furnace's slope by sampling at `bound` must be that of the
  /// values at bound and bound + step.
  void expect_sampled_slope(const std::function<void(D)>& set, double bound, double step,
                            double tolerance) {
    set(on(bound));
    const double slope = furnace(bsdf(), nullptr, 0), here = furnace(bsdf(), &D::v, 0);
    set(on(bound + step));
    const double there = furnace(bsdf(), &D::v, 0);
    EXPECT_NEAR(slope, (there - here) / step, tolerance);
    EXPECT_GT(std::abs(slope), 5 * tolerance);
  }
};

TEST_F(AtABound, SlopeSurvivesZeroTransmission) {
  m.roughness = 0.4;
  m.transmission = on(0);
  const Vec3d below = cases::direction(-0.8, 0.3 + kPi<double>);
  EXPECT_EQ(bsdf().value(below).g.v, 0);
  EXPECT_GT(bsdf().value(below).g.d[0], 0.1);
  EXPECT_GT(bsdf().density(below), 0.01);
  expect_sampled_slope([&](D x) { m.transmission = x; }, 0, 0.05, 0.01);
}

TEST_F(AtABound, SlopeSurvivesZeroMetallic) {
  m.base_color = Color<D>(D(0.3));
  m.metallic = on(0);
  const Vec3d mirror{-wi.x, -wi.y, wi.z};
  EXPECT_GT(bsdf().value(mirror).g.d[0], 0.1);
  m.specular_tint = Color<D>(D(0));
  expect_sampled_slope([&](D x) { m.metallic = x; }, 0, 0.05, 0.002);
}

TEST_F(AtABound, SlopeSurvivesBlackBase) {
  m.base_color = Color<D>(on(0));
  EXPECT_GT(bsdf().value(wo).g.d[0], 0.1);
  EXPECT_LT(bsdf().value(wo).g.v, 0.02);
  expect_sampled_slope([&](D x) { m.base_color = Color<D>(x); }, 0, 0.1, 0.02);
}

TEST_F(AtABound, SlopeSurvivesZeroCoat) {
  m.base_color = Color<D>(D(0));
  m.coat_weight = on(0);
  m.coat_roughness = D(0.3);
  expect_sampled_slope([&](D x) { m.coat_weight = x; }, 0, 0.1, 0.005);
}

TEST_F(AtABound, SlopeSurvivesZeroSheen) {
  m.base_color = Color<D>(D(0));
  m.sheen_weight = on(0);
  EXPECT_GT(bsdf().value(wo).g.d[0], 0.01);
  EXPECT_GT(bsdf().density(wo), 0.01);
  expect_sampled_slope([&](D x) { m.sheen_weight = x; }, 0, 0.1, 0.005);
}

TEST_F(AtABound, SlopeSurvivesZeroAlpha) {
  m.alpha = on(0);
  EXPECT_EQ(bsdf().value(wo).g.v, 0);
  EXPECT_GT(bsdf().value(wo).g.d[0], 0.05);
  EXPECT_EQ(bsdf().transparency().g.d[0], -1);
  expect_sampled_slope([&](D x) { m.alpha = x; }, 0, 0.1, 0.01);
}

TEST_F(AtABound, SlopeSurvivesZeroSpecularLevel) {
  // Pointwise: the integral over all directions has no slope there, grazing micronormals see to that.
  m.base_color = Color<D>(D(0));
  for (const Vec3d& w : {Vec3d{-wi.x, -wi.y, wi.z}, wo, cases::direction(0.2, 3.4)}) {
    m.specular_level = on(0);
    const D f = bsdf().value(w).g;
    EXPECT_LT(f.v, 1e-6);
    EXPECT_GT(f.d[0], 1e-4);
    EXPECT_GT(bsdf().density(w), 1e-3);
    // Both sides of the least amplitude; the curve bends a little.
    for (const double level : {1e-8, 1e-7, 1e-6, 1e-5}) {
      m.specular_level = on(level);
      EXPECT_NEAR(bsdf().value(w).g.d[0] / f.d[0], 1, 0.05);
      m.specular_level = D(level);  // no derivative: no floor
      EXPECT_NEAR(bsdf().value(w).g.v / (level * f.d[0]), 1, 0.05);
    }
  }
}

TEST_F(AtABound, SlopeSurvivesZeroEmission) {
  m.emission_strength = on(0);
  EXPECT_EQ(bsdf().emission().g.v, 0);
  EXPECT_EQ(bsdf().emission().g.d[0], 1);
}

TEST_F(AtABound, BlackGlassHasAFiniteSlope) {
  // The tint is the root of the base colour: the true slope is infinite.
  m.transmission = D(1);
  m.base_color = Color<D>(on(0));
  for (const double c : {-0.9, -0.3, 0.5}) {
    const D f = bsdf(true).value(cases::direction(c, 3)).g;
    EXPECT_TRUE(std::isfinite(f.v) && std::isfinite(f.d[0]));
  }
}

TEST_F(AtABound, MirrorCarriesTheSlopeOfItsFresnelTerm) {
  m.roughness = D(0);
  m.transmission = D(1);
  m.ior = on(1.5);
  const double h = 1e-6;
  for (const double u : {0.001, 0.999}) {
    m.ior = on(1.5);
    const auto s = bsdf().sample(u, 0.5, 0.5);
    ASSERT_TRUE(s && s->singular);
    EXPECT_EQ(s->transmits, u > 0.5);
    const D f = s->weight.g * s->density;
    m.ior = on(1.5 + h);
    const auto t = bsdf().sample(u, 0.5, 0.5);
    EXPECT_NEAR(f.d[0], ((t->weight.g * t->density).v - f.v) / h, 1e-4);
    EXPECT_NE(f.d[0], 0);
  }
}

TEST(Dual, ValuesAreThoseOfPlainNumbers) {
  int fields = 0;
  const Principled<double> any;
  Principled<double>::fields(any, [&](const Parameter&, const auto&) { ++fields; });
  std::mt19937_64 engine(9);
  std::uniform_real_distribution<double> u;
  for (int i = 0; i < 3000; ++i) {
    const auto material = cases::random_material(engine);
    if (material.base_color.g == 0) continue;  // black glass is a special case of plain numbers
    const auto point = cases::flat(cases::direction(u(engine)), u(engine) < 0.5);
    const Vec3d wo = cases::random_direction(engine);
    auto seeded = lift<D>(material);
    int k = 0;
    Principled<D>::fields(seeded, [&](const Parameter&, auto& member) {
      if (k++ != i % fields) return;
      if constexpr (requires { member.r; }) {
        for (int c = 0; c < 3; ++c) member[c].d[0] = 1;
      } else {
        member.d[0] = 1;
      }
    });
    const double want = PrincipledBsdf<double>(material, Flavour{}, point).value(wo).g;
    EXPECT_NEAR(PrincipledBsdf<D>(seeded, Flavour{}, point).value(wo).g.v, want,
                1e-12 * (1 + want));
  }
}

// The half vector wi + eta wo nearly cancels: with derivatives from its rounded sum, rough glass of
// IOR 1.0002 had one of -0.037 by log(IOR - 1) in the mean of a picture, where there is none.
TEST(Derivatives, OfARefractionNearOneAreRightInSinglePrecision) {
  std::mt19937_64 engine(7);
  std::uniform_real_distribution<double> u;
  const auto single = [](const Vec3d& v) {
    return Vec3<float>(static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z));
  };
  for (const double eta : {1.0002, 1.001, 1.01, 1.5})
    for (int i = 0; i < 1000; ++i) {
      const double rise = 0.1 * u(engine), turn = 6.283 * u(engine);
      const Vec3d m = normalize(Vec3d(rise * std::cos(turn), rise * std::sin(turn), 1));
      const Vec3d wi = cases::direction(0.2 + 0.8 * u(engine));
      const double rounded = static_cast<double>(static_cast<float>(eta));
      const double c = dot(m, wi), g = std::sqrt((rounded - 1) * (rounded + 1) + c * c);
      const Vec3d wo = (m * (c - g) - wi) / rounded;
      const Vec3<float> drawn = single(m);
      using F = Dual<float, 1>;
      const Refraction<F> got(single(wi), single(wo), F::variable(static_cast<float>(eta), 0),
                              &drawn);
      const Refraction<D> want(wi, wo, D::variable(rounded, 0), &m);
      // Derivatives by the logarithm of eta - 1, so that those of all eta compare.
      const double by_log = rounded - 1;
      const auto near = [&](const F& a, const D& b, const char* what) {
        EXPECT_NEAR(a.v, b.v, 2e-6 * std::abs(b.v)) << what << " at " << eta;
        EXPECT_NEAR(a.d[0] * by_log, b.d[0] * by_log, 2e-6) << what << " at " << eta;
      };
      near(got.r2, want.r2, "r2");
      near(got.z2, want.z2, "z2");
      near(got.cos_m, want.cos_m, "cos_m");
      near(got.cos_o, want.cos_o, "cos_o");
    }
}

}  // namespace
}  // namespace selenite
