// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/fresnel.h"

#include <gtest/gtest.h>

namespace selenite {
namespace {

/// Fresnel's equations by angles: sin and tan of sum and difference. Nothing in common with the
/// implementation but the physics.
double by_angles(double c, double eta) {
  const double ti = std::acos(c), s = std::sin(ti) / eta;
  if (s >= 1) return 1;
  const double tt = std::asin(s);
  const double rs = std::sin(ti - tt) / std::sin(ti + tt),
               rp = std::tan(ti - tt) / std::tan(ti + tt);
  return (rs * rs + rp * rp) / 2;
}

TEST(Fresnel, AgreesWithTheEquationsByAngles) {
  for (const double eta : {0.1, 0.5, 0.667, 0.9, 0.999, 1.001, 1.1, 1.5, 2.5, 10.})
    for (double c = 0.005; c < 1; c += 0.005)
      EXPECT_NEAR(fresnel_dielectric(c, eta * eta - 1), by_angles(c, eta), 1e-10)
          << eta << " " << c;
}

TEST(Fresnel, HasTheLimitsOfTheTextbook) {
  for (const double eta : {0.5, 1.5, 2.5}) {
    const double e = eta * eta - 1, f0 = square((eta - 1) / (eta + 1));
    EXPECT_NEAR(fresnel_normal(e), f0, 1e-15);
    EXPECT_NEAR(fresnel_dielectric(1., e), f0, 1e-15);
    EXPECT_NEAR(fresnel_dielectric(1e-9, e), 1, 1e-6);
    EXPECT_NEAR(dielectric_rise(1., e), 0, 1e-14);
    EXPECT_NEAR(dielectric_rise(1e-9, e), 1, 1e-6);
  }
  // Brewster's angle: only the perpendicular polarisation is left.
  const double eta = 1.5, c = 1 / std::sqrt(1 + eta * eta);
  EXPECT_NEAR(fresnel_dielectric(c, eta * eta - 1), square((eta * eta - 1) / (eta * eta + 1)) / 2,
              1e-14);
}

TEST(Fresnel, IsTotalBeyondTheCriticalAngle) {
  const double eta = 1 / 1.5, critical = std::sqrt(1 - eta * eta);
  EXPECT_EQ(fresnel_dielectric(critical * 0.999, eta * eta - 1), 1);
  EXPECT_LT(fresnel_dielectric(critical * 1.001, eta * eta - 1), 1);
}

TEST(Fresnel, RiseIsOverWhereFloatsLeaveNoTransmission) {
  for (const float eta : {1e-5f, 1e-4f}) {  // eta^2 - 1 rounds to -1
    const float e = (eta - 1) * (eta + 1);
    for (const float c : {1e-6f, 0.5f, 0.99f}) EXPECT_EQ(dielectric_rise(c, e), 1);
  }
  EXPECT_EQ(fresnel_rise(0.997f, 1.f), 0);  // the mean reflectance is a fit and lies below
}

TEST(Fresnel, IsTheSameFromBothSides) {
  for (const double eta : {1.1, 1.5, 2.5}) {
    for (double c = 0.05; c < 1; c += 0.05) {
      const double cos_t = std::sqrt(1 - (1 - c * c) / (eta * eta));
      EXPECT_NEAR(fresnel_dielectric(c, eta * eta - 1),
                  fresnel_dielectric(cos_t, 1 / (eta * eta) - 1), 1e-13);
    }
  }
}

TEST(Fresnel, KeepsItsDigitsInFloatNearEtaOne) {
  for (const double eta : {1.0001, 1.001, 1.01, 1.5}) {
    const double e = (eta - 1) * (eta + 1);
    for (const double c : {1., 0.7, 0.3, 0.05}) {
      const double want = fresnel_dielectric(c, e);
      const float got = fresnel_dielectric(static_cast<float>(c), static_cast<float>(e));
      EXPECT_NEAR(got / want, 1, 2e-5) << eta << " " << c;
    }
  }
}

TEST(Fresnel, MeanIsThatOfTheExactReflectance) {
  for (const double eta : {0.5, 0.667, 0.9, 1.1, 1.5, 2., 2.5}) {
    double sum = 0;
    const int n = 20000;
    for (int i = 0; i < n; ++i) {
      const double c = (i + 0.5) / n;
      sum += 2 * c * fresnel_dielectric(c, eta * eta - 1) / n;
    }
    EXPECT_NEAR(fresnel_mean(eta), sum, 7e-3) << eta;  // a fit; Cycles has the same error
  }
}

TEST(MetalFresnel, IsSchlickForAWhiteEdge) {
  const Color<double> f0{0.9, 0.5, 0.1};
  const MetalFresnel<double> metal(f0, Color<double>(1));
  for (double c = 0.05; c <= 1; c += 0.05)
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(metal.at(c)[k], f0[k] + (1 - f0[k]) * std::pow(1 - c, 5), 1e-14);
}

TEST(MetalFresnel, HasTheEdgeColourNear82Degrees) {
  const Color<double> f0{0.9, 0.5, 0.1}, edge{0.3, 0.6, 0.95};
  const MetalFresnel<double> metal(f0, edge);
  for (int k = 0; k < 3; ++k) {
    const double schlick = f0[k] + (1 - f0[k]) * std::pow(6. / 7, 5);
    EXPECT_NEAR(metal.at(1. / 7)[k], schlick * edge[k], 1e-13);
    EXPECT_NEAR(metal.at(1)[k], f0[k], 1e-14);
  }
}

TEST(MetalFresnel, MeanIsThatOfTheCurve) {
  const MetalFresnel<double> metal({0.9, 0.5, 0.3}, {0.8, 0.9, 0.7});
  Color<double> sum(0);
  const int n = 4000;
  for (int i = 0; i < n; ++i) sum += metal.at((i + 0.5) / n) * (2 * (i + 0.5) / n / n);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(metal.mean()[k], sum[k], 1e-6);
}

}  // namespace
}  // namespace selenite
