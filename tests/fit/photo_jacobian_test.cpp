// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/evaluate/photo_jacobian.h"

#include <gtest/gtest.h>

#include "math/error.h"
#include "scene/small_scenes.h"

namespace selenite {
namespace {

/// A matte square that fills the picture under a sky of radiance 2: a pixel is twice its colour.
Scene matte_scene() {
  SceneBuilder builder;
  place(builder, quad_mesh(50), builder.add_material(matte("Body", 0.4)));
  add_view(builder, {0, 0, 4}, {0, 0, 0});
  set_sky(builder, 2);
  return builder.build();
}

PhotoJacobian look_at_matte(const Scene& scene, int spp) {
  const Unknowns unknowns(scene, {{"Body", "base_color", {0.4, 0.5, 0.6}, 0, 1, 0.03},
                                  {"World", "strength", {2}, 0.01, 100, 0.03}});
  RenderSettings settings;
  settings.width = settings.height = 16;
  settings.spp = spp;
  settings.seed = 3;
  return photo_jacobian(scene, unknowns, "Camera 0", settings);
}

// Means over 256 pixels of 32 samples, whose deviation is below 1: 5 standard errors are 0.08.
TEST(PhotoJacobian, HalvesHaveTheSlopesOnPaper) {
  const PhotoJacobian seen = look_at_matte(matte_scene(), 64);
  for (const Jacobian& half : {seen.a, seen.b}) {
    ASSERT_EQ(half.rows(), 3 * 16 * 16);
    ASSERT_EQ(half.cols(), 4);
    for (Eigen::Index c = 0; c < 3; ++c) {
      double own = 0, sky = 0;
      for (Eigen::Index i = 0; i < half.rows(); ++i) {
        if (i % 3 != c) {
          EXPECT_EQ(half(i, c), 0);
          continue;
        }
        own += half(i, c) / 256.0;
        sky += half(i, 3) / 256.0;
      }
      EXPECT_NEAR(own, 2, 0.08);
      // By the logarithm of the strength: the radiance itself.
      EXPECT_NEAR(sky, 2 * (0.4 + 0.1 * static_cast<double>(c)), 0.08);
    }
  }
  EXPECT_NE(seen.a, seen.b);
}

TEST(PhotoJacobian, OneSampleHasNoSecondHalf) {
  EXPECT_THROW((void)look_at_matte(matte_scene(), 1), InvalidArgument);
}

}  // namespace
}  // namespace selenite
