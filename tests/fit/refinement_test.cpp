// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/refinement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "fit/given_evaluator.h"
#include "fit/inference/asked_precision.h"
#include "fit/run/fit.h"
#include "fit/solver/gauss_newton.h"
#include "fit/synthetic_renderer.h"

namespace selenite {
namespace {

constexpr int kSize = 12;

struct Refined {
  Vector values;
  TrustReport report;
};

/// Verifies values that are off by a part of what is uncertain.
Refined refine(const Vector& x, std::vector<Photo> photos, std::uint64_t seed,
               const std::vector<UnknownParameter>& wanted = synthetic_unknowns(), int spp = 64,
               RefinementOptions options = {}) {
  const Scene scene = synthetic_scene();
  check_photos(scene, photos);
  const Unknowns unknowns(scene, wanted);
  const SlotLayout layout = unknowns.layout(scene);
  const Problem problem{unknowns, layout, photos, losses()[0], 10};
  GivenEvaluator render([&](const Vector& at, const Photo& photo, int spp, std::uint64_t key,
                            std::optional<Differences> derivatives) {
    RenderSettings settings;
    settings.width = settings.height = kSize;
    settings.spp = spp;
    settings.seed = key;
    const Scene now = unknowns.scene_with(scene, at);
    return SyntheticRenderer{0.5, 0.5}(now, now.camera(photo.camera),
                                       derivatives ? layout : SlotLayout(), settings, nullptr);
  });
  Refinement refinement(problem, std::make_unique<GaussNewton>(problem), {unknowns.project(x)},
                        seed, spp, 16, options);
  while (refinement.step(render)) {
  }
  return {refinement.values(), refinement.report()};
}

// 200 runs with photos as noisy as the renders: of about 1200 intervals, correlated within a run, 85
// to 95 % must hold. With true intervals the share has a standard deviation of about 1.3 %, so one
// change of the seeds in some ten thousand would fail.
TEST(Refinement, NinetyPercentIntervalsHoldInNinetyPercent) {
  const Scene scene = synthetic_scene();
  const Vector truth = synthetic_truth();
  int covered = 0, given = 0;
  for (int run = 0; run < 200; ++run) {
    Vector start = truth;
    for (int k = 0; k < start.size(); ++k) start[k] *= 1 + (((run + k) % 5) - 2) * 0.004;
    const Refined found =
        refine(start,
               {synthetic_capture(scene, "Left", kSize, 64, 10000u + static_cast<unsigned>(run)),
                synthetic_capture(scene, "Right", kSize, 64, 20000u + static_cast<unsigned>(run))},
               static_cast<std::uint64_t>(run));
    for (int k = 0; k < truth.size(); ++k) {
      const Confidence& one = found.report.components[static_cast<std::size_t>(k)];
      if (!one.determined) continue;
      ++given;
      covered += one.interval[0] <= truth[k] && truth[k] <= one.interval[1];
    }
  }
  EXPECT_GT(given, 1100);
  const double share = static_cast<double>(covered) / given;
  EXPECT_GT(share, 0.85) << covered << " of " << given;
  EXPECT_LT(share, 0.95) << covered << " of " << given;
}

TEST(Refinement, MendsAnAnswerThatIsNotThereYet) {
  const Scene scene = synthetic_scene();
  const std::vector<Photo> photos{synthetic_capture(scene, "Left", kSize),
                                  synthetic_capture(scene, "Right", kSize)};
  Vector off = synthetic_truth();
  off[0] += 0.05;
  off[5] += 0.05;
  const Refined found = refine(off, photos, 3);
  EXPECT_GT(found.report.passes, 1);
  EXPECT_NEAR(found.values[0], 0.4, 0.01);
  EXPECT_NEAR(found.values[5], 1.5, 0.02);
}

// The look before the last has a quarter of its samples, so that the last step is mostly that one's
// noise, twice as large as its own: over three of its own standard deviations in most fits, and no
// reason to look again.
TEST(Refinement, TheNoiseOfOneLookIsNoReasonForAnother) {
  const Scene scene = synthetic_scene();
  const std::vector<Photo> photos{synthetic_capture(scene, "Left", kSize),
                                  synthetic_capture(scene, "Right", kSize)};
  int fourth = 0;
  for (std::uint64_t run = 0; run < 50; ++run)
    fourth += refine(synthetic_truth(), photos, run, synthetic_unknowns(), 512).report.passes > 3;
  EXPECT_LE(fourth, 5);
}

TEST(Refinement, EndsWhenValuesAreKnownAsWellAsAsked) {
  constexpr int kAll = 1024;
  const Scene scene = synthetic_scene();
  const std::vector<Photo> photos{synthetic_capture(scene, "Left", kSize),
                                  synthetic_capture(scene, "Right", kSize)};
  const Vector truth = synthetic_truth();
  const Unknowns unknowns(scene, synthetic_unknowns());
  const auto widest = [&](const Refined& found, double share) {
    return samples_factors(unknowns, found.values, found.report.components, share).maxCoeff();
  };
  const Refined all = refine(truth, photos, 1, synthetic_unknowns(), kAll);
  ASSERT_EQ(all.report.spp, kAll);
  const double asked = 2 * std::sqrt(widest(all, 1));  // a quarter of the samples suffices
  const Refined found = refine(truth, photos, 1, synthetic_unknowns(), kAll, {.precision = asked});
  EXPECT_LE(widest(found, asked), 1);
  EXPECT_LT(found.report.spp, kAll / 2);
  // What no samples bring there is no reason to take them.
  const Refined beyond =
      refine(truth, photos, 1, synthetic_unknowns(), kAll, {.precision = asked / 1000});
  EXPECT_GT(widest(beyond, asked / 1000), 1);
  EXPECT_EQ(beyond.report.passes, 2);
}

// Four photos of two bodies: colours are known as badly as they differ, by whatever many samples.
TEST(Refinement, TakesNoSamplesWherePhotosDiffer) {
  constexpr int kAll = 1024;
  constexpr double kAsked = 0.04;
  std::vector<Photo> photos;
  for (const float colour : {0.3f, 0.5f}) {
    Scene scene = synthetic_scene();
    scene.appearance.materials[0].values.base_color = {colour, 0.6f, 0.8f};
    for (const char* camera : {"Left", "Right"}) {
      photos.push_back(synthetic_capture(scene, camera, kSize));
      photos.back().id = std::to_string(photos.size());
    }
  }
  const Unknowns unknowns(synthetic_scene(), synthetic_unknowns());
  const Refined found =
      refine(synthetic_truth(), photos, 1, synthetic_unknowns(), kAll, {.precision = kAsked});
  EXPECT_EQ(found.report.passes, 2);
  EXPECT_LT(found.report.spp, kAll / 2);
  const Confidence& red = found.report.components[0];
  ASSERT_TRUE(red.determined);
  EXPECT_GT(red.lasting, 0.8);
  const Vector factors = samples_factors(unknowns, found.values, found.report.components, kAsked);
  EXPECT_TRUE(std::isinf(factors[0]));
  // It is not so wide that it would be given up as noise.
  const double range = unknowns.maximum()[0] - unknowns.minimum()[0];
  const double half = (red.interval[1] - red.interval[0]) / 2;
  EXPECT_LT(std::pow(half / (kAsked * range), 2), 16.0 * kAll / found.report.spp);
}

TEST(Refinement, NamesWhatNoPictureShows) {
  const Scene scene = synthetic_scene();
  auto unknowns = synthetic_unknowns();
  unknowns.push_back({"Body", "metallic", {0.3}, 0, 1, 0.03});
  Vector x(7);
  x << synthetic_truth(), 0.3;
  const Refined found = refine(x, {synthetic_capture(scene, "Left", kSize)}, 1, unknowns);
  EXPECT_FALSE(found.report.components[6].determined);
  EXPECT_EQ(found.values[6], 0.3) << "nothing says that it should move";
  EXPECT_TRUE(found.report.components[0].determined);
}

TEST(Refinement, PromisesNothingAboutWhatIsNotSeen) {
  auto unknowns = synthetic_unknowns();
  unknowns.push_back({"Body", "extinction", {1, 1, 1}, 0.1, 10, 0.03});
  Vector x(9);
  x << synthetic_truth(), 1, 1, 1;
  const Refined found =
      refine(x, {synthetic_capture(synthetic_scene(), "Left", kSize)}, 1, unknowns);
  ASSERT_EQ(found.report.components.size(), 9u);
  for (std::size_t k = 0; k < 9; ++k) EXPECT_EQ(found.report.components[k].determined, k < 6) << k;
}

/// Two scalars of which the one makes up for the other but for its square, as a colour does for a low
/// transmission. Slopes are noisy. What is left of its slope vanishes at `vertex`.
Film squared_film(const Scene& scene, const SlotLayout& layout, const RenderSettings& settings,
                  double vertex) {
  constexpr double kNoise = 0.3, kSlopeNoise = 0.1;
  const auto& m = scene.appearance.materials[0].values;
  Film film = evenly_noisy_film(layout, settings, kNoise, [&](std::size_t i) {
    const double shade = i % 2 == 0 ? 0.5 : 1, second = i / 2 % 2 == 0 ? 1 : -1;
    const double t = m.transmission;
    return std::pair(shade * (m.metallic + t / 3) + second * t * (t - 2 * vertex),
                     std::array{shade / 3 + 2 * second * (t - vertex), shade});
  });
  const auto zero = [](std::size_t) { return std::pair(0.0, 0.0); };
  for (std::size_t s = 0; s < film.slots.size(); ++s) {
    RenderSettings other = settings;
    other.seed = mix64(settings.seed + s + 1);
    const Film noise = evenly_noisy_film(SlotLayout(), other, kSlopeNoise, zero);
    for (std::size_t i = 0; i < film.size(); ++i) {
      film.slots[s].mean[i] += noise.mean[i];
      film.slots[s].half_a[i] += noise.half_a[i];
    }
  }
  return film;
}

// Slopes a twentieth of what they are: each look leads twenty times too far, to and fro, and as far as one
// step may go. The fourth ends where the first began.
TEST(Refinement, IntervalsHoldWhatIsSettledForAfterStepsThatGoTooFar) {
  constexpr double kStart = 0.45, kTruth = 0.5, kReportedSlope = 0.05;
  const Scene scene = synthetic_scene();
  const Unknowns unknowns(scene, {{"Body", "metallic", {kStart}, 0, 1, 0.03}});
  const SlotLayout layout = unknowns.layout(scene);
  std::vector<Photo> photos{grey_capture(kSize)};
  check_photos(scene, photos);
  const Problem problem{unknowns, layout, photos, losses()[0], 10};
  const Vector start = Vector::Constant(1, kStart);
  Refinement refinement(problem, nullptr, {start}, 1, 64, 16);
  int slopes = 0;
  GivenEvaluator render([&](const Vector& at, const Photo&, int spp, std::uint64_t key,
                            std::optional<Differences> derivatives) {
    RenderSettings settings;
    settings.width = settings.height = kSize;
    settings.spp = spp;
    settings.seed = key;
    slopes += derivatives.has_value();
    return evenly_noisy_film(derivatives ? layout : SlotLayout(), settings, 0.01, [&](std::size_t) {
      return std::pair(0.5 + at[0] - kTruth, kReportedSlope);
    });
  });
  while (refinement.step(render)) {
  }
  ASSERT_EQ(refinement.report().passes, 4);
  EXPECT_EQ(slopes, 2 + 3 * 4)
      << "to begin with and in three looks, by turns from each side: they serve the fourth, too";
  const Confidence unsettled = refinement.report().components[0];
  EXPECT_TRUE(!unsettled.determined ||
              (unsettled.interval[0] <= kTruth && kTruth <= unsettled.interval[1]));
  EXPECT_GT(unsettled.standard_error, 0.5) << "the last step, which was longer, counts as well";
  refinement.accept(start);
  const Confidence reported = refinement.report().components[0];
  EXPECT_LE(reported.interval[0], kStart);
  EXPECT_GE(reported.interval[1], kStart);
  EXPECT_FALSE(reported.determined);
}

struct RefinedFromZero : Refined {
  TrustReport accepted;  ///< where the answer is not taken
};

/// Of a fit that has left the transmission at 0: the other has made up for it.
RefinedFromZero refine_from_zero(double transmission, double metallic, std::uint64_t seed,
                                 double vertex = 0) {
  const Scene scene = synthetic_scene();
  const Unknowns unknowns(
      scene, {{"Body", "transmission", {0}, 0, 1, 0.03}, {"Body", "metallic", {0.5}, 0, 1, 0.03}});
  const SlotLayout layout = unknowns.layout(scene);
  const auto rendered = [&](const Vector& at, const SlotLayout& slots, int spp, std::uint64_t key) {
    RenderSettings settings;
    settings.width = settings.height = kSize;
    settings.spp = spp;
    settings.seed = key;
    return squared_film(unknowns.scene_with(scene, at), slots, settings, vertex);
  };
  Photo photo = grey_capture(kSize);
  photo.reference =
      rendered(Vector{{transmission, metallic}}, SlotLayout(), 64, mix64(1000 + seed)).mean;
  std::vector<Photo> photos{photo};
  check_photos(scene, photos);
  const Problem problem{unknowns, layout, photos, losses()[0], 10};
  const Vector start{{0, metallic + transmission / 3}};
  Refinement refinement(problem, nullptr, {start}, seed, 64, 16);
  GivenEvaluator render([&](const Vector& at, const Photo&, int spp, std::uint64_t key,
                            std::optional<Differences> derivatives) {
    return rendered(at, derivatives ? layout : SlotLayout(), spp, key);
  });
  while (refinement.step(render)) {
  }
  RefinedFromZero found{{refinement.values(), refinement.report()}, {}};
  refinement.accept(start);
  found.accepted = refinement.report();
  return found;
}

TEST(Refinement, KnowsOfALowTransmissionByALookFromBeside) {
  constexpr int kRuns = 60;
  const std::array truth{0.03, 0.5};
  int covered = 0, given = 0;
  for (int run = 0; run < kRuns; ++run) {
    const Refined found = refine_from_zero(truth[0], truth[1], static_cast<std::uint64_t>(run));
    for (std::size_t k = 0; k < truth.size(); ++k) {
      const Confidence& one = found.report.components[k];
      if (!one.determined) continue;
      ++given;
      covered += one.interval[0] <= truth[k] && truth[k] <= one.interval[1];
    }
  }
  // From 0 the slopes say nothing about the one, and too much about the other.
  EXPECT_GT(given, 2 * kRuns * 9 / 10);
  EXPECT_GT(covered, given * 85 / 100) << given;
}

TEST(Refinement, FindsATransmissionThatAFitHasLeftAtZero) {
  for (std::uint64_t run = 0; run < 20; ++run) {
    const RefinedFromZero found = refine_from_zero(0.15, 0.45, run);
    EXPECT_NEAR(found.values[0], 0.15, 0.04) << "four standard errors";
    EXPECT_NEAR(found.values[1], 0.45, 0.03);
    EXPECT_GT(found.report.components[0].interval[0], 0);
    EXPECT_EQ(found.accepted.components[0].interval[0], 0) << "the value that is shown is in it";
    EXPECT_GE(found.accepted.components[0].interval[1], 0.15 - 0.04);
  }
}

// On this side the slope leads away from it, and is seen well enough to determine a value.
TEST(Refinement, FindsATransmissionBeyondWhereItsSlopeVanishes) {
  int covered = 0;
  constexpr int kRuns = 20;
  for (std::uint64_t run = 0; run < kRuns; ++run) {
    const RefinedFromZero found = refine_from_zero(0.15, 0.45, run, 0.02);
    EXPECT_NEAR(found.values[0], 0.15, 0.04) << "four standard errors";
    EXPECT_NEAR(found.values[1], 0.45, 0.03);
    const auto [low, high] = found.report.components[0].interval;
    covered += low <= 0.15 && 0.15 <= high;
  }
  EXPECT_GE(covered, 15);
}

TEST(Refinement, NamesTheBound) {
  const Scene scene = synthetic_scene();
  auto unknowns = synthetic_unknowns();
  unknowns[1].minimum = 0.5;  // truth .4
  Vector x = synthetic_truth();
  x[3] = 0.5;
  const Refined found =
      refine(x, {synthetic_capture(scene, "Left", kSize), synthetic_capture(scene, "Right", kSize)},
             1, unknowns);
  EXPECT_EQ(found.report.components[3].at_bound, AtBound::kMinimum);
  EXPECT_EQ(found.values[3], 0.5);
  EXPECT_EQ(found.report.components[3].interval[0], 0.5);
  EXPECT_EQ(found.report.components[0].at_bound, AtBound::kNo);
}

// Photos with noise of their own are explained; a lamp that the scene lacks is not. One in some
// hundred photos would be called unexplained by chance.
TEST(Refinement, TellsNoiseOfThePhotoFromAMisfit) {
  const Scene scene = synthetic_scene();
  Photo photo = synthetic_capture(scene, "Left", kSize, 16, 77);
  EXPECT_TRUE(refine(synthetic_truth(), {photo}, 1).report.misfit.explained);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x) {
      Colorf& pixel =
          photo.reference[static_cast<std::size_t>(y) * kSize + static_cast<std::size_t>(x)];
      pixel = pixel * 2.f;
    }
  const Misfit misfit = refine(synthetic_truth(), {photo}, 1).report.misfit;
  EXPECT_FALSE(misfit.explained);
  EXPECT_GT(misfit.value, 3 * misfit.standard_error);
}

FitSettings default_settings() {
  FitSettings settings = synthetic_settings({0.5, 0.5});
  settings.optimiser = "auto";
  settings.search = settings.refinement = "auto";
  settings.iterations = 30;
  settings.spp = 8;
  return settings;
}

TEST(Refinement, AFitEndsWithItsReport) {
  const Scene scene = synthetic_scene();
  Fit fit(scene, {synthetic_capture(scene, "Left"), synthetic_capture(scene, "Right")},
          synthetic_unknowns(), default_settings());
  bool refined = false;
  while (fit.step()) refined = refined || fit.result().phase == PhaseKind::kRefinement;
  const FitResult& result = fit.result();
  EXPECT_EQ(result.stopped, StopReason::kConverged) << result.message;
  EXPECT_EQ(result.phase_fraction, 1);
  EXPECT_TRUE(refined);
  ASSERT_EQ(result.report.components.size(), 6u);
  EXPECT_EQ(result.best, result.last);
  for (int k = 0; k < 6; ++k) {
    const Confidence& one = result.report.components[static_cast<std::size_t>(k)];
    EXPECT_TRUE(one.determined) << k;
    // Five standard errors: one in a million.
    EXPECT_NEAR(result.best[k], synthetic_truth()[k], 5 * one.standard_error) << k;
    EXPECT_LE(one.interval[0], result.best[k]);
    EXPECT_GE(one.interval[1], result.best[k]);
  }
}

TEST(Refinement, AFitWithoutAlternativesHasCountedToTheEnd) {
  const Scene scene = synthetic_scene();
  FitSettings settings = default_settings();
  settings.search = "off";  // finds no alternatives
  Fit fit(scene, {synthetic_capture(scene, "Left")}, synthetic_unknowns(), settings);
  while (fit.step()) {
  }
  EXPECT_EQ(fit.result().phase, PhaseKind::kRefinement);
  EXPECT_EQ(fit.result().phase_fraction, 1);
}

TEST(Refinement, AFitIteratesLongerTheLessItKnows) {
  const auto iterations = [](const FitSettings& settings) {
    const Scene scene = synthetic_scene();
    Fit fit(scene, {synthetic_capture(scene, "Left")}, synthetic_unknowns(), settings);
    while (fit.step()) {
    }
    return fit.result().iterations;
  };
  FitSettings settings = default_settings();
  const int clear = iterations(settings);
  EXPECT_GE(clear, 10);  // refinement needs their derivatives
  EXPECT_LT(clear, 20);
  settings.renderer = SyntheticRenderer{2, 5};
  EXPECT_GT(iterations(settings), clear);
  settings.renderer = SyntheticRenderer{20, 50};
  EXPECT_EQ(iterations(settings), settings.iterations);
  settings = default_settings();
  settings.refinement = "off";  // nothing would go the rest of the way
  EXPECT_EQ(iterations(settings), settings.iterations);
}

TEST(Refinement, ACancelledRefinementKeepsTheFit) {
  const Scene scene = synthetic_scene();
  FitSettings settings = default_settings();
  Fit whole(scene, {synthetic_capture(scene, "Left")}, synthetic_unknowns(), settings);
  while (whole.result().phase != PhaseKind::kRefinement) ASSERT_TRUE(whole.step());
  const FitResult before = whole.result();
  Progress progress;
  progress.cancelled = true;
  EXPECT_FALSE(whole.step(&progress));
  EXPECT_EQ(whole.result().stopped, StopReason::kCancelled);
  EXPECT_EQ(whole.result().best, before.best);
  EXPECT_EQ(whole.result().history.size(), before.history.size());
  EXPECT_TRUE(whole.result().report.components.empty());
}

TEST(Refinement, AdamWithFewUnknownsIsRefinedWithInstrumentsOfItsOwn) {
  const Scene scene = synthetic_scene();
  FitSettings settings = default_settings();
  settings.optimiser = "adam";
  settings.iterations = 150;
  Fit fit(scene, {synthetic_capture(scene, "Left"), synthetic_capture(scene, "Right")},
          synthetic_unknowns(), settings);
  while (fit.step()) {
  }
  ASSERT_EQ(fit.result().report.components.size(), 6u);
  EXPECT_LT((fit.result().best - synthetic_truth()).cwiseAbs().maxCoeff(), 0.05);
}

}  // namespace
}  // namespace selenite
