// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/tables/albedo_tables.h"

#include <gtest/gtest.h>

#include "model/fresnel.h"
#include "model/micronormals.h"
#include "model/tables/quadrature/albedo_view.h"

namespace selenite {
namespace {

/// Albedo of the mirror lobe by an integral over light directions instead of micronormals. The light
/// direction is split into height and azimuth; no sampling routine takes part.
double mirror_by_directions(double roughness, double c, double (*weight)(double cos_m)) {
  const double width2 = std::pow(roughness, 4);
  const Vec3d wi{std::sqrt(1 - c * c), 0, c};
  double sum = 0;
  const int heights = 400, turns = 800;
  for (int i = 0; i < heights; ++i) {
    const double z = (i + 0.5) / heights, r = std::sqrt(1 - z * z);
    for (int j = 0; j < turns; ++j) {
      const double phi = kPi<double> * (j + 0.5) / turns;
      const Vec3d wo{r * std::cos(phi), r * std::sin(phi), z};
      const Vec3d m = normalize(wi + wo);
      const double r2 = m.x * m.x + m.y * m.y;
      sum += ggx_normals(r2, m.z * m.z, width2) * weight(dot(m, wi)) /
             (4 * c * (1 + ggx_lambda(tangent2(wi), width2) + ggx_lambda(tangent2(wo), width2)));
    }
  }
  return sum * 2 * kPi<double> / (heights * turns);
}

TEST(AlbedoTables, MirrorAgreesWithAnIntegralOverLightDirections) {
  const AlbedoTables& tables = AlbedoTables::get();
  for (const int i : {12, 20, 31})
    for (const int j : {3, 15, 30})
      EXPECT_NEAR(tables.mirror(i / 31., j / 31.),
                  mirror_by_directions(i / 31., j / 31., [](double) { return 1.; }), 2e-4)
          << i << " " << j;
}

// At nodes, where nothing is interpolated.
TEST(AlbedoTables, HoldWhatTheQuadratureGives) {
  const AlbedoTables& tables = AlbedoTables::get();
  for (const int i : {3, 17, 31})
    for (const int j : {2, 15, 31}) {
      const double roughness = i / 31., c = j / 31.;
      EXPECT_NEAR(tables.mirror(roughness, c), AlbedoView(roughness, c).mirror(), 2e-7);
    }
  for (const int i : {1, 6, 15})
    for (const int j : {1, 9, 15})
      for (const int k : {1, 7, 14}) {
        const double roughness = i / 15., c = j / 15., z = k / 15., n = (1 + z * z) / (1 - z * z);
        const AlbedoView view(roughness, c);
        EXPECT_NEAR(tables.rise(roughness, c, z), view.rise(n), 2e-7);
        EXPECT_NEAR(tables.glass(roughness, c, z, false), view.glass(n), 2e-7);
        EXPECT_NEAR(tables.glass(roughness, c, z, true), view.glass(1 / n), 2e-7);
      }
}

TEST(AlbedoTables, AreOneWithoutRoughnessAndFallWithIt) {
  const AlbedoTables& tables = AlbedoTables::get();
  for (int j = 1; j < 32; ++j) {
    EXPECT_NEAR(tables.mirror(0., j / 31.), 1, 1e-6);
    for (const bool thinner : {false, true}) EXPECT_EQ(tables.glass(0., j / 31., 0.4, thinner), 1);
  }
  for (double r = 0.1; r < 1; r += 0.1)
    EXPECT_GT(tables.mirror_mean(r - 0.1), tables.mirror_mean(r));
}

TEST(AlbedoTables, MeanIsTheCosineWeightedMean) {
  const AlbedoTables& tables = AlbedoTables::get();
  for (const int i : {10, 20, 31}) {
    double sum = 0;  // of the interpolated entries, hence the tolerance
    const int n = 1000;
    for (int j = 0; j < n; ++j)
      sum += 2 * (j + 0.5) / n / n * tables.mirror(i / 31., (j + 0.5) / n);
    EXPECT_NEAR(tables.mirror_mean(i / 31.), sum, 1e-3);
  }
}

TEST(AlbedoTables, GlassCountsTheDroppedDirectionsTowardsTheThinnerSide) {
  // Measured in Cycles: 0.703, of which 0.169 never leave the surface.
  const double n = 1 / 0.923, z = std::sqrt((n - 1) / (n + 1));
  EXPECT_NEAR(AlbedoTables::get().glass(0.53, 0.07, z, true), 0.703, 5e-4);
}

TEST(AlbedoTables, RiseIsTheMeanOverMicronormals) {
  const double n = 1.5;
  const double z = std::sqrt((n - 1) / (n + 1));
  // Roughness 0: one micronormal.
  for (const int j : {2, 8, 14}) {
    const double c = j / 15.;
    const int k = static_cast<int>(z * 15);
    const double node = k / 15., n_node = (1 + node * node) / (1 - node * node);
    EXPECT_NEAR(AlbedoTables::get().rise(0., c, node), dielectric_rise(c, n_node * n_node - 1),
                1e-4);
  }
}

TEST(AlbedoTables, SlopesAreThoseOfTheInterpolation) {
  const AlbedoTables& tables = AlbedoTables::get();
  using D = Dual<double, 2>;
  const double h = 1e-6;
  for (const double r : {0.03, 0.31, 0.97}) {
    for (const double z : {0.05, 0.41, 0.99}) {
      const D roughness = D::variable(r, 0), axis = D::variable(z, 1);
      const D got = tables.glass(roughness, 0.37, axis, true);
      const double by_r = (tables.glass(r + h, 0.37, z, true) - tables.glass(r - h, 0.37, z, true));
      const double by_z = (tables.glass(r, 0.37, z + h, true) - tables.glass(r, 0.37, z - h, true));
      EXPECT_NEAR(got.d[0], by_r / (2 * h), 1e-6);
      EXPECT_NEAR(got.d[1], by_z / (2 * h), 1e-6);
    }
  }
}

}  // namespace
}  // namespace selenite
