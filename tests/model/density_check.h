// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "model/cases.h"
#include "model/tables/gauss_legendre.h"

// Does `sample` draw with the density that `density` states? Pearson's chi-square per case, with the
// sphere cut into cells around the mirror and the refracted direction, logarithmic in the angle, so
// that a lobe of any width covers many cells. Light that is absorbed is a cell of its own.
//
// With fixed seeds the tests are deterministic; for a fresh seed the chance that any of the cases
// of a suite fails although all is well is 1 % in all (Sidak's correction over the cases).
namespace selenite::density_check {

inline constexpr int kRings = 22, kSectors = 10, kSamples = 100'000;
inline constexpr int kSteps = 36;           // of the quadrature, in a cell and direction
inline constexpr double kFirstRing = 1e-9;  // 1 - cos of the innermost ring's edge
inline constexpr double kFalseAlarms = 0.01;

/// Upper tail of the chi-square distribution. Source: Wilson and Hilferty 1931, cube-root normal
/// approximation, good to 1e-4 for the many degrees of freedom here.
inline double chi_square_tail(double x, int degrees) {
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
  /// Probability of each cell: by few nodes where more of them say the same, within what the
  /// chi-square notices, else (where a lobe ends inside) by the midpoint rule. `thin`: a lobe may
  /// pass between nodes. `peaked`: it may pass between midpoints too, and each step has a random
  /// point.
  template <class Density>
  std::vector<double> integrate(int ring_steps, int turn_steps, bool thin, bool peaked,
                                const Density& density) const {
    static const GaussLegendre<6> few;
    static const GaussLegendre<10> more;
    std::mt19937_64 engine(1);
    std::uniform_real_distribution<double> u;
    std::vector<double> p(kRings * kSectors);
    for (std::size_t k = 0; k < p.size(); ++k) {
      const int ring = static_cast<int>(k) / kSectors, sector = static_cast<int>(k) % kSectors;
      const double lo = edge(ring), height = edge(ring + 1) - lo;
      const auto at = [&](double x, double y) {  // from 0 to 1 across the cell
        const double r = lo + x * height, s = std::sqrt(r * (2 - r));
        const double phi = 2 * kPi<double> * ((sector + y) / kSectors - 0.5);
        const Vec3d w = frame.to_world({s * std::cos(phi), s * std::sin(phi), 1 - r});
        return (w.z < 0) == below ? density(w) : 0;
      };
      const auto mean = [&](const auto& nodes) {
        double sum = 0;
        for (std::size_t i = 0; i < nodes.x.size(); ++i)
          for (std::size_t j = 0; j < nodes.x.size(); ++j)
            sum += nodes.weight[i] * nodes.weight[j] * at(nodes.x[i], nodes.x[j]);
        return sum;
      };
      const double area = height * 2 * kPi<double> / kSectors;
      p[k] = area * mean(more);
      if (!thin && !peaked &&
          std::abs(p[k] - area * mean(few)) * kSamples < 0.02 * std::sqrt(p[k] * kSamples) + 0.01)
        continue;
      p[k] = 0;
      for (int i = 0; i < ring_steps; ++i)
        for (int j = 0; j < turn_steps; ++j) {
          const double x = peaked ? u(engine) : 0.5, y = peaked ? u(engine) : 0.5;
          p[k] += at((i + x) / ring_steps, (j + y) / turn_steps) * area / (ring_steps * turn_steps);
        }
    }
    return p;
  }
};

/// Where the micronormal (0, 0, 1) would refract wi to, or along the surface beyond that.
inline Vec3d refracted(const Vec3d& wi, double eta) {
  const Vec3d o{-wi.x / eta, -wi.y / eta, 0};
  const double s2 = dot(o, o);
  return s2 < 1 ? Vec3d{o.x, o.y, -std::sqrt(1 - s2)} : normalize(Vec3d{o.x, o.y, -1e-3});
}

/// What the cells and the test need to know of a case.
struct View {
  Vec3d wi;
  double eta = 1;        ///< of the far side over the viewer's
  double roughness = 1;  ///< of the narrowest lobe
  int fine = 1;          ///< times as many steps of the quadrature, where a lobe ends abruptly
  bool low = false;      ///< the light lies low above the horizon all around, as that of sheen
  int cases = 1;         ///< in the suite
  bool peaked = false;   ///< a wide lobe has a peak that is narrower than a step
};

template <class Bsdf, class Engine>
void expect_stated_density(const Bsdf& bsdf, const View& view, Engine& engine) {
  std::uniform_real_distribution<double> u;
  const Vec3d& wi = view.wi;
  const double significance = 1 - std::pow(1 - kFalseAlarms, 1. / view.cases);
  // A reflection lies around the mirror direction, sheen low above the horizon all around.
  const Vec3d reflected = view.low ? Vec3d{0, 0, 1} : Vec3d{-wi.x, -wi.y, wi.z};
  const Cells halves[] = {{Frame<double>::from_normal(reflected), false},
                          {Frame<double>::from_normal(refracted(wi, view.eta)), true}};
  std::vector<double> expected;
  // Seen under a grazing angle a narrow lobe is 1 / cosine times as long as it is wide.
  const bool thin = view.roughness * wi.z < 1e-3;
  const int fine = view.peaked ? 2 * view.fine : view.fine;
  const int turn_steps = thin ? 10 * kSteps : kSteps;
  for (const Cells& half : halves)
    for (const double p : half.integrate(
             fine * (view.low ? 20 * kSteps : kSteps), fine * (view.low ? kSteps / 3 : turn_steps),
             thin, view.peaked, [&](const Vec3d& w) { return bsdf.density(w); }))
      expected.push_back(p * kSamples);
  double total = 0;
  for (const double e : expected) total += e;
  ASSERT_LE(total, kSamples * (1 + 2e-3)) << "the density integrates to more than 1";
  expected.push_back(std::max(0., kSamples - total));  // absorbed
  std::vector<int> observed(expected.size());
  for (int i = 0; i < kSamples; ++i) {
    // One after the other: compilers evaluate arguments in different orders.
    const double a = u(engine), b = u(engine), c = u(engine);
    const auto s = bsdf.sample(a, b, c);
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

}  // namespace selenite::density_check
