// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/shading_normal.h"

#include <gtest/gtest.h>

#include "model/cases.h"

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

TEST(VisibleNormal, SurvivesDegenerateNormalsInFloat) {
  for (const float c : {1e-6f, 1e-4f, 0.5f, 1.f}) {
    const Vec3f wi{std::sqrt(1 - c * c), 0, c};
    for (const Vec3f n : {Vec3f{0, 0, 1}, Vec3f{0, 0, -1}, Vec3f{1, 0, 0}, Vec3f{-1, 0, 0},
                          Vec3f{0, 1, 0}, -wi, wi}) {
      const Vec3f got = visible_normal<float>({{0, 0, 1}, n, wi, false});
      EXPECT_NEAR(length(got), 1, 1e-5);
      EXPECT_GT(dot(got, wi), 0) << c << " " << n.x << n.y << n.z;
    }
  }
}

}  // namespace
}  // namespace selenite
