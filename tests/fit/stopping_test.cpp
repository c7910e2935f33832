// SPDX-License-Identifier: GPL-3.0-or-later
// When a fit stops by its tolerance, with losses that are written down here.
#include <gtest/gtest.h>

#include "fit/run/fit.h"
#include "fit/synthetic_renderer.h"

namespace selenite {
namespace {

constexpr double kTolerance = 0.01;

/// Iterations of a fit whose validations have these losses, one after another, the last for ever; its
/// steps have the loss `of_steps`. Without noise a loss is the square of the difference to the photo.
FitResult stopped(std::vector<double> validations, double of_steps) {
  FitSettings settings = synthetic_settings({0, 0});
  settings.iterations = 12;
  settings.loss = "dual-buffer";
  settings.tolerance = kTolerance;
  settings.validation_interval = 1;
  std::size_t done = 0;
  settings.renderer = [&](const Scene&, const Camera&, const SlotLayout& layout,
                          const RenderSettings& render_settings, Progress*) {
    double loss = of_steps;
    if (layout.slots.empty()) loss = validations[std::min(done++, validations.size() - 1)];
    return evenly_noisy_film(layout, render_settings, 0,
                             [&](std::size_t) { return std::pair(0.5 + std::sqrt(loss), 0.1); });
  };
  Fit fit(synthetic_scene(), {grey_capture()}, roughness_from(0.4), settings);
  while (fit.step()) {
  }
  EXPECT_EQ(fit.result().message, "");
  return fit.result();
}

TEST(Tolerance, StopsWhenTheMeanOfThreeValidationsIsBelow) {
  const FitResult found = stopped({0.04, 0.04, 0.04, 0.02, 0.0004, 0.0001, 0.0003}, 1);
  EXPECT_EQ(found.stopped, StopReason::kTolerance);
  // The sixth validation is that of five steps: (0.02 + 0.0004 + 0.0001) / 3 < 0.01.
  EXPECT_EQ(found.iterations, 5);
}

TEST(Tolerance, LooksAtNoFewerThanThree) {
  const FitResult found = stopped({0.0001}, 1);
  EXPECT_EQ(found.stopped, StopReason::kTolerance);
  EXPECT_EQ(found.iterations, 2);
}

TEST(Tolerance, DoesNotLookAtTheNoisyLossesOfSteps) {
  const FitResult found = stopped({0.04}, 0.0001);
  EXPECT_EQ(found.stopped, StopReason::kIterations);
  EXPECT_EQ(found.iterations, 12);
}

TEST(Tolerance, OneLowValidationStopsNothing) {
  const FitResult found = stopped({0.04, 0.04, 0.0001, 0.04}, 1);
  EXPECT_EQ(found.stopped, StopReason::kIterations);
}

/// One roughness, from afar, with as many iterations as planned and at most.
FitResult refined(int planned, int most) {
  FitSettings settings = synthetic_settings({0.2, 0.2});
  settings.optimiser = "gauss-newton";
  settings.refinement = "on";
  settings.iterations = planned;
  settings.most_iterations = most;
  const Scene scene = synthetic_scene();
  Fit fit(scene, {synthetic_capture(scene, "Left")}, roughness_from(0.8), settings);
  while (fit.step()) {
  }
  EXPECT_EQ(fit.result().message, "");
  return fit.result();
}

TEST(UntilConverged, EndsAsPlannedUnlessMoreIsAllowed) {
  const FitResult found = refined(3, 0);
  EXPECT_EQ(found.stopped, StopReason::kIterations);
  EXPECT_EQ(found.iterations, 3);
}

TEST(UntilConverged, GoesOnUntilTheValuesSettle) {
  const FitResult found = refined(3, 60);
  EXPECT_EQ(found.stopped, StopReason::kConverged);
  EXPECT_GE(found.iterations, 10) << "fewer cannot have settled";
  EXPECT_LT(found.iterations, 60);
}

TEST(UntilConverged, EndsAtTheMost) {
  const FitResult found = refined(3, 7);
  EXPECT_EQ(found.stopped, StopReason::kIterations);
  EXPECT_EQ(found.iterations, 7);
}

}  // namespace
}  // namespace selenite
