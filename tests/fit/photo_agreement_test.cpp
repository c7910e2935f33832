// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/objective/photo_agreement.h"

#include <gtest/gtest.h>

#include <random>

#include "fit/image_scenes.h"
#include "fit/problem/saved_state.h"
#include "math/draws.h"

namespace selenite {
namespace {

constexpr int kPhotos = 4, kRounds = 5;

/// Share that agrees of gradients with so much in common and so much of each photo's own.
double share_of(double common, double own, int photos = kPhotos, int first_texel = 0) {
  const Fields fields(with_many_texels(board({0.5f, 0.5f, 0.5f, 0.5f}), 0.5f), {texels()});
  PhotoAgreement agreement(fields);
  const auto numbers = static_cast<std::size_t>(fields.start()[0].size());
  std::mt19937 random(3);
  Normal<double> normal;
  std::vector<double> pattern(numbers);
  for (double& one : pattern) one = common * normal(random);
  for (int round = 0; round < kRounds; ++round) {
    for (int photo = 0; photo < photos; ++photo) {
      std::vector<double> gradient(numbers);
      for (std::size_t i = static_cast<std::size_t>(first_texel * photo); i < numbers; ++i)
        gradient[i] = pattern[i] + own * normal(random);
      agreement.add({gradient});
    }
    agreement.end_round();
  }
  return agreement.share(0);
}

TEST(PhotoAgreement, IsWhatAllPhotosShow) {
  EXPECT_NEAR(share_of(1, 0), 1, 1e-9);
  EXPECT_NEAR(share_of(1, 0, 2), 1, 1e-9);
  // 16384 blocks of three numbers: a standard deviation is 0.002. False alarms: below 1 in 10^6.
  EXPECT_NEAR(share_of(0, 1), 0, 0.01);
  EXPECT_NEAR(share_of(1, 1), 0.5, 0.01);
}

TEST(PhotoAgreement, OnePhotoHasNothingToAgreeWith) { EXPECT_EQ(share_of(1, 0, 1), 0); }

/// Of four photos the first sees all texels, and the last a tenth of them. Three blocks are seen in part.
TEST(PhotoAgreement, CountsOnlyThePhotosThatSeeATexel) {
  EXPECT_NEAR(share_of(1, 0, kPhotos, 3 * 257 * 77), 1, 0.01);
}

TEST(PhotoAgreement, IsSaved) {
  const Fields fields(with_many_texels(board({0.5f, 0.5f, 0.5f, 0.5f}), 0.5f), {texels()});
  PhotoAgreement one(fields), other(fields);
  for (int photo = 0; photo < 2; ++photo)
    one.add({std::vector<double>(static_cast<std::size_t>(fields.start()[0].size()), 1.0)});
  one.end_round();
  SavedState out;
  one.members(out);
  SavedState in(out.sealed());
  other.members(in);
  EXPECT_EQ(other.share(0), 1);
}

}  // namespace
}  // namespace selenite
