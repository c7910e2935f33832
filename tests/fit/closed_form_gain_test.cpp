// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/objective/closed_form_gain.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "fit/objective/photo_weights.h"
#include "fit/problem/pixel_weights.h"
#include "fit/run/fit.h"
#include "fit/solver/gauss_newton.h"
#include "fit/synthetic_renderer.h"
#include "math/draws.h"

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

// A picture that is proportional to the colour: a gain makes up for all of it, but for the prior.
TEST(FreeGain, WithoutAGaugeIntervalsKnowThatThePriorAloneHoldsTheBrightness) {
  const auto fit_of = [](GainFreedom freedom) {
    FitSettings settings = synthetic_settings();
    settings.optimiser = "gauss-newton";
    settings.iterations = 20;
    settings.spp = 8;
    settings.refinement = "on";
    settings.renderer = [](const Scene& scene, const Camera&, const SlotLayout& layout,
                           const RenderSettings& render_settings, Progress*) {
      const double colour = scene.appearance.materials[0].values.base_color.r;
      return evenly_noisy_film(layout, render_settings, 0.05, [&](std::size_t i) {
        const double light = 0.5 + 0.4 * std::sin(0.7 * static_cast<double>(i));
        return std::pair(colour * light, light);
      });
    };
    Photo photo = grey_capture();
    for (std::size_t i = 0; i < photo.reference.size(); ++i)
      photo.reference[i] =
          Colorf(static_cast<float>(0.6 * (0.5 + 0.4 * std::sin(0.7 * static_cast<double>(i)))));
    photo.gain_freedom = freedom;
    Fit fit(synthetic_scene(), {photo}, {{"Body", "base_color", {0.4, 0.4, 0.4}, 0, 1, 0.03}},
            settings);
    while (fit.step()) {
    }
    EXPECT_TRUE(fit.result().message.empty()) << fit.result().message;
    return fit.result();
  };
  const FitResult with_gauge = fit_of(GainFreedom::kNone), free = fit_of(GainFreedom::kRgb);
  ASSERT_EQ(with_gauge.report.components.size(), 3u);
  ASSERT_EQ(free.report.components.size(), 3u);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(with_gauge.best[static_cast<Eigen::Index>(k)], 0.6, 0.01);
    EXPECT_TRUE(with_gauge.report.components[k].determined);
    EXPECT_FALSE(free.report.components[k].determined);
    const auto colour = free.best[static_cast<Eigen::Index>(k)];
    EXPECT_GT(free.report.components[k].standard_error, 0.7 * kGainPrior.log_deviation * colour);
  }
  EXPECT_TRUE(with_gauge.report.weak.empty());
  // A direction for each channel: the colour and the gain.
  ASSERT_EQ(free.report.weak.size(), 3u);
  for (const WeakDirection& one : free.report.weak) {
    EXPECT_EQ(one.components.size(), 1u);
    EXPECT_EQ(one.photos, std::vector<int>{0});
  }
  ASSERT_EQ(free.photos.size(), 1u);
  for (int c = 0; c < 3; ++c)
    EXPECT_GT(free.photos[0].gain_error[c], 0.3f * free.photos[0].gain[c]) << "the colour is open";
}

/// A photo of slopes and a render that differs from it, both without noise.
struct Compared {
  Photo photo = grey_capture(40);
  Film film{40, 40, 4};
  Eigen::VectorXf weights;

  explicit Compared(GainFreedom freedom) {
    photo.gain_freedom = freedom;
    check_photo(photo);
    for (std::size_t i = 0; i < photo.size(); ++i) {
      const auto x = static_cast<float>(i % 40), y = static_cast<float>(i / 40);
      photo.reference[i] = {0.5f + 0.3f * std::sin(x / 5), 0.4f, 0.3f + 0.1f * std::cos(y / 7)};
      film.mean[i] = {0.2f + 0.1f * std::sin(x / 4), 0.1f, 0.6f + 0.1f * std::cos(y / 3)};
    }
    film.half_a = film.mean;
    weights = relative_weights(photo, 1);
  }
};

// Gauss-Newton with the gain as one more unknown, its prior one more row, and the gain eliminated.
TEST(FreeGain, IsEliminatedWithItsPriorFromTheNormalEquations) {
  for (const GainFreedom freedom : {GainFreedom::kScalar, GainFreedom::kRgb}) {
    Compared s(freedom);
    const auto flat = [](const Picture& picture) {
      return Eigen::VectorXf(Eigen::Map<const Eigen::VectorXf>(
          &picture.front().r, static_cast<Eigen::Index>(3 * picture.size())));
    };
    const double prior = 20;  // beside a few hundred of the picture
    const Colorf gain = closed_form_gain(s.film, s.photo, s.weights, prior);
    for (Colorf& pixel : s.film.mean) pixel *= gain;
    const Eigen::VectorXf picture = flat(s.film.mean), none = Eigen::VectorXf::Zero(picture.size());
    const Eigen::VectorXf residual = picture - flat(s.photo.reference);
    Eigen::VectorXf slope = picture;
    for (Eigen::Index i = 0; i < slope.size(); ++i)
      slope[i] *= 1 + 0.3f * std::cos(static_cast<float>(i) / 50);
    const auto product = [&](const Eigen::VectorXf& a, const Eigen::VectorXf& b, int channel) {
      double sum = 0;
      for (Eigen::Index i = 0; i < a.size(); ++i)
        if (freedom == GainFreedom::kScalar || i % 3 == channel)
          sum += static_cast<double>(s.weights[i] * a[i] * b[i]);
      return sum;
    };
    const EliminatedGain eliminated(s.film, s.photo, s.weights, prior);
    Eigen::VectorXf left = slope, with_prior = residual;
    eliminated.eliminate(picture, none, none, -1, left);
    eliminated.add_prior(picture, with_prior);
    for (int c = 0; c < 3; ++c) {
      const double common = product(slope, picture, c);
      const double normal =
          product(slope, slope, c) - common * common / (product(picture, picture, c) + prior);
      EXPECT_NEAR(product(left, left, c), normal, 1e-3 * normal) << c;
      const double gradient = product(slope, residual, c);
      EXPECT_NEAR(product(left, with_prior, c), gradient, 2e-3 * std::abs(gradient)) << c;
    }
  }
}

/// A photo of 0.6 times a light, with a free gain: of what the photo shows the colour is open.
struct OpenColour {
  Scene scene = synthetic_scene();
  Unknowns unknowns{scene, {{"Body", "base_color", {0.4, 0.4, 0.4}, 0.05, 1, 0.03}}};
  SlotLayout layout{unknowns.layout(scene)};
  std::vector<Photo> photos{grey_capture(16)};
  Problem problem{unknowns, layout, photos, losses()[0], 60};

  OpenColour() {
    for (std::size_t i = 0; i < photos[0].size(); ++i)
      photos[0].reference[i] = Colorf(0.6f * light(i));
    photos[0].gain_freedom = GainFreedom::kRgb;
    check_photos(scene, photos);
  }
  OpenColour(const OpenColour&) = delete;  // the problem refers to members
  OpenColour& operator=(const OpenColour&) = delete;

  static float light(std::size_t i) { return 0.5f + 0.4f * std::sin(0.7f * static_cast<float>(i)); }
  /// A render without noise, with the gain that it gives.
  Observation seen(const Vector& colour, bool derivatives) const {
    Film film(16, 16, 16, derivatives ? static_cast<int>(layout.slots.size()) : 0);
    for (std::size_t i = 0; i < film.size(); ++i)
      for (int c = 0; c < 3; ++c) film.mean[i][c] = static_cast<float>(colour[c]) * light(i);
    const Colorf gain = closed_form_gain(film, photos[0], gain_weights(problem, photos[0]),
                                         gain_prior(problem, photos[0]));
    for (SlotFilm& slot : film.slots)
      for (std::size_t i = 0; i < film.size(); ++i) slot.mean[i] = gain * light(i);
    for (SlotFilm& slot : film.slots) slot.half_a = slot.mean;
    for (Colorf& pixel : film.mean) pixel *= gain;
    film.half_a = film.mean;
    return {0, std::move(film), {}};
  }
};

// Without derivatives of their own steps go on by those that have been gathered.
TEST(FreeGain, ItsPriorLeadsStepsByResidualsToo) {
  const OpenColour world;
  GaussNewton solver(world.problem);
  Vector colour = world.unknowns.start();
  for (int i = 0; i < 2; ++i) solver.gather(colour, world.seen(colour, true), 1);
  for (int i = 0; i < 40; ++i) {
    const Observation seen = world.seen(colour, false);
    colour = solver.step_by_residuals(colour, std::span(&seen, 1));
  }
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(colour[c], 0.6, 0.05) << "where the gain is 1";
}

// Of 4800 numbers that differ by chance, and of 100 blocks in which all are off alike.
TEST(FreeGain, CountsResidualsOnlyAsFarAsTheyAreIndependent) {
  const Compared s(GainFreedom::kRgb);
  std::mt19937 random(1);
  Normal<float> normal;
  Eigen::VectorXf block_level(100), apart(4800), together(4800);
  for (float& level : block_level) level = normal(random);
  for (Eigen::Index i = 0; i < apart.size(); ++i) {
    const Eigen::Index pixel = i / 3, block = pixel / 40 / 4 * 10 + pixel % 40 / 4;
    const float brightness = 1 / std::sqrt(s.weights[i] * 4800);  // one standard deviation
    apart[i] = brightness * normal(random);
    together[i] = brightness * block_level[block];
  }
  // A sum of 100 squares is within 40 % of its mean but once in 5000.
  EXPECT_NEAR(independent_count(s.photo, s.weights, apart), 4800, 0.5 * 4800);
  EXPECT_NEAR(independent_count(s.photo, s.weights, together), 100, 0.7 * 100);
}

/// A grey film, and one photo value for all pixels; all of them weigh alike.
struct Even {
  Photo photo = grey_capture(32);
  Film film{32, 32, 4};
  Eigen::VectorXf weights = Eigen::VectorXf::Ones(3 * 32 * 32) / (3 * 32 * 32);

  Even(GainFreedom freedom, const Colorf& render, const Colorf& value) {
    photo.gain_freedom = freedom;
    check_photo(photo);
    std::ranges::fill(film.mean, render);
    std::ranges::fill(photo.reference, value);
  }
  /// As `by` says of the pixels with even numbers, and with the other sign of those with odd ones.
  static float alternating(std::size_t i, float by) { return i % 2 == 0 ? by : -by; }
};

TEST(FreeGain, IsNotMadeSmallerByNoise) {
  Even s(GainFreedom::kRgb, Colorf(0.25f), Colorf(0.5f));
  const float noise = 0.2f;
  for (std::size_t i = 0; i < s.film.size(); ++i) {
    s.film.mean[i] += Colorf(Even::alternating(i, noise));
    s.film.variance[i] = Colorf(noise * noise);
  }
  EXPECT_NEAR(closed_form_gain(s.film, s.photo, s.weights, 0).g, 2, 1e-3);
}

// By hand: (1 + 2 + 6) / 3 for all channels together.
TEST(FreeGain, OfAnExposureIsThatOfAllChannels) {
  const Colorf render(0.25f), value(0.25f, 0.5f, 1.5f);
  const Even scalar(GainFreedom::kScalar, render, value), rgb(GainFreedom::kRgb, render, value);
  const Colorf one = closed_form_gain(scalar.film, scalar.photo, scalar.weights, 0);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(one[c], 3, 1e-3);
  EXPECT_NEAR(closed_form_gain(rgb.film, rgb.photo, rgb.weights, 0).b, 6, 1e-3);
}

// Red is off by as much as blue, the other way: an exposure is sure all the same.
TEST(FreeGain, ErrorOfAnExposureIsThatOfAllChannels) {
  const auto error_of = [](GainFreedom freedom) {
    Even s(freedom, Colorf(0.5f), Colorf(0.5f));
    for (std::size_t i = 0; i < s.film.size(); ++i) {
      const float off = i % 32 / 4 % 2 == 0 ? 0.1f : -0.1f;  // in stripes
      s.photo.reference[i] += Colorf(off, 0, -off);
    }
    return gain_error(s.film, Colorf(1), s.photo, s.weights);
  };
  EXPECT_LT(error_of(GainFreedom::kScalar).r, 1e-5f);
  EXPECT_GT(error_of(GainFreedom::kRgb).r, 1e-3f);
}

// Picture 0.5, derivative 0.3: nothing is left of it beside a gain, whatever noise both share.
TEST(FreeGain, TakesWhatADerivativeHasInCommonBesidesNoise) {
  const Even s(GainFreedom::kRgb, Colorf(0.5f), Colorf(0.5f));
  const Eigen::Index size = s.weights.size();
  const float of_picture = 0.2f, of_slope = 0.1f;
  Eigen::VectorXf picture(size), slope(size);
  for (Eigen::Index i = 0; i < size; ++i) {
    const auto pixel = static_cast<std::size_t>(i / 3);
    picture[i] = 0.5f + Even::alternating(pixel, of_picture);
    slope[i] = 0.3f + Even::alternating(pixel, of_slope);
  }
  const EliminatedGain gain(s.film, s.photo, s.weights, 0);
  gain.eliminate(picture, Eigen::VectorXf::Constant(size, of_picture * of_picture),
                 Eigen::VectorXf::Constant(size, of_picture * of_slope), -1, slope);
  EXPECT_NEAR(slope.mean(), 0, 2e-3);  // but for the least size of a prior
}

TEST(FreeGain, OfABlackRenderIsOne) {
  Photo photo = grey_capture(8);
  photo.gain_freedom = GainFreedom::kRgb;
  check_photo(photo);
  const Film black(8, 8, 4);
  EXPECT_EQ(closed_form_gain(black, photo, relative_weights(photo, 1), 1e-3), Colorf(1));
}

// By hand: render 0.25 everywhere, photo 0.5.
TEST(FreeGain, IsTheRatioOfThePicturesUpToThePrior) {
  Photo photo = grey_capture(32);
  photo.gain_freedom = GainFreedom::kScalar;
  check_photo(photo);
  Film film(32, 32, 4);
  for (Colorf& pixel : film.mean) pixel = Colorf(0.25f);
  const Colorf gain = closed_form_gain(film, photo, relative_weights(photo, 1),
                                       gain_prior_strength(count_of(photo)));
  EXPECT_NEAR(gain.r, 2, 0.01);
  EXPECT_LT(gain.r, 2) << "the prior pulls towards 1";
}

}  // namespace
}  // namespace selenite
