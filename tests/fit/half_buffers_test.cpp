// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/objective/half_buffers.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fit/objective/alignment.h"
#include "fit/synthetic_renderer.h"

namespace selenite {
namespace {

constexpr int kSide = 24;

/// A photo with slopes, and a render of it whose one derivative is what a shift makes of the picture.
struct Shifted {
  Scene scene = synthetic_scene();
  Unknowns unknowns{scene, {{"Body", "roughness", {0.4}, 0.05, 1, 0.03}}};
  std::vector<Photo> photos{grey_capture(kSide)};
  SlotLayout layout{unknowns.layout(scene)};
  Problem problem{unknowns, layout, photos, find_loss("robust"), 1};
  Observation seen{0, Film(kSide, kSide, 4, 1), {}};

  explicit Shifted(bool align) {
    Photo& photo = photos[0];
    for (std::size_t i = 0; i < photo.size(); ++i) {
      const auto x = static_cast<float>(i % kSide), y = static_cast<float>(i / kSide);
      photo.reference[i] = Colorf(0.5f + 0.2f * std::sin(x / 3) * std::cos(y / 4));
    }
    photo.align = align;
    check_photo(photo);
    const AlignmentSlopes slopes = alignment_slopes(photo);
    SlotFilm& slot = seen.film.slots[0];
    for (std::size_t i = 0; i < photo.size(); ++i) {
      seen.film.mean[i] = seen.film.half_a[i] = photo.reference[i];
      seen.film.variance[i] = Colorf(0.01f);
      for (int c = 0; c < 3; ++c)
        slot.mean[i][c] = slot.half_a[i][c] = slopes(static_cast<Eigen::Index>(3 * i) + c, 0);
    }
  }
  Halves halves() const { return split_halves(problem, seen, Vector::Ones(1)); }
};

TEST(Halves, AreTwiceAsNoisyAsTheWhole) {
  const Halves halves = Shifted(false).halves();
  EXPECT_FLOAT_EQ(halves.variance.minCoeff(), 0.02f);
  EXPECT_FLOAT_EQ(halves.variance.maxCoeff(), 0.02f);
}

TEST(Halves, BothLoseWhatAnAlignmentMakesOfThePicture) {
  const Halves fixed = Shifted(false).halves(), aligned = Shifted(true).halves();
  EXPECT_LT(aligned.jacobian_a.norm(), 0.1f * fixed.jacobian_a.norm());
  EXPECT_LT(aligned.jacobian_b.norm(), 0.1f * fixed.jacobian_b.norm());
}

}  // namespace
}  // namespace selenite
