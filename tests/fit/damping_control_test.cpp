// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/damping_control.h"

#include <gtest/gtest.h>

namespace selenite {
namespace {

constexpr DampingOptions kOptions;

Vector at(double x) { return Vector::Constant(1, x); }

/// A solver whose best loss, of 1 without noise, was at 0.25, and that has made a long step.
DampingControl after_a_long_step() {
  DampingControl control;
  control.note_loss({1, 0}, at(0.25));
  control.note_step(1);
  return control;
}

TEST(DampingControl, ARejectedStepRaisesTheDampingAndReturnsToTheBestValues) {
  DampingControl control = after_a_long_step();
  EXPECT_EQ(control.damping(), kOptions.first);
  ASSERT_TRUE(control.rejects({2, 0}));
  EXPECT_DOUBLE_EQ(control.damping(), kOptions.first * kOptions.increase);
  EXPECT_EQ(control.best(), at(0.25));
  EXPECT_EQ(control.kept(), 1) << "it is where its equations were made";
}

TEST(DampingControl, AnAcceptedStepLowersIt) {
  DampingControl control = after_a_long_step();
  control.accept(0);
  EXPECT_DOUBLE_EQ(control.damping(), kOptions.first * kOptions.decrease);
  control.accept(kOptions.first);
  EXPECT_DOUBLE_EQ(control.damping(), kOptions.first) << "not below the least";
}

TEST(DampingControl, TheStepAfterARejectionLeavesItAsItIs) {
  DampingControl control = after_a_long_step();
  ASSERT_TRUE(control.rejects({2, 0}));
  const double raised = control.damping();
  control.accept(0);
  EXPECT_EQ(control.damping(), raised);
  control.accept(0);
  EXPECT_DOUBLE_EQ(control.damping(), raised * kOptions.decrease);
}

TEST(DampingControl, OnlyALongStepWithALossBeyondNoiseIsRejected) {
  EXPECT_FALSE(after_a_long_step().rejects({1 + 0.9 * kOptions.worse_by, 0}));
  EXPECT_TRUE(after_a_long_step().rejects({1 + 1.1 * kOptions.worse_by, 0}));
  // Two losses of variance 0.02: the standard deviation of their difference is 0.2.
  DampingControl noisy;
  noisy.note_loss({1, 0.02}, at(0));
  noisy.note_step(1);
  const double limit = 1 + kOptions.worse_by + 0.2 * kOptions.worse_sigmas;
  EXPECT_FALSE(DampingControl(noisy).rejects({limit - 0.01, 0.02}));
  EXPECT_TRUE(DampingControl(noisy).rejects({limit + 0.01, 0.02}));
  DampingControl near = after_a_long_step();
  near.note_step(kOptions.large_step);
  EXPECT_FALSE(near.rejects({100, 0}));
  EXPECT_FALSE(DampingControl().rejects({100, 0})) << "nothing to return to";
}

TEST(DampingControl, RejectionsInARowEnd) {
  DampingControl control = after_a_long_step();
  for (int i = 0; i < kOptions.most_rejections; ++i) {
    control.note_step(1);
    ASSERT_TRUE(control.rejects({2, 0})) << i;
  }
  control.note_step(1);
  EXPECT_FALSE(control.rejects({2, 0}));
}

TEST(DampingControl, TheBestValuesAreThoseOfTheSmallestLoss) {
  DampingControl control;
  for (const double loss : {3.0, 1.0, 2.0}) control.note_loss({loss, 0}, at(loss));
  EXPECT_EQ(control.best(), at(1));
  control.forget_best();
  control.note_loss({9, 0}, at(9));
  EXPECT_EQ(control.best(), at(9));
}

TEST(DampingControl, ALongStepKeepsLittleOfThePast) {
  DampingControl control;
  EXPECT_EQ(control.kept(), 1);
  control.note_step(kOptions.forget_at);
  EXPECT_NEAR(control.kept(), std::exp(-1), 1e-12);
  control.note_step(10);
  EXPECT_EQ(control.kept(), kOptions.least_kept);
}

TEST(DampingControl, TheLeastDampingFallsLateInAFit) {
  const DampingControl control;
  EXPECT_EQ(control.least(63 / 100.0), kOptions.early);
  EXPECT_EQ(control.least(64 / 100.0), kOptions.late);
}

}  // namespace
}  // namespace selenite
