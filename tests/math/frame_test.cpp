// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "math/rng.h"
#include "math/sampling.h"
#include "math/vec.h"

namespace selenite {
namespace {

template <class T>
void expect_orthonormal(const Vec3<T>& n, T tolerance) {
  const Frame<T> f = Frame<T>::from_normal(n);
  EXPECT_NEAR(dot(f.s, f.s), 1, tolerance);
  EXPECT_NEAR(dot(f.t, f.t), 1, tolerance);
  EXPECT_NEAR(dot(f.s, f.t), 0, tolerance);
  EXPECT_NEAR(dot(f.s, f.n), 0, tolerance);
  EXPECT_NEAR(dot(f.t, f.n), 0, tolerance);
  const Vec3<T> z = cross(f.s, f.t);
  EXPECT_NEAR(z.x, n.x, tolerance);
  EXPECT_NEAR(z.y, n.y, tolerance);
  EXPECT_NEAR(z.z, n.z, tolerance);
  const Vec3<T> v{T(0.2), T(-0.7), T(0.4)}, back = f.to_world(f.to_local(v));
  EXPECT_NEAR(back.x, v.x, tolerance);
  EXPECT_NEAR(back.y, v.y, tolerance);
  EXPECT_NEAR(back.z, v.z, tolerance);
}

TEST(Frame, IsRightHandedAndOrthonormalAtThePolesAndNearThem) {
  for (const float z : {1.0f, -1.0f}) {
    expect_orthonormal<float>({0, 0, z}, 1e-6f);
    for (const float tilt : {1e-8f, 1e-6f, 1e-4f, 1e-3f, 1e-2f})
      for (const float turn : {0.0f, 1.0f, 2.5f, 4.0f}) {
        const Vec3f n = normalize(Vec3f{tilt * std::cos(turn), tilt * std::sin(turn), z});
        expect_orthonormal<float>(n, 1e-6f);
      }
  }
  expect_orthonormal<float>({0, 1, 0.0f}, 1e-6f);
  expect_orthonormal<float>({0, 1, -0.0f}, 1e-6f);
  expect_orthonormal<double>({0, 0, -1}, 1e-15);
}

TEST(Frame, IsOrthonormalInEveryDirection) {
  Random random(1, 0, 0);
  for (std::uint32_t i = 0; i < 20000; ++i) {
    random.start_bounce(i);
    const Vec3f n = square_to_cone(random.uniform(0), random.uniform(1), 2.0f);
    expect_orthonormal<float>(normalize(n), 2e-6f);
  }
}

}  // namespace
}  // namespace selenite
