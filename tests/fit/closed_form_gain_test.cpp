// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/objective/closed_form_gain.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fit/problem/pixel_weights.h"
#include "fit/run/fit.h"
#include "fit/synthetic_renderer.h"

namespace selenite {
namespace {

const Colorf kGain{1.7f, 1, 0.6f};

/// Photos of both cameras, the second one with another exposure and white balance.
std::vector<Photo> photos(const Colorf& gain, GainFreedom freedom) {
  const Scene scene = synthetic_scene();
  std::vector<Photo> both{synthetic_capture(scene, "Left"), synthetic_capture(scene, "Right")};
  for (Colorf& pixel : both[1].reference) pixel *= gain;
  both[1].gain_freedom = freedom;
  return both;
}

FitResult fitted(std::vector<Photo> photos, const char* optimiser) {
  FitSettings settings = synthetic_settings();
  settings.optimiser = optimiser;
  settings.iterations = 40;
  settings.spp = 8;
  settings.refinement = "on";
  Fit fit(synthetic_scene(), std::move(photos), {synthetic_unknowns()[0]}, settings);
  while (fit.step()) {
  }
  EXPECT_TRUE(fit.result().message.empty()) << fit.result().message;
  return fit.result();
}

// As if the photo had been multiplied by nothing: within 2 %, by either optimiser.
TEST(FreeGain, IsFoundAndLeavesTheValuesAlone) {
  for (const char* optimiser : {"gauss-newton", "adam"}) {
    const FitResult plain = fitted(photos(Colorf(1), GainFreedom::kNone), optimiser);
    const FitResult found = fitted(photos(kGain, GainFreedom::kRgb), optimiser);
    EXPECT_LT((found.best - plain.best).cwiseQuotient(plain.best).cwiseAbs().maxCoeff(), 0.02)
        << optimiser;
    ASSERT_EQ(found.photos.size(), 2u);
    EXPECT_EQ(found.photos[0].gain, Colorf(1)) << "it is the gauge";
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(found.photos[1].gain[c], kGain[c], 0.02 * kGain[c]) << optimiser;
      EXPECT_GT(found.photos[1].gain_error[c], 0);
    }
  }
}

// One photo whose brightness is free says nothing of a colour but by the prior, a factor of two.
TEST(FreeGain, WithoutAGaugeIntervalsKnowThatThePriorAloneHoldsTheBrightness) {
  std::vector<Photo> one{photos(Colorf(1), GainFreedom::kNone)[0]};
  const FitResult held = fitted(one, "gauss-newton");
  one[0].gain_freedom = GainFreedom::kScalar;
  const FitResult free = fitted(one, "gauss-newton");
  ASSERT_EQ(free.report.components.size(), 3u);
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_GT(free.report.components[k].standard_error,
              5 * held.report.components[k].standard_error);
}

TEST(FreeGain, OfABlackRenderIsOne) {
  Photo photo = grey_capture(8);
  photo.gain_freedom = GainFreedom::kRgb;
  check_photo(photo);
  const Film black(8, 8, 4);
  EXPECT_EQ(closed_form_gain(black, photo, relative_weights(photo, 1)), Colorf(1));
}

// By hand: render 0.25 everywhere, photo 0.5.
TEST(FreeGain, IsTheRatioOfThePicturesUpToThePrior) {
  Photo photo = grey_capture(32);
  photo.gain_freedom = GainFreedom::kScalar;
  check_photo(photo);
  Film film(32, 32, 4);
  for (Colorf& pixel : film.mean) pixel = Colorf(0.25f);
  const Colorf gain = closed_form_gain(film, photo, relative_weights(photo, 1));
  EXPECT_NEAR(gain.r, 2, 0.01);
  EXPECT_LT(gain.r, 2) << "the prior pulls towards 1";
}

}  // namespace
}  // namespace selenite
