// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/uncertainty.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "fit/directions.h"
#include "fit/fit.h"
#include "fit/gauss_newton.h"
#include "fit/secants.h"
#include "fit/synthetic_renderer.h"

namespace selenite {
namespace {

constexpr int kSize = 12;

/// A photo with noise of its own, as from `spp` samples; 0: none.
Capture noisy_capture(const Scene& scene, const char* camera, int spp, std::uint64_t seed) {
  if (spp == 0) return synthetic_capture(scene, camera, kSize);
  RenderSettings settings;
  settings.width = settings.height = kSize;
  settings.spp = spp;
  settings.seed = seed;
  Capture capture;
  capture.camera = camera;
  capture.width = capture.height = kSize;
  capture.reference =
      SyntheticRenderer{0.5, 0}(scene, scene.camera(camera), SlotLayout(), settings, nullptr).mean;
  return capture;
}

struct Verified {
  Vector values;
  TrustReport report;
};

/// Verifies values that are off by a part of what is uncertain.
Verified verify(const Vector& x, std::vector<Capture> captures, std::uint64_t seed,
                const std::vector<UnknownParameter>& wanted = synthetic_unknowns(), int spp = 64) {
  const Scene scene = synthetic_scene();
  check_captures(scene, captures);
  const Unknowns unknowns(scene, wanted);
  const SlotLayout layout(scene, unknowns.parameters());
  const Problem problem{unknowns, layout, captures, losses()[0], 10};
  const GaussNewton none(problem);
  const RenderAt render = [&](const Vector& at, const Capture& photo, int spp, std::uint64_t key,
                              std::optional<Side> derivatives) {
    RenderSettings settings;
    settings.width = settings.height = kSize;
    settings.spp = spp;
    settings.seed = key;
    const Scene now = unknowns.scene_with(scene, at);
    return SyntheticRenderer{0.5, 0.5}(now, now.camera(photo.camera),
                                       derivatives ? layout : SlotLayout(), settings, nullptr);
  };
  Verification verification(problem, none, unknowns.project(x), seed, spp, 16);
  while (verification.step(render)) {
  }
  return {verification.values(), verification.report()};
}

/// Transmission and metallic, both in the middle of [0, 1]: for evidence made by hand.
Unknowns two_unknowns() {
  return {synthetic_scene(),
          {{"Body", "transmission", {0.5}, 0, 1, 0.03}, {"Body", "metallic", {0.5}, 0, 1, 0.03}}};
}

// 200 runs with photos as noisy as the renders: of about 1200 intervals, correlated within a run, 85
// to 95 % must hold. With true intervals the share has a standard deviation of about 1.3 %, so one
// change of the seeds in some ten thousand would fail.
TEST(Uncertainty, NinetyPercentIntervalsHoldInNinetyPercent) {
  const Scene scene = synthetic_scene();
  const Vector truth = synthetic_truth();
  int held = 0, given = 0;
  for (int run = 0; run < 200; ++run) {
    Vector start = truth;
    for (int k = 0; k < start.size(); ++k) start[k] *= 1 + (((run + k) % 5) - 2) * 0.004;
    const Verified found =
        verify(start,
               {noisy_capture(scene, "Left", 64, 10000u + static_cast<unsigned>(run)),
                noisy_capture(scene, "Right", 64, 20000u + static_cast<unsigned>(run))},
               static_cast<std::uint64_t>(run));
    for (int k = 0; k < truth.size(); ++k) {
      const Confidence& one = found.report.components[static_cast<std::size_t>(k)];
      if (!one.determined) continue;
      ++given;
      held += one.interval[0] <= truth[k] && truth[k] <= one.interval[1];
    }
  }
  EXPECT_GT(given, 1100);
  const double share = static_cast<double>(held) / given;
  EXPECT_GT(share, 0.85) << held << " of " << given;
  EXPECT_LT(share, 0.95) << held << " of " << given;
}

TEST(Uncertainty, MendsAnAnswerThatIsNotThereYet) {
  const Scene scene = synthetic_scene();
  const std::vector<Capture> photos{synthetic_capture(scene, "Left", kSize),
                                    synthetic_capture(scene, "Right", kSize)};
  Vector off = synthetic_truth();
  off[0] += 0.05;
  off[5] += 0.05;
  const Verified found = verify(off, photos, 3);
  EXPECT_GT(found.report.passes, 1);
  EXPECT_NEAR(found.values[0], 0.4, 0.01);
  EXPECT_NEAR(found.values[5], 1.5, 0.02);
}

// The look before the last has a quarter of its samples, so that the last step is mostly that one's
// noise, twice as large as its own: over three of its own standard deviations in most fits, and no
// reason to look again.
TEST(Uncertainty, TheNoiseOfOneLookIsNoReasonForAnother) {
  const Scene scene = synthetic_scene();
  const std::vector<Capture> photos{synthetic_capture(scene, "Left", kSize),
                                    synthetic_capture(scene, "Right", kSize)};
  int fourth = 0;
  for (std::uint64_t run = 0; run < 50; ++run)
    fourth += verify(synthetic_truth(), photos, run, synthetic_unknowns(), 512).report.passes > 3;
  EXPECT_LE(fourth, 5);
}

TEST(Uncertainty, NamesWhatNoPictureShows) {
  const Scene scene = synthetic_scene();
  auto unknowns = synthetic_unknowns();
  unknowns.push_back({"Body", "metallic", {0.3}, 0, 1, 0.03});
  Vector x(7);
  x << synthetic_truth(), 0.3;
  const Verified found = verify(x, {synthetic_capture(scene, "Left", kSize)}, 1, unknowns);
  EXPECT_FALSE(found.report.components[6].determined);
  EXPECT_EQ(found.values[6], 0.3) << "nothing says that it should move";
  EXPECT_TRUE(found.report.components[0].determined);
}

// Evidence made by hand: the sum of two parameters is known well, their difference hardly.
TEST(Uncertainty, NamesTheOtherParameterOfAnUndeterminedDirection) {
  const Unknowns unknowns = two_unknowns();
  const Coordinates coordinates(unknowns);
  Evidence evidence(2);
  evidence.normal << 1, 0.999, 0.999, 1;
  evidence.normal_variance.setConstant(1e-12);
  evidence.spread = 1e-4 * evidence.normal;  // standard deviations: .007 of the sum, .2 of the rest
  const Estimate found = estimate(unknowns, coordinates, unknowns.start(), evidence);
  for (std::size_t k : {0u, 1u}) {
    EXPECT_FALSE(found.components[k].determined);
    EXPECT_EQ(found.components[k].correlated_with, 1 - static_cast<int>(k));
  }
  evidence.normal(0, 1) = evidence.normal(1, 0) = 0.5;
  evidence.spread = 1e-4 * evidence.normal;
  const Estimate apart = estimate(unknowns, coordinates, unknowns.start(), evidence);
  EXPECT_TRUE(apart.components[0].determined);
  EXPECT_EQ(apart.components[0].correlated_with, -1);
  // H^-1 of [[1, .5], [.5, 1]] has 4/3 on its diagonal.
  EXPECT_NEAR(apart.components[0].standard_error, 0.01 * std::sqrt(4.0 / 3), 1e-6);
}

// Filters of their own make instruments of columns alike differ; a symmetric mean of both halves
// would go more than twice as far here.
TEST(Uncertainty, StepsByTheEquationsAsTheyAre) {
  const Unknowns unknowns = two_unknowns();
  const Coordinates coordinates(unknowns);
  const Vector way{{0.03, -0.03}};
  Evidence evidence(2);
  evidence.normal << 1, 0.99, 0.79, 0.8;
  evidence.normal_variance.setConstant(1e-12);
  evidence.gradient = -evidence.normal * way;
  evidence.spread = 1e-8 * Eigen::MatrixXd::Identity(2, 2);
  const Estimate found = estimate(unknowns, coordinates, unknowns.start(), evidence);
  EXPECT_LT((found.step - way).norm(), 1e-9);
  const Eigen::MatrixXd back = evidence.normal.inverse();
  const Eigen::MatrixXd covariance = back * evidence.spread * back.transpose();
  for (Eigen::Index k = 0; k < 2; ++k)
    EXPECT_NEAR(found.components[static_cast<std::size_t>(k)].standard_error,
                std::sqrt(covariance(k, k)), 1e-9);
}

TEST(Directions, AreTheEigenvectorsOfASymmetricMatrix) {
  Eigen::Matrix3d normal;
  normal << 1, 0.5, 0.2, 0.5, 1, 0.9, 0.2, 0.9, 0.4;  // its smallest eigenvalue is below 0
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(normal);
  const Directions found(normal);
  Eigen::VectorXd sorted = found.values;
  std::sort(sorted.begin(), sorted.end());
  EXPECT_LT(sorted[0], 0);
  EXPECT_LT((sorted - solver.eigenvalues()).norm(), 1e-12);
  EXPECT_LT((found.in - found.out).norm(), 1e-12);
}

// Two that are known well; one of them was still far on its way.
TEST(Uncertainty, AWayThatIsNotSureCountsWhereItWasGone) {
  const Unknowns unknowns = two_unknowns();
  const Coordinates coordinates(unknowns);
  Evidence evidence(2);
  evidence.normal << 1, 0.2, 0.2, 1;
  evidence.normal_variance.setConstant(1e-12);
  evidence.spread = 1e-4 * evidence.normal;
  const auto found = [&](double way, double other) {
    return estimate(unknowns, coordinates, unknowns.start(), evidence, Vector{{way, other}})
        .components;
  };
  const double noise = 0.01 / std::sqrt(1 - 0.2 * 0.2);
  const auto still = found(0, 0), near = found(0.03, 0.001), far = found(0.2, 0.001);
  EXPECT_NEAR(still[0].standard_error, noise, 1e-9);
  EXPECT_NEAR(near[0].standard_error, std::hypot(noise, 0.03), 1e-9);
  EXPECT_NEAR(near[0].interval[1], 0.5 + 1.6449 * std::hypot(noise, 0.03), 1e-6);
  EXPECT_NEAR(near[1].standard_error, std::hypot(noise, 0.001), 1e-9);
  EXPECT_TRUE(near[0].determined);
  EXPECT_FALSE(far[0].determined);
  EXPECT_TRUE(far[1].determined) << "it hardly moved";
}

// The second parameter is lost in noise, but what it does looks like half of the first.
TEST(Uncertainty, WhatIsUnseenWidensWhatItIsCoupledTo) {
  const Unknowns unknowns = two_unknowns();
  Evidence evidence(2);
  evidence.normal << 1, 0.1, 0.1, 0.3;
  evidence.normal_variance << 1e-12, 1e-12, 1e-12, 1;
  evidence.spread << 1e-6, 0, 0, 1;
  const auto error = [&] {
    return estimate(unknowns, Coordinates(unknowns), unknowns.start(), evidence)
        .components[0]
        .standard_error;
  };
  EXPECT_NEAR(error(), 0.1 * 0.29, 0.001);
  evidence.normal_variance(0, 1) = evidence.normal_variance(1, 0) = 1;  // nor is the coupling seen
  EXPECT_NEAR(error(), 1e-3, 1e-6);
}

TEST(Uncertainty, PromisesNothingAboutWhatIsNotSeen) {
  auto unknowns = synthetic_unknowns();
  unknowns.push_back({"Body", "extinction", {1, 1, 1}, 0.1, 10, 0.03});
  Vector x(9);
  x << synthetic_truth(), 1, 1, 1;
  const Verified found =
      verify(x, {synthetic_capture(synthetic_scene(), "Left", kSize)}, 1, unknowns);
  ASSERT_EQ(found.report.components.size(), 9u);
  for (std::size_t k = 0; k < 9; ++k) EXPECT_EQ(found.report.components[k].determined, k < 6) << k;
}

TEST(Uncertainty, SaysOfALowRoughnessOnlyThatItIsLow) {
  const auto interval = [](double roughness) {
    const Unknowns unknowns(synthetic_scene(),
                            {{"Body", "roughness", {roughness}, 0.02, 0.999, 0.03}});
    Evidence evidence(1);
    evidence.normal << 1;
    evidence.normal_variance << 1e-12;
    evidence.spread << 0.03 * 0.03;
    const Coordinates coordinates(unknowns);
    return estimate(unknowns, coordinates, coordinates.from_values(unknowns.start()), evidence)
        .components[0]
        .interval;
  };
  // Seen from 0.05, the other picture of the difference lies at 0.20. The interval is 12 % of it
  // wide; where pictures change with the fourth power, that is as far as 0.111.
  EXPECT_EQ(interval(0.05)[0], 0.02);
  EXPECT_NEAR(interval(0.05)[1], 0.1113, 0.001);
  // High ones are as they are in the coordinate: about 5 % either way.
  EXPECT_NEAR(interval(0.5)[0], 0.5 - 0.05 * 0.52, 0.002);
  EXPECT_NEAR(interval(0.5)[1], 0.5 + 0.05 * 0.52, 0.002);
}

// The slope is that of a difference with a picture far above, where it is much steeper.
TEST(Uncertainty, FindsTheWayDownToALowRoughness) {
  const auto picture = [](double x) { return std::log(std::pow(x, 4) + std::pow(0.2, 4)) / 4; };
  const auto found = [&](double from, double to) {
    const Unknowns unknowns(synthetic_scene(), {{"Body", "roughness", {from}, 0.02, 0.999, 0.03}});
    const Coordinates coordinates(unknowns);
    const Vector u = coordinates.from_values(unknowns.start());
    const Vector above{{u[0] + kBlurSecant}};
    const double slope = (picture(coordinates.to_values(above)[0]) - picture(from)) / kBlurSecant;
    Evidence evidence(1);
    evidence.normal << slope * slope;
    evidence.gradient << slope * (picture(from) - picture(to));
    evidence.normal_variance << 1e-18;
    evidence.spread << 1e-10 * slope * slope;
    return coordinates.to_values(u + estimate(unknowns, coordinates, u, evidence).step)[0];
  };
  EXPECT_NEAR(found(0.08, 0.04), 0.04, 1e-6);
  EXPECT_NEAR(found(0.06, 0.03), 0.03, 1e-6);
  EXPECT_NEAR(found(0.5, 0.4), 0.4, 0.01);
  EXPECT_NEAR(found(0.06, 0.021), 0.021, 1e-6);
  EXPECT_NEAR(found(0.06, 0.001), 0.02, 1e-12);  // the bound
  const double up = found(0.03, 0.06);           // on the way there, not beyond
  EXPECT_GT(up, 0.03);
  EXPECT_LT(up, 0.06);
}

TEST(Uncertainty, NamesTheBound) {
  const Scene scene = synthetic_scene();
  auto unknowns = synthetic_unknowns();
  unknowns[1].minimum = 0.5;  // truth .4
  Vector x = synthetic_truth();
  x[3] = 0.5;
  const Verified found =
      verify(x, {synthetic_capture(scene, "Left", kSize), synthetic_capture(scene, "Right", kSize)},
             1, unknowns);
  EXPECT_EQ(found.report.components[3].at_bound, AtBound::kMinimum);
  EXPECT_EQ(found.values[3], 0.5);
  EXPECT_EQ(found.report.components[3].interval[0], 0.5);
  EXPECT_EQ(found.report.components[0].at_bound, AtBound::kNo);
}

// Photos with noise of their own are explained; a lamp that the scene lacks is not. One in some
// hundred photos would be called unexplained by chance.
TEST(Uncertainty, TellsNoiseOfThePhotoFromAMisfit) {
  const Scene scene = synthetic_scene();
  Capture photo = noisy_capture(scene, "Left", 16, 77);
  EXPECT_TRUE(verify(synthetic_truth(), {photo}, 1).report.misfit.explained);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x) {
      Colorf& pixel =
          photo.reference[static_cast<std::size_t>(y) * kSize + static_cast<std::size_t>(x)];
      pixel = pixel * 2.f;
    }
  const Misfit misfit = verify(synthetic_truth(), {photo}, 1).report.misfit;
  EXPECT_FALSE(misfit.explained);
  EXPECT_GT(misfit.value, 3 * misfit.standard_error);
}

FitSettings default_settings() {
  FitSettings settings = synthetic_settings({0.5, 0.5});
  settings.optimiser = "auto";
  settings.search = settings.verification = "auto";
  settings.iterations = 30;
  settings.spp = 8;
  return settings;
}

TEST(Uncertainty, AFitEndsWithItsReport) {
  const Scene scene = synthetic_scene();
  Fit fit(scene, {synthetic_capture(scene, "Left"), synthetic_capture(scene, "Right")},
          synthetic_unknowns(), default_settings());
  bool verified = false;
  while (fit.step()) verified = verified || fit.result().phase == Phase::kVerifying;
  const FitResult& result = fit.result();
  EXPECT_EQ(result.stopped, StopReason::kArrived) << result.message;
  EXPECT_TRUE(verified);
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

TEST(Uncertainty, AFitIteratesLongerTheLessItKnows) {
  const auto iterations = [](const FitSettings& settings) {
    const Scene scene = synthetic_scene();
    Fit fit(scene, {synthetic_capture(scene, "Left")}, synthetic_unknowns(), settings);
    while (fit.step()) {
    }
    return fit.result().iterations;
  };
  FitSettings settings = default_settings();
  const int clear = iterations(settings);
  EXPECT_GE(clear, 10);  // verification needs their derivatives
  EXPECT_LT(clear, 20);
  settings.renderer = SyntheticRenderer{2, 5};
  EXPECT_GT(iterations(settings), clear);
  settings.renderer = SyntheticRenderer{20, 50};
  EXPECT_EQ(iterations(settings), settings.iterations);
  settings = default_settings();
  settings.verification = "off";  // nothing would go the rest of the way
  EXPECT_EQ(iterations(settings), settings.iterations);
}

TEST(Uncertainty, ACancelledVerificationKeepsTheFit) {
  const Scene scene = synthetic_scene();
  FitSettings settings = default_settings();
  Fit whole(scene, {synthetic_capture(scene, "Left")}, synthetic_unknowns(), settings);
  while (whole.result().phase != Phase::kVerifying) ASSERT_TRUE(whole.step());
  const FitResult before = whole.result();
  Progress progress;
  progress.cancelled = true;
  EXPECT_FALSE(whole.step(&progress));
  EXPECT_EQ(whole.result().stopped, StopReason::kCancelled);
  EXPECT_EQ(whole.result().best, before.best);
  EXPECT_EQ(whole.result().history.size(), before.history.size());
  EXPECT_TRUE(whole.result().report.components.empty());
}

TEST(Uncertainty, AdamWithFewUnknownsIsVerifiedWithInstrumentsOfItsOwn) {
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
