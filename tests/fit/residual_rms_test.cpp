// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/evaluate/residual_rms.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "fit/synthetic_renderer.h"

namespace selenite {
namespace {

/// A photo of grey 0.5, and a render that is brighter by `off`, with noise of 0.05 in each pixel.
struct Taken {
  Photo photo = grey_capture();
  Film film;

  explicit Taken(double off) {
    photo.weight.assign(photo.size(), 1);
    photo.total_weight = static_cast<double>(photo.size());
    RenderSettings settings;
    settings.width = settings.height = photo.width;
    settings.spp = 16;
    film = evenly_noisy_film({}, settings, 0.2,
                             [&](std::size_t) { return std::pair(0.5 + off, 0.0); });
  }
};

TEST(ResidualRms, IsTheDifferenceWithoutTheNoise) {
  for (const double off : {0.03, 0.1, -0.3}) {
    const Taken taken(off);
    EXPECT_NEAR(residual_rms(taken.film, taken.photo), std::abs(off), 0.006) << off;
  }
}

// Three pixels of a highlight whose noise came out a little above its variance would alone be a
// residual of a fifth of the photo's brightness.
TEST(ResidualRms, OfAnExplainedPhotoIsZeroAlsoBesideANoisyHighlight) {
  Taken taken(0);
  for (std::size_t i = 40; i < 43; ++i) {
    taken.film.mean[i] = Colorf(5.5f);
    taken.film.variance[i] = Colorf(i == 40 ? 4.f : 24.9f);
  }
  EXPECT_EQ(residual_rms(taken.film, taken.photo), 0);
}

// A pattern of stripes that the render has not: its weight does not fall because it is wrong.
TEST(UnexplainedShare, OfAPatternIsThatOfItsBrightness) {
  Taken taken(0);
  const int width = taken.photo.width;
  for (std::size_t i = 0; i < taken.photo.size(); ++i)
    taken.photo.reference[i] += Colorf(static_cast<int>(i) % width % 8 < 4 ? 0.2f : -0.2f);
  EXPECT_GT(unexplained_share(taken.film, taken.photo), 0.25);
  EXPECT_LT(unexplained_share(taken.film, taken.photo), 0.45) << "of 0.2 / 0.5";
  const Taken explained(0);
  EXPECT_EQ(unexplained_share(explained.film, explained.photo), 0);
}

}  // namespace
}  // namespace selenite
