// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/problem/pixel_weights.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "fit/synthetic_renderer.h"

namespace selenite {
namespace {

TEST(BoxBlur, IsTheMeanOfWhatLiesInside) {
  Eigen::VectorXf picture = Eigen::VectorXf::Zero(3 * 4 * 3);  // 4 x 3 pixels
  picture[3 * 0 + 1] = 12;                                     // top left, green
  const Eigen::VectorXf blurred = box_blur(picture, 4, 3, 1);
  EXPECT_FLOAT_EQ(blurred[3 * 0 + 1], 12.f / 4);
  EXPECT_FLOAT_EQ(blurred[3 * 1 + 1], 12.f / 6);
  EXPECT_FLOAT_EQ(blurred[3 * 5 + 1], 12.f / 9);
  EXPECT_EQ(blurred[3 * 2 + 1], 0.f);
  EXPECT_EQ(blurred[3 * 0 + 0], 0.f) << "channels stay apart";
}

TEST(BoxBlur, OfOneChannelIsThatOfEachOfThree) {
  constexpr int kWidth = 7, kHeight = 9, kRadius = 2;
  const Eigen::VectorXf gray = Eigen::VectorXf::Random(kWidth * kHeight);
  Eigen::VectorXf picture = Eigen::VectorXf::Zero(3 * gray.size());
  picture(Eigen::seq(1, Eigen::last, 3)) = gray;
  const Eigen::VectorXf blurred = box_blur(picture, kWidth, kHeight, kRadius);
  EXPECT_EQ(Eigen::VectorXf(blurred(Eigen::seq(1, Eigen::last, 3))),
            box_blur(gray, kWidth, kHeight, kRadius));
  for (const int y : {0, 4, kHeight - 1})
    for (const int x : {0, 3, kWidth - 1}) {
      double sum = 0;
      int count = 0;
      for (int q = std::max(y - kRadius, 0); q <= std::min(y + kRadius, kHeight - 1); ++q)
        for (int p = std::max(x - kRadius, 0); p <= std::min(x + kRadius, kWidth - 1); ++p, ++count)
          sum += gray[kWidth * q + p];
      EXPECT_NEAR(blurred[3 * (kWidth * y + x) + 1], sum / count, 1e-6) << x << ' ' << y;
    }
}

// Noise of a photo has bright pixels. Weighted down because they are bright, they would leave the fit
// a photo that is darker than what it shows.
TEST(Weights, DoNotKnowThePixelThatTheyWeigh) {
  std::vector<Photo> one{grey_capture(9)}, other{grey_capture(9)};
  constexpr std::size_t kMiddle = 40;
  one[0].reference[kMiddle - 1] = other[0].reference[kMiddle + 1] = Colorf(9);
  one[0].reference[kMiddle] = Colorf(100);
  other[0].reference[kMiddle] = Colorf(0.1f);
  // As bright as each other but for the one.
  one[0].reference[0] = Colorf(0.1f);
  other[0].reference[0] = Colorf(100);
  const Scene scene = synthetic_scene();
  check_photos(scene, one);
  check_photos(scene, other);
  const Eigen::VectorXf of_one = relative_weights(one[0], 1),
                        of_other = relative_weights(other[0], 1);
  EXPECT_FLOAT_EQ(of_one[3 * kMiddle], of_other[3 * kMiddle]);
  EXPECT_LT(of_one[3 * (kMiddle + 2)], 0.5f * of_other[3 * (kMiddle + 2)])
      << "that of others counts";
}

TEST(Weights, DoNotKnowWhatAMaskHides) {
  std::vector<Photo> photo{grey_capture(8)};
  photo[0].weight.assign(64, 1);
  for (std::size_t i = 0; i < 64; i += 2) photo[0].weight[i] = 0;
  check_photos(synthetic_scene(), photo);
  const Eigen::VectorXf level = brightness(photo[0]);
  for (Eigen::Index i = 1; i < 64; i += 2) EXPECT_NEAR(level[3 * i], 1.3 * 0.5, 1e-5) << i;
}

TEST(Weights, OfASinglePixelAreItsOwn) {
  std::vector<Photo> photo{grey_capture(1)};
  check_photos(synthetic_scene(), photo);
  EXPECT_NEAR(relative_weights(photo[0], 1)[0] * 3, 1 / (0.65 * 0.65), 1e-5);
}

}  // namespace
}  // namespace selenite
