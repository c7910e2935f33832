// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/inference/confidence_intervals.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <random>

#include "fit/evaluate/finite_differences.h"
#include "fit/solver/singular_directions.h"
#include "fit/synthetic_renderer.h"
#include "math/draws.h"

namespace selenite {
namespace {

/// Coat and metallic, both in the middle of [0, 1]: for evidence made by hand.
Unknowns two_unknowns() {
  return {synthetic_scene(),
          {{"Body", "coat_weight", {0.5}, 0, 1, 0.03}, {"Body", "metallic", {0.5}, 0, 1, 0.03}}};
}

/// Of two whose pictures have so much in common, with a standard deviation of 0.01 for each alone.
NormalEquations evidence_of_two(double in_common) {
  NormalEquations evidence(2);
  evidence.normal << 1, in_common, in_common, 1;
  evidence.normal_variance.setConstant(1e-12);
  evidence.score_covariance = 1e-4 * evidence.normal;
  return evidence;
}

// NormalEquations made by hand: the sum of two parameters is known well, their difference hardly.
TEST(ConfidenceIntervals, NamesTheOtherParameterOfAnUndeterminedDirection) {
  const Unknowns unknowns = two_unknowns();
  const Reparametrization reparametrization(unknowns);
  // Standard deviations: .007 of the sum, .2 of the rest.
  const Estimate found =
      estimate(unknowns, reparametrization, unknowns.start(), evidence_of_two(0.999));
  for (std::size_t k : {0u, 1u}) {
    EXPECT_FALSE(found.components[k].determined);
    EXPECT_EQ(found.components[k].correlated_with, 1 - static_cast<int>(k));
  }
  const Estimate apart =
      estimate(unknowns, reparametrization, unknowns.start(), evidence_of_two(0.5));
  EXPECT_TRUE(apart.components[0].determined);
  EXPECT_EQ(apart.components[0].correlated_with, -1);
  // H^-1 of [[1, .5], [.5, 1]] has 4/3 on its diagonal.
  EXPECT_NEAR(apart.components[0].standard_error, 0.01 * std::sqrt(4.0 / 3), 1e-6);
}

TEST(ConfidenceIntervals, ErrorsBeyondNoiseWidenIntervalsAndLeaveTheStepAlone) {
  const Unknowns unknowns = two_unknowns();
  const Reparametrization reparametrization(unknowns);
  NormalEquations evidence = evidence_of_two(0.5);
  evidence.gradient = Vector{{0.02, -0.03}};
  const Vector& x = unknowns.start();
  const Estimate by_noise = estimate(unknowns, reparametrization, x, evidence);
  const Estimate found = estimate(unknowns, reparametrization, x, evidence, {.beyond_noise = 1.5});
  EXPECT_EQ(found.step, by_noise.step);
  EXPECT_EQ(found.surprise, by_noise.surprise);
  for (std::size_t k : {0u, 1u}) {
    const Confidence &wide = found.components[k], &narrow = by_noise.components[k];
    EXPECT_NEAR(wide.standard_error, 1.5 * narrow.standard_error, 1e-12);
    EXPECT_NEAR(wide.interval[1] - wide.interval[0],
                1.5 * (narrow.interval[1] - narrow.interval[0]), 1e-12);
  }
}

// A low transmission, whose first order a colour makes up for: what is left goes with its square.
TEST(ConfidenceIntervals, GoesByTheSquareOfAParameterThatOthersMakeUpFor) {
  constexpr double kHere = 0.03, kTrue = 0.01, kShared = 0.97;
  constexpr double kQuantile90 = 1.6449;  // of the normal distribution
  const Unknowns unknowns(synthetic_scene(), {{"Body", "transmission", {kHere}, 0, 1, 0.03},
                                              {"Body", "metallic", {0.5}, 0, 1, 0.03}});
  const Reparametrization reparametrization(unknowns);
  const auto solved = [&](double shared) {
    NormalEquations evidence(2);
    evidence.normal << 1, shared, shared, 1;
    evidence.normal_variance.setConstant(1e-12);
    // Half of the way, and a little more, is what the slope at 0.03 says.
    const double straight = (kTrue * kTrue - kHere * kHere) / (2 * kHere);
    evidence.gradient = -evidence.normal * Vector{{straight, -shared * straight}};
    evidence.score_covariance = 1e-8 * evidence.normal;
    return std::pair(estimate(unknowns, reparametrization, unknowns.start(), evidence), straight);
  };
  const auto [found, straight] = solved(kShared);
  EXPECT_NEAR(found.step[0], kTrue - kHere, 1e-9);
  EXPECT_NEAR(found.step[1], -kShared * found.step[0], 1e-9);
  const double error = 1e-4 / std::sqrt(1 - kShared * kShared);
  const std::array<double, 2>& interval = found.components[0].interval;
  EXPECT_NEAR(interval[0], std::sqrt(kTrue * kTrue - 2 * kHere * kQuantile90 * error), 1e-9);
  EXPECT_NEAR(interval[1], std::sqrt(kTrue * kTrue + 2 * kHere * kQuantile90 * error), 1e-9);
  EXPECT_GT(kTrue - interval[0], interval[1] - kTrue);  // the way down is the longer one

  // WeightedResidual by itself it steps as any other.
  const auto [apart, direct] = solved(0.5);
  EXPECT_NEAR(apart.step[0], direct, 1e-9);
}

// From 0.1 the square may end at 0 where the slope itself leads to 0.045: the truth lies between.
TEST(ConfidenceIntervals, FromFarTheIntervalHoldsTheEndsOfTheSquareAndOfTheSlope) {
  constexpr double kFrom = 0.1, kStep = -0.055, kError = 0.002, kQuantile90 = 1.6449;
  const Unknowns unknowns(synthetic_scene(), {{"Body", "transmission", {kFrom}, 0, 1, 0.03}});
  const Reparametrization reparametrization(unknowns);
  NormalEquations evidence(1);
  evidence.normal << 1;
  evidence.normal_variance << 1e-12;
  evidence.gradient << -kStep;
  evidence.score_covariance << kError * kError;
  const Estimate found =
      estimate(unknowns, reparametrization, unknowns.start(), evidence, {.squared = {true}});
  EXPECT_NEAR(found.step[0], -kFrom, 1e-12);
  EXPECT_EQ(found.components[0].interval[0], 0);
  EXPECT_NEAR(found.components[0].interval[1], kFrom + kStep + kQuantile90 * kError, 1e-9);
}

// Filters of their own make instruments of columns alike differ; a symmetric mean of both halves
// would go more than twice as far here.
TEST(ConfidenceIntervals, StepsByTheEquationsAsTheyAre) {
  const Unknowns unknowns = two_unknowns();
  const Reparametrization reparametrization(unknowns);
  const Vector way{{0.03, -0.03}};
  NormalEquations evidence(2);
  evidence.normal << 1, 0.99, 0.79, 0.8;
  evidence.normal_variance.setConstant(1e-12);
  evidence.gradient = -evidence.normal * way;
  evidence.score_covariance = 1e-8 * Eigen::MatrixXd::Identity(2, 2);
  const Estimate found = estimate(unknowns, reparametrization, unknowns.start(), evidence);
  EXPECT_LT((found.step - way).norm(), 1e-9);
  const Eigen::MatrixXd back = evidence.normal.inverse();
  const Eigen::MatrixXd covariance = back * evidence.score_covariance * back.transpose();
  for (Eigen::Index k = 0; k < 2; ++k)
    EXPECT_NEAR(found.components[static_cast<std::size_t>(k)].standard_error,
                std::sqrt(covariance(k, k)), 1e-9);
}

TEST(SingularDirections, AreTheEigenvectorsOfASymmetricMatrix) {
  Eigen::Matrix3d normal;
  normal << 1, 0.5, 0.2, 0.5, 1, 0.9, 0.2, 0.9, 0.4;  // its smallest eigenvalue is below 0
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(normal);
  const SingularDirections found(normal);
  Eigen::VectorXd sorted = found.values;
  std::sort(sorted.begin(), sorted.end());
  EXPECT_LT(sorted[0], 0);
  EXPECT_LT((sorted - solver.eigenvalues()).norm(), 1e-12);
  EXPECT_LT((found.in - found.out).norm(), 1e-12);
}

// Two that are known well; one of them was still far on its way.
TEST(ConfidenceIntervals, AnUnsureStepCountsAsAnError) {
  const Unknowns unknowns = two_unknowns();
  const Reparametrization reparametrization(unknowns);
  NormalEquations evidence(2);
  evidence.normal << 1, 0.2, 0.2, 1;
  evidence.normal_variance.setConstant(1e-12);
  evidence.score_covariance = 1e-4 * evidence.normal;
  const auto found = [&](double way, double other) {
    return estimate(unknowns, reparametrization, unknowns.start(), evidence,
                    {{}, Vector{{way, other}}})
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
TEST(ConfidenceIntervals, WhatIsUnseenWidensWhatItIsCoupledTo) {
  const Unknowns unknowns = two_unknowns();
  NormalEquations evidence(2);
  evidence.normal << 1, 0.1, 0.1, 0.3;
  evidence.normal_variance << 1e-12, 1e-12, 1e-12, 1;
  evidence.score_covariance << 1e-6, 0, 0, 1;
  const auto error = [&] {
    return estimate(unknowns, Reparametrization(unknowns), unknowns.start(), evidence)
        .components[0]
        .standard_error;
  };
  EXPECT_NEAR(error(), 0.1 * 0.29, 0.001);
  evidence.normal_variance(0, 1) = evidence.normal_variance(1, 0) = 1;  // nor is the coupling seen
  EXPECT_NEAR(error(), 1e-3, 1e-6);
}

// Of two that go together one leaves at its bound: it may lie further in, and the other with it.
TEST(ConfidenceIntervals, WhatIsAtItsBoundWidensWhatItIsCoupledTo) {
  const Unknowns unknowns(synthetic_scene(), {{"Body", "coat_weight", {0.5}, 0, 1, 0.03},
                                              {"Body", "metallic", {0.5}, 0.5, 1, 0.03}});
  const auto found = [&](double beyond) {
    NormalEquations evidence(2);
    evidence.normal << 1, 0.9, 0.9, 1;
    evidence.normal_variance.setConstant(1e-12);
    evidence.gradient = -evidence.normal * Vector{{0.0, -beyond}};
    evidence.score_covariance = 1e-4 * evidence.normal;
    return estimate(unknowns, Reparametrization(unknowns), unknowns.start(), evidence);
  };
  const Estimate near = found(0.01);
  const double apart = 0.01 / std::sqrt(1 - 0.9 * 0.9), end = -0.01 + 1.6449 * apart;
  EXPECT_EQ(near.components[1].at_bound, AtBound::kMinimum);
  EXPECT_EQ(near.components[1].interval[0], 0.5);
  EXPECT_NEAR(near.components[1].interval[1], 0.5 + end, 1e-9);
  EXPECT_NEAR(near.step[0], -0.9 * 0.01, 1e-9);  // what the bound keeps from the one
  EXPECT_NEAR(near.components[0].standard_error, std::hypot(0.01, 0.9 * end / 1.6449), 1e-9);
  EXPECT_EQ(near.components[0].correlated_with, 1);
  // Far beyond the bound it is there for sure.
  const Estimate far = found(0.1);
  EXPECT_EQ(far.components[1].interval, (std::array<double, 2>{0.5, 0.5}));
  EXPECT_NEAR(far.components[0].standard_error, 0.01, 1e-9);
}

TEST(ConfidenceIntervals, SaysOfALowRoughnessOnlyThatItIsLow) {
  const auto interval = [](double roughness) {
    const Unknowns unknowns(synthetic_scene(),
                            {{"Body", "roughness", {roughness}, 0.02, 0.999, 0.03}});
    NormalEquations evidence(1);
    evidence.normal << 1;
    evidence.normal_variance << 1e-12;
    evidence.score_covariance << 0.03 * 0.03;
    const Reparametrization reparametrization(unknowns);
    return estimate(unknowns, reparametrization, reparametrization.from_values(unknowns.start()),
                    evidence)
        .components[0]
        .interval;
  };
  // WeightedResidual from 0.05, the other picture of the difference lies at 0.20. The interval is 12 % of it
  // wide; where pictures change with the fourth power, that is as far as 0.111.
  EXPECT_EQ(interval(0.05)[0], 0.02);
  EXPECT_NEAR(interval(0.05)[1], 0.1113, 0.001);
  // High ones are as they are in the coordinate: about 5 % either way.
  EXPECT_NEAR(interval(0.5)[0], 0.5 - 0.05 * 0.52, 0.002);
  EXPECT_NEAR(interval(0.5)[1], 0.5 + 0.05 * 0.52, 0.002);
}

// The slope is that of a difference with a picture far above, where it is much steeper.
TEST(ConfidenceIntervals, FindsTheWayDownToALowRoughness) {
  const auto picture = [](double x) { return std::log(std::pow(x, 4) + std::pow(0.2, 4)) / 4; };
  const auto found = [&](double from, double to) {
    const Unknowns unknowns(synthetic_scene(), {{"Body", "roughness", {from}, 0.02, 0.999, 0.03}});
    const Reparametrization reparametrization(unknowns);
    const Vector u = reparametrization.from_values(unknowns.start());
    const Vector above{{u[0] + kConfidence.roughness_difference}};
    const double slope = (picture(reparametrization.to_values(above)[0]) - picture(from)) /
                         kConfidence.roughness_difference;
    NormalEquations evidence(1);
    evidence.normal << slope * slope;
    evidence.gradient << slope * (picture(from) - picture(to));
    evidence.normal_variance << 1e-18;
    evidence.score_covariance << 1e-14 * slope * slope;
    return reparametrization.to_values(u +
                                       estimate(unknowns, reparametrization, u, evidence).step)[0];
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

// Truths of all sizes alike, seen with noise that hides the low ones: on average the answer is nearer to
// them than where the step leads.
TEST(ConfidenceIntervals, ALowRoughnessIsTheMeanOfWhatItMayBe) {
  constexpr double kLow = 0.02, kHigh = 0.12, kError = 0.01;
  constexpr int kTruths = 20000;
  const Unknowns unknowns(synthetic_scene(), {{"Body", "roughness", {kLow}, kLow, 0.999, 0.03}});
  const Reparametrization reparametrization(unknowns);
  const Vector u = reparametrization.from_values(unknowns.start());
  std::mt19937 random(1);
  Normal<double> noise(0, kError);
  double square_of_mean = 0, square_of_end = 0;
  for (int i = 0; i < kTruths; ++i) {
    const double truth = kLow + (kHigh - kLow) * (i + 0.5) / kTruths;
    const double step = reparametrization.from_values(Vector{{truth}})[0] - u[0] + noise(random);
    if (step <= 0) continue;  // at its bound
    NormalEquations evidence(1);
    evidence.normal << 1;
    evidence.normal_variance << 1e-12;
    evidence.score_covariance << kError * kError;
    evidence.gradient << -step;
    const Vector end = reparametrization.to_values(u + Vector{{step}});
    const Estimate found = estimate(unknowns, reparametrization, u, evidence);
    square_of_mean += square(reparametrization.to_values(u + found.step)[0] - truth);
    square_of_end += square(end[0] - truth);
  }
  EXPECT_LT(square_of_mean, 0.9 * square_of_end);
  EXPECT_GT(square_of_mean, 0);
}

TEST(ConfidenceIntervals, ARoughnessThatTurnsBackStaysWithinTheWayThatWasGone) {
  const Unknowns unknowns(synthetic_scene(), roughness_from(0.5));
  const Reparametrization reparametrization(unknowns);
  const Vector u = reparametrization.from_values(unknowns.start());
  const auto step = [&](double gone, double pull) {
    NormalEquations evidence(1);
    evidence.normal << 1;
    evidence.normal_variance << 1e-12;
    evidence.score_covariance << 1e-14;
    evidence.gradient << -pull;
    return estimate(unknowns, reparametrization, u, evidence, {.previous_step = Vector{{gone}}})
        .step[0];
  };
  EXPECT_NEAR(step(-0.3, 0.3), 0.15, 1e-9);
  EXPECT_NEAR(step(-0.3, 0.1), 0.075, 1e-9);
  EXPECT_LT(step(0.3, -0.3), -0.149);
  EXPECT_GT(step(0.3, -0.3), -0.3);
  EXPECT_NEAR(step(0.3, 0.3), 0.3, 1e-9) << "on the same way";
  EXPECT_NEAR(step(-0.01, 0.3), 0.3, 1e-9) << "the way before was noise";
}

}  // namespace
}  // namespace selenite
