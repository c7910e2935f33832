// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/shading_normal.h"

#include <gtest/gtest.h>

#include "model/closure_cases.h"

namespace selenite {
namespace {

double mirror_height(const SurfacePoint<double>& p, const Vec3d& n) {
  return dot(n * (2 * dot(n, p.wi)) - p.wi, p.ng);
}

TEST(VisibleNormal, LeavesAHarmlessNormalAlone) {
  const Vec3d n = normalize(Vec3d{0.1, -0.2, 1});
  const Vec3d got = visible_normal<double>({{0, 0, 1}, n, cases::direction(0.8), false});
  EXPECT_EQ(length(got - n), 0);
}

TEST(VisibleNormal, LiftsTheMirrorDirectionAboveTheSurface) {
  std::mt19937_64 engine(1);
  int tilted = 0;
  for (int i = 0; i < 20000; ++i) {
    SurfacePoint<double> p{
        cases::random_direction(engine), {}, cases::random_direction(engine), false};
    if (dot(p.ng, p.wi) < 0) p.wi = -p.wi;
    p.n = normalize(p.ng + cases::random_direction(engine) * 0.99);
    const Vec3d got = visible_normal(p);
    const double wanted = std::min(0.9 * dot(p.ng, p.wi), 0.01);
    ASSERT_NEAR(length(got), 1, 1e-12);
    ASSERT_GE(mirror_height(p, got), wanted - 1e-10);
    ASSERT_GT(dot(got, p.wi), 0);
    if (length(got - p.n) == 0) continue;
    ++tilted;
    EXPECT_NEAR(mirror_height(p, got), wanted, 1e-10);  // no more than needed
    EXPECT_NEAR(dot(cross(p.n, p.ng), got), 0, 1e-12);  // in the plane of both
    EXPECT_GE(dot(got, p.n), dot(p.ng, p.n) - 1e-12);   // between them
  }
  EXPECT_GT(tilted, 1000);
}

TEST(VisibleNormal, StaysAwayFromTheViewerWhereItsOppositeWouldStay) {
  const Vec3d wi = cases::direction(0.8), n = normalize(Vec3d{0.1, -0.2, -1});
  const Vec3d got = visible_normal<double>({{0, 0, 1}, n, wi, false});
  EXPECT_EQ(length(got - n), 0);
  EXPECT_LT(dot(got, wi), 0);
}

TEST(VisibleNormal, AwayFromTheViewerHasNoMicronormals) {
  const Vec3d wi = cases::direction(0.8), n = normalize(Vec3d{0.1, -0.2, -1});
  const SurfacePoint<double> point{{0, 0, 1}, n, wi, false};
  const Flavour flavour{.evaluate_unphysical_refraction = false};
  Principled<double> mirrors;
  mirrors.metallic = 0.4, mirrors.transmission = 0.5, mirrors.coat_weight = 1;
  mirrors.base_color = Color<double>(0);
  Principled<double> diffuse;
  diffuse.specular_level = 0;
  std::mt19937_64 engine(3);
  std::uniform_real_distribution<double> u;
  for (const double roughness : {0., 0.5}) {
    mirrors.roughness = mirrors.coat_roughness = roughness;
    const PrincipledBsdf<double> bsdf(mirrors, flavour, point), dull(diffuse, flavour, point);
    for (int i = 0; i < 200; ++i) {
      const Vec3d wo = cases::random_direction(engine);
      EXPECT_EQ(max_channel(bsdf.value(wo)), 0);
      EXPECT_FALSE(bsdf.sample(u(engine), u(engine), u(engine)));
      EXPECT_NEAR(dull.value(wo).g, 0.8 * std::max(dot(n, wo), 0.) / kPi<double>, 1e-12);
    }
  }
}

// A coat and a film take the viewer's cosine as it is, whichever side the bent normal is on.
TEST(VisibleNormal, AwayFromTheViewerIsSeenThroughItsCoat) {
  const Vec3d wi = cases::direction(0.8), n = normalize(Vec3d{0.1, -0.2, -1});
  const SurfacePoint<double> point{{0, 0, 1}, n, wi, false};
  Principled<double> m;
  m.specular_level = 0, m.base_color = Color<double>(0.5);
  m.coat_weight = 0.7, m.coat_tint = {0.3, 0.9, 1};
  const Color<double> got = PrincipledBsdf<double>(m, Flavour{}, point).value(n);
  const double c = dot(n, wi), path = 1.5 / std::sqrt(1.5 * 1.5 - 1 + c * c);
  EXPECT_NEAR(got.r / got.b, 0.3 + 0.7 * std::pow(0.3, path), 1e-12);
  EXPECT_NEAR(got.g / got.b, 0.3 + 0.7 * std::pow(0.9, path), 1e-12);
}

TEST(VisibleNormal, AwayFromTheViewerIsSeenThroughItsFilm) {
  const Vec3d wi = cases::direction(0.8), n = normalize(Vec3d{0.1, -0.2, -1});
  closures::FullPrincipled<double> m;
  m.base_color = Color<double>(0.5), m.film = {400, 1.7};
  Flavour flavour;
  flavour.distribution = Flavour::Distribution::kGgx;
  const cases::Mixture one{{m, flavour, 1, n}};
  const SurfacePoint<double> point{{0, 0, 1}, n, wi, false};
  const auto film = film_reflectance(400., 1.7, 1.5, -dot(n, wi));
  EXPECT_NEAR(SurfaceBsdf<double>(one, point).value(n).g,
              0.5 / kPi<double> * (1 - *std::max_element(film.begin(), film.end())), 1e-12);
}

TEST(VisibleNormal, SurvivesDegenerateNormalsInFloat) {
  for (const float c : {1e-6f, 1e-4f, 0.5f, 1.f}) {
    const Vec3f wi{std::sqrt(1 - c * c), 0, c};
    for (const Vec3f n : {Vec3f{0, 0, 1}, Vec3f{0, 0, -1}, Vec3f{1, 0, 0}, Vec3f{-1, 0, 0},
                          Vec3f{0, 1, 0}, -wi, wi}) {
      const Vec3f got = visible_normal<float>({{0, 0, 1}, n, wi, false});
      EXPECT_NEAR(length(got), 1, 1e-5);
      // Away from the viewer only where it was before.
      if (!(dot(got, wi) > 0)) {
        EXPECT_EQ(length(got - n), 0) << c << " " << n.x << n.y << n.z;
      }
    }
  }
}

}  // namespace
}  // namespace selenite
