// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "model/cases.h"

// Does `sample` draw with the density that `density` states? Pearson's chi-square per case, with the
// sphere cut into cells around the mirror and the refracted direction, logarithmic in the angle, so
// that a lobe of any width covers many cells. Light that is absorbed is a cell of its own.
//
// With fixed seeds the tests are deterministic; for a fresh seed the chance that any of the cases
// fails although all is well is 1 % in all (Sidak's correction over the cases).
namespace selenite {
namespace {

constexpr int kRings = 22, kSectors = 10, kSamples = 100'000;
constexpr int kSteps = 36;           // of the quadrature, in a cell and direction
constexpr double kFirstRing = 1e-9;  // 1 - cos of the innermost ring's edge
constexpr double kFalseAlarms = 0.01;

const std::vector<double> kRoughness{0.02, 0.1, 0.3, 1};
const std::vector<double> kCosines{1, 0.7, 0.3, 0.02};

/// Upper tail of the chi-square distribution. Source: Wilson and Hilferty 1931, cube-root normal
/// approximation, good to 1e-4 for the many degrees of freedom here.
double chi_square_tail(double x, int degrees) {
  const double v = 2. / (9. * degrees);
  return 0.5 * std::erfc((std::cbrt(x / degrees) - (1 - v)) / std::sqrt(2 * v));
}

/// Cells of one hemisphere (sign of z) around an axis.
struct Cells {
  Frame<double> frame;
  bool below;

  static double edge(int ring) {
    return ring == 0 ? 0 : kFirstRing * std::pow(2 / kFirstRing, (ring - 1) / (kRings - 1.));
  }
  int index(const Vec3d& w) const {
    const Vec3d d = w - frame.n;
    const double r = dot(d, d) / 2;  // 1 - cos
    const int ring = r < kFirstRing ? 0
                                    : 1 + static_cast<int>(std::log(r / kFirstRing) /
                                                           std::log(2 / kFirstRing) * (kRings - 1));
    const double turn = std::atan2(dot(w, frame.t), dot(w, frame.s)) / (2 * kPi<double>)+0.5;
    return std::min(ring, kRings - 1) * kSectors +
           std::min(static_cast<int>(turn * kSectors), kSectors - 1);
  }
  /// Probability of each cell by the midpoint rule.
  template <class Density>
  std::vector<double> integrate(int ring_steps, int turn_steps, const Density& density) const {
    std::vector<double> p(kRings * kSectors);
    for (int ring = 0; ring < kRings; ++ring) {
      const double lo = edge(ring), step = (edge(ring + 1) - lo) / ring_steps;
      for (int i = 0; i < ring_steps; ++i) {
        const double r = lo + (i + 0.5) * step, s = std::sqrt(r * (2 - r));
        for (int j = 0; j < kSectors * turn_steps; ++j) {
          const double phi = 2 * kPi<double> * ((j + 0.5) / (kSectors * turn_steps) - 0.5);
          const Vec3d w = frame.to_world({s * std::cos(phi), s * std::sin(phi), 1 - r});
          if ((w.z < 0) != below) continue;
          p[ring * kSectors + j / turn_steps] +=
              density(w) * step * 2 * kPi<double> / (kSectors * turn_steps);
        }
      }
    }
    return p;
  }
};

/// Where the micronormal (0, 0, 1) would refract wi to, or along the surface beyond that.
Vec3d refracted(const Vec3d& wi, double eta) {
  const Vec3d o{-wi.x / eta, -wi.y / eta, 0};
  const double s2 = dot(o, o);
  return s2 < 1 ? Vec3d{o.x, o.y, -std::sqrt(1 - s2)} : normalize(Vec3d{o.x, o.y, -1e-3});
}

class Sampling : public testing::TestWithParam<int> {
 protected:
  const cases::Family& family() const { return cases::families()[GetParam()]; }
  // What sampling can reach: the unphysical refractions are no part of its density.
  Flavour flavour{.version = family().version, .evaluate_unphysical_refraction = false};
};

TEST_P(Sampling, DrawsWithTheStatedDensity) {
  const int tests =
      static_cast<int>(cases::families().size() * kRoughness.size() * kCosines.size());
  const double significance = 1 - std::pow(1 - kFalseAlarms, 1. / tests);
  std::mt19937_64 engine(20 + GetParam());
  std::uniform_real_distribution<double> u;
  for (const double roughness : kRoughness) {
    for (const double cosine : kCosines) {
      SCOPED_TRACE(testing::Message() << "roughness " << roughness << ", cosine " << cosine);
      const Vec3d wi = cases::direction(cosine);
      const auto material = family().material(roughness);
      const PrincipledBsdf<double> bsdf(material, flavour, cases::flat(wi, family().backfacing));
      const double eta = family().backfacing ? 1 / material.ior : material.ior;
      // A reflection lies around the mirror direction, sheen low above the horizon all around.
      const bool low = family().name == "sheen";
      const Vec3d reflected = low ? Vec3d{0, 0, 1} : Vec3d{-wi.x, -wi.y, wi.z};
      const Cells halves[] = {{Frame<double>::from_normal(reflected), false},
                              {Frame<double>::from_normal(refracted(wi, eta)), true}};
      std::vector<double> expected;
      // Seen under a grazing angle a narrow lobe is 1 / cosine times as long as it is wide.
      const int turn_steps = roughness * cosine < 1e-3 ? 10 * kSteps : kSteps;
      for (const Cells& half : halves)
        for (const double p :
             half.integrate(low ? 20 * kSteps : kSteps, low ? kSteps / 3 : turn_steps,
                            [&](const Vec3d& w) { return bsdf.density(w); }))
          expected.push_back(p * kSamples);
      double total = 0;
      for (const double e : expected) total += e;
      ASSERT_LE(total, kSamples * (1 + 2e-3)) << "the density integrates to more than 1";
      expected.push_back(std::max(0., kSamples - total));  // absorbed
      std::vector<int> observed(expected.size());
      for (int i = 0; i < kSamples; ++i) {
        const auto s = bsdf.sample(u(engine), u(engine), u(engine));
        if (!s) {
          ++observed.back();
          continue;
        }
        ASSERT_FALSE(s->singular);
        ASSERT_EQ(s->transmits, s->wo.z < 0);
        ++observed[(s->transmits ? kRings * kSectors : 0) + halves[s->transmits].index(s->wo)];
      }
      // Cells that expect little are pooled, so that the statistic is close to a chi-square.
      double statistic = 0, pooled = 0;
      int degrees = -1, pooled_seen = 0;
      const auto close = [&](double want, int seen) {
        statistic += square(seen - want) / want;
        ++degrees;
      };
      for (std::size_t k = 0; k < expected.size(); ++k) {
        if (expected[k] >= 10) {
          close(expected[k], observed[k]);
        } else {
          pooled += expected[k];
          pooled_seen += observed[k];
        }
      }
      if (pooled >= 10) {
        close(pooled, pooled_seen);
      } else {
        EXPECT_LE(pooled_seen, pooled + 5 * std::sqrt(pooled + 1) + 3) << "where nothing should be";
      }
      ASSERT_GT(degrees, 20) << "the cells do not resolve the lobe";
      EXPECT_GT(chi_square_tail(statistic, degrees), significance)
          << "chi-square " << statistic << " with " << degrees << " degrees of freedom";
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
