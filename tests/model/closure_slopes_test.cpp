// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "model/closure_cases.h"

// Dual numbers against finite differences of the values, for every parameter of every closure, and
// for its share of the mixture.
namespace selenite {
namespace {

namespace c = closures;
const Vec3d kView = cases::direction(0.6);
using D = Dual<double, 1>;

/// A parameter of a closure, or its mix weight (`field` -1).
struct Slope {
  ClosureKind kind;
  int field, channel;
};
std::vector<Slope> slopes() {
  std::vector<Slope> all;
  for (std::size_t kind = 1; kind < kClosureNames.size(); ++kind) {
    all.push_back({static_cast<ClosureKind>(kind), -1, 0});
    auto closure = default_closure<double>(static_cast<ClosureKind>(kind));
    int field = 0;
    closure_fields(closure, [&](const Parameter&, auto& member) {
      const int channels = requires { member.r; }
      ? 3 : 1;
      for (int k = 0; k < channels; ++k) all.push_back({static_cast<ClosureKind>(kind), field, k});
      ++field;
    });
  }
  return all;
}
std::string slope_name(const Slope& slope) {
  const std::string kind(kClosureNames[static_cast<std::size_t>(slope.kind)]);
  if (slope.field < 0) return kind + "_weight";
  auto closure = default_closure<double>(slope.kind);
  std::string name;
  int field = 0;
  closure_fields(closure, [&](const Parameter& p, auto&) {
    if (field++ == slope.field) name = p.name;
  });
  return kind + "_" + name + "_" + std::to_string(slope.channel);
}

class ClosureSlopes : public testing::TestWithParam<int> {
 protected:
  static Parameter parameter(const Slope& slope) {
    Parameter found = c::color_parameter("", 1, "");  // of a mix weight: 0 to 1
    auto closure = default_closure<double>(slope.kind);
    int field = 0;
    closure_fields(closure, [&](const Parameter& p, auto&) {
      if (field++ == slope.field) found = p;
    });
    return found;
  }
};

TEST_P(ClosureSlopes, AgreeWithFiniteDifferences) {
  const Slope slope = slopes()[GetParam()];
  const Parameter p = parameter(slope);
  struct Place {
    const char* name;
    double x;
  };
  const double upper = std::min(p.upper, 20.);
  // A conductor without index or extinction reflects all light: a film's sum is clamped there.
  const double lower = slope.kind == ClosureKind::kConductor && slope.field < 2 ? 1e-3 : p.lower;
  for (const Place& place : {Place{"lower", lower}, Place{"fit_lower", p.fit_lower},
                             Place{"inside", 0.63 * p.fit_lower + 0.37 * p.fit_upper},
                             Place{"fit_upper", p.fit_upper}, Place{"upper", upper}}) {
    SCOPED_TRACE(place.name);
    std::mt19937_64 engine(7);
    std::uniform_real_distribution<double> u;
    int agreed = 0, kinks = 0, moved = 0;
    for (int i = 0; i < 200; ++i) {
      // Random values; a second closure, so that shares are tried too.
      Closure<D> closure = default_closure<D>(slope.kind);
      D* at = nullptr;
      PlacedClosure<D> of{closure, Flavour{}, D(0.2 + 0.7 * u(engine)), {0, 0, 1}};
      int field = 0;
      closure_fields(of.closure, [&](const Parameter& q, auto& member) {
        const auto draw = [&](D& x, int channel) {
          const double hi = std::min(q.fit_upper, 3.), lo = std::max(q.fit_lower, 0.05);
          x = D(lo + (0.1 + 0.8 * u(engine)) * (hi - lo));
          if (field == slope.field && channel == slope.channel) at = &x;
        };
        if constexpr (requires { member.r; }) {
          for (int k = 0; k < 3; ++k) draw(member[k], k);
        } else {
          draw(member, 0);
        }
        ++field;
      });
      if (slope.field < 0) at = &of.weight;
      of.flavour.distribution =
          i % 2 ? Flavour::Distribution::kMultiGgx : Flavour::Distribution::kGgx;
      std::vector<PlacedClosure<D>> mixture(2);
      mixture[1] = {c::Diffuse<D>{Color<D>(D(0.4)), D(0)}, Flavour{}, D(0.3), {0, 0, 1}};
      auto point = cases::flat(cases::direction(0.05 + 0.95 * u(engine)), u(engine) < 0.5);
      point.after_diffuse = true;  // what goes under the surface is reflected, with its colour
      const Vec3d wo = cases::random_direction(engine);
      const auto outputs = [&](double x) {
        *at = D::variable(x, 0);
        mixture[0] = of;
        const SurfaceBsdf<D> bsdf(mixture, point);
        const Color<D> f = bsdf.value(wo), e = bsdf.emission(), t = bsdf.transparency();
        return std::array<D, 9>{f.r, f.g, f.b, e.r, e.g, e.b, t.r, t.g, t.b};
      };
      const auto here = outputs(place.x);
      const auto difference = [&](double h) {
        std::array<double, 9> d;
        const bool down = place.x - h >= p.lower, up = place.x + h <= p.upper;
        if (down && up) {
          const auto a = outputs(place.x - h), b = outputs(place.x + h);
          for (int k = 0; k < 9; ++k) d[k] = (b[k].v - a[k].v) / (2 * h);
        } else {
          const double s = up ? h : -h;
          const auto a = outputs(place.x + s), b = outputs(place.x + 2 * s);
          for (int k = 0; k < 9; ++k) d[k] = (4 * a[k].v - b[k].v - 3 * here[k].v) / (2 * s);
        }
        return d;
      };
      const double h = 1e-5 * std::max(1., std::min(place.x, 10.));
      const auto coarse = difference(2 * h), fine = difference(h);
      for (int k = 0; k < 9; ++k) {
        const double scale = std::abs(here[k].d[0]) + std::abs(here[k].v) + 1e-3;
        moved += here[k].d[0] != 0;
        EXPECT_TRUE(std::isfinite(here[k].d[0]));
        if (std::abs(coarse[k] - fine[k]) > 1e-4 * scale) {
          ++kinks;  // a clamp, a node of a table, or an infinite slope
          continue;
        }
        EXPECT_NEAR(here[k].d[0], fine[k], 1e-3 * scale) << "output " << k << " of case " << i;
        ++agreed;
      }
    }
    EXPECT_GT(agreed, 5 * kinks);  // at an index of 1 the tables of albedos have theirs
    const bool hidden =
        slope.kind == ClosureKind::kSubsurface && slope.field > 0;  // they shape the walk alone
    if (!hidden && std::string_view(place.name) == "inside") {
      EXPECT_GT(moved, 50);
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Parameters, ClosureSlopes,
                         testing::Range(0, static_cast<int>(slopes().size())),
                         [](const auto& info) { return slope_name(slopes()[info.param]); });

/// A mixture of one closure whose normal turns by an angle, x, about an axis, and of a diffuse one.
std::vector<PlacedClosure<D>> turned(const PlacedClosure<D>& of, const Vec3d& n, const Vec3d& side,
                                     double x) {
  std::vector<PlacedClosure<D>> mixture(2);
  mixture[0] = of;
  mixture[0].n = n * std::cos(x) + side * std::sin(x);
  const Vec3d way = side * std::cos(x) - n * std::sin(x);
  const auto moving = [](double value, double slope) {
    D d(value);
    d.d[0] = slope;
    return d;
  };
  mixture[0].turning = Vec3<D>{moving(mixture[0].n.x, way.x), moving(mixture[0].n.y, way.y),
                               moving(mixture[0].n.z, way.z)};
  mixture[1] = {c::Diffuse<D>{Color<D>(D(0.4)), D(0)}, Flavour{}, D(0.3), {0, 0, 1}};
  return mixture;
}

/// A closure of random values.
Closure<D> random_closure(ClosureKind kind, std::mt19937_64& engine) {
  std::uniform_real_distribution<double> u;
  Closure<D> closure = default_closure<D>(kind);
  closure_fields(closure, [&](const Parameter& q, auto& member) {
    const auto draw = [&](D& x) {
      const double hi = std::min(q.fit_upper, 3.), lo = std::max(q.fit_lower, 0.1);
      x = D(lo + (0.1 + 0.8 * u(engine)) * (hi - lo));
    };
    if constexpr (requires { member.r; }) {
      for (int k = 0; k < 3; ++k) draw(member[k]);
    } else {
      draw(member);
    }
  });
  return closure;
}

class NormalSlopes : public testing::TestWithParam<int> {
 protected:
  ClosureKind kind() const { return static_cast<ClosureKind>(GetParam()); }
  bool scatters() const {
    return kind() != ClosureKind::kTransparent && kind() != ClosureKind::kEmission;
  }
};

TEST_P(NormalSlopes, AgreeWithFiniteDifferences) {
  std::mt19937_64 engine(11);
  std::uniform_real_distribution<double> u;
  constexpr std::array kDistributions{Flavour::Distribution::kGgx, Flavour::Distribution::kMultiGgx,
                                      Flavour::Distribution::kBeckmann,
                                      Flavour::Distribution::kAshikhminShirley};
  int agreed = 0, kinks = 0, moved = 0;
  for (int i = 0; i < 600; ++i) {
    PlacedClosure<D> of{
        random_closure(kind(), engine), Flavour{}, D(0.2 + 0.7 * u(engine)), {0, 0, 1}};
    of.flavour.distribution = kDistributions[static_cast<std::size_t>(i % 4)];
    if (i % 3 == 0) of.tangent = cases::random_direction(engine);
    const Vec3d n = normalize(Vec3d{0.5 * u(engine) - 0.25, 0.5 * u(engine) - 0.25, 1});
    const Vec3d side = normalize(cross(n, cases::random_direction(engine)));
    auto point = cases::flat(cases::direction(0.05 + 0.95 * u(engine)), u(engine) < 0.5);
    point.after_diffuse = true;
    const Vec3d wo = cases::random_direction(engine);
    const auto value = [&](double x) {
      const auto mixture = turned(of, n, side, x);
      return SurfaceBsdf<D>(mixture, point).value(wo).g;
    };
    const D here = value(0);
    ASSERT_TRUE(std::isfinite(here.d[0]));
    moved += here.d[0] != 0;
    const auto difference = [&](double h) { return (value(h).v - value(-h).v) / (2 * h); };
    const double coarse = difference(2e-6), fine = difference(1e-6);
    const double scale = std::abs(here.d[0]) + std::abs(here.v) + 1e-3;
    if (std::abs(coarse - fine) > 1e-5 * scale) {
      ++kinks;  // a node of a table, the horizon, or a normal that begins to be bent
      continue;
    }
    EXPECT_NEAR(here.d[0], fine, 1e-4 * scale) << "case " << i;
    ++agreed;
  }
  EXPECT_GT(agreed, 20 * kinks);
  if (scatters()) {
    EXPECT_GT(moved, 200);
  }
}

/// The mean weight of samples does not move with what their density does: its derivative is that of
/// the albedo.
TEST_P(NormalSlopes, SamplesCarryThoseOfTheAlbedo) {
  if (!scatters()) GTEST_SKIP() << "nothing is drawn";
  std::mt19937_64 engine(12);
  // Rougher refraction is off by the image of the micronormals' horizon, which moves with the normal.
  PlacedClosure<D> of{default_closure<D>(kind()),
                      Flavour{.evaluate_unphysical_refraction = false},
                      D(1),
                      {0, 0, 1}};
  if (kind() == ClosureKind::kGlass || kind() == ClosureKind::kRefraction)
    of.closure = kind() == ClosureKind::kGlass
                     ? Closure<D>(c::Glass<D>{Color<D>(D(.8)), D(.3), D(1.5)})
                     : Closure<D>(c::Refraction<D>{Color<D>(D(.8)), D(.3), D(1.5)});
  const Vec3d n = normalize(Vec3d{0.1, 0.2, 1}), side = normalize(cross(n, Vec3d{0, 1, 0}));
  auto point = cases::flat(kView, false);
  point.after_diffuse = true;
  // Weighted by a smooth function of the direction, which no sampling scheme knows.
  const auto mean = [&](double x) {
    // Alone: another closure's samples do not see what a lobe sends to the far side of its normal.
    const std::vector<PlacedClosure<D>> alone{turned(of, n, side, x).front()};
    const SurfaceBsdf<D> bsdf(alone, point);
    const int count = 1 << 17;
    D sum(0);
    for (int i = 0; i < count; ++i) {
      const auto turn = [&](double s) { return std::fmod(0.5 + s * (i + 1), 1.); };
      if (const auto s = bsdf.sample(turn(0.8191725134), turn(0.6710436067), turn(0.5497004779)))
        sum += s->weight.g * (1 + s->wo.x * s->wo.z);
    }
    return sum / static_cast<double>(count);
  };
  const double h = 0.02, difference = (mean(h).v - mean(-h).v) / (2 * h);
  EXPECT_NEAR(mean(0).d[0], difference, 0.01) << difference;
}
INSTANTIATE_TEST_SUITE_P(Kinds, NormalSlopes,
                         testing::Range(0, static_cast<int>(kClosureNames.size())),
                         [](const auto& info) { return std::string(kClosureNames[info.param]); });

TEST(ClosureSlopesAtZero, BlackColourAndWeightKeepTheirSlopesInSamples) {
  const double step = 0.05;
  const auto mean = [](const std::vector<PlacedClosure<D>>& mixture) {
    const SurfaceBsdf<D> bsdf(mixture, cases::flat(kView, false));
    const int n = 1 << 15;
    D sum(0);
    for (int i = 0; i < n; ++i) {
      const auto turn = [&](double s) { return std::fmod(0.5 + s * (i + 1), 1.); };
      if (const auto s = bsdf.sample(turn(0.8191725134), turn(0.6710436067), turn(0.5497004779)))
        sum += s->weight.g;
    }
    return sum / static_cast<double>(n);
  };
  const Flavour flavour{.evaluate_unphysical_refraction = false};
  const Vec3d n{0, 0, 1};
  const PlacedClosure<D> ground{c::Diffuse<D>{Color<D>(D(.5)), D(0)}, flavour, D(1), n};
  const auto of_weight = [&](const Closure<D>& closure) {
    const auto at = [&](double x) {
      return mean({ground, {closure, flavour, D::variable(x, 0), n}});
    };
    const D here = at(0);
    EXPECT_NEAR(here.d[0], (at(step).v - here.v) / step, 0.02);
    EXPECT_GT(here.d[0], 0.1);
  };
  of_weight(c::Glossy<D>{Color<D>(D(.8)), D(.4)});
  of_weight(c::Glass<D>{Color<D>(D(.8)), D(.3), D(1.5)});
  of_weight(c::Refraction<D>{Color<D>(D(.8)), D(0), D(1.5)});
  of_weight(c::Translucent<D>{Color<D>(D(.8))});
  of_weight(c::Conductor<D>{Color<D>(D(2.5)), Color<D>(D(3)), D(.3)});
  of_weight(lift<D>(Principled<double>{}));
  const auto of_colour = [&](const auto& make) {
    const auto at = [&](double x) {
      return mean({ground, {make(Color<D>(D::variable(x, 0))), flavour, D(1), n}});
    };
    const D here = at(0);
    EXPECT_NEAR(here.d[0], (at(step).v - here.v) / step, 0.05);
    EXPECT_GT(here.d[0], 0.1);
  };
  of_colour([](const Color<D>& color) { return Closure<D>(c::Glossy<D>{color, D(.4)}); });
  of_colour([](const Color<D>& color) { return Closure<D>(c::Glass<D>{color, D(.3), D(1.5)}); });
  of_colour([](const Color<D>& color) {
    return Closure<D>(c::Refraction<D>{color, D(.2), D(1.5)});
  });
  of_colour([](const Color<D>& color) { return Closure<D>(c::Translucent<D>{color}); });
}

// The derivative by the direction in which highlights are long, and by how long they are.
TEST(ClosureSlopes, KnowTheTangent) {
  using enum Flavour::Distribution;
  c::FullPrincipled<D> principled = lift<D>(Principled<double>{});
  principled.roughness = D(0.4), principled.metallic = D(0.5), principled.anisotropic = D(0.7);
  const c::Glossy<D> glossy{Color<D>(D(.8)), D(.4), D(-.6)};
  const c::Conductor<D> conductor{Color<D>(D(2.5)), Color<D>(D(3)), D(.4), D(.7)};
  const auto point = cases::flat(kView, false);
  const Vec3d wo = cases::direction(0.63, 2.95);
  const auto value = [&](const Closure<D>& closure, Flavour::Distribution distribution,
                         double angle, bool moves) {
    const D a = moves ? D::variable(angle, 0) : D(angle);
    using std::cos, std::sin;
    const Vec3<D> tangent{D(2) * cos(a), D(2) * sin(a), D(.4)};
    std::vector<PlacedClosure<D>> one(1);
    one[0] = {closure, Flavour{.distribution = distribution}, D(1), {0, 0, 1}};
    one[0].tangent = {tangent.x.v, tangent.y.v, tangent.z.v};
    if (moves) one[0].rotating = tangent;
    return SurfaceBsdf<D>(one, point).value(wo).g;
  };
  const double step = 1e-5;
  for (const auto& closure : {Closure<D>(principled), Closure<D>(glossy), Closure<D>(conductor)})
    for (const auto distribution : {kGgx, kBeckmann, kAshikhminShirley}) {
      if (distribution == kAshikhminShirley && !std::holds_alternative<c::Glossy<D>>(closure))
        continue;
      if (distribution == kBeckmann && closure.index() == 0) continue;
      const double up = value(closure, distribution, 0.7 + step, false).v,
                   down = value(closure, distribution, 0.7 - step, false).v;
      const D here = value(closure, distribution, 0.7, true);
      EXPECT_NEAR(here.d[0], (up - down) / (2 * step), 1e-5 * std::abs(here.d[0]));
      EXPECT_GT(std::abs(here.d[0]), 0.5 * here.v);
    }
  const auto by_anisotropy = [&](double x) {
    principled.anisotropic = D::variable(x, 0);
    return value(principled, kMultiGgx, 0.7, false);
  };
  for (const double x : {0., 0.3, 0.9}) {
    const double least = std::max(x - step, 0.);
    const double slope = (by_anisotropy(x + step).v - by_anisotropy(least).v) / (x + step - least);
    EXPECT_NEAR(by_anisotropy(x).d[0], slope, 1e-4 * (1 + std::abs(slope)));
  }
}

}  // namespace
}  // namespace selenite
