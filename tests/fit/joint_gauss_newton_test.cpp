// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/joint_gauss_newton.h"

#include <gtest/gtest.h>

#include "fit/linear_photos.h"
#include "fit/problem/saved_state.h"

namespace selenite {
namespace {

TEST(JointGaussNewton, ColourAndVoxelsThatMakeUpForEachOtherArriveTogether) {
  const LinearPhotos world;
  JointGaussNewton solver(world.problem, world.fields, world.fields.start());
  Vector color = world.unknowns.start();
  for (int i = 0; i < 40; ++i) {
    const auto seen = world.at(color, solver.fields()[0]);
    world.gather(solver);
    color = i % 2 == 0 ? solver.step(color, seen) : solver.step_by_residuals(color, seen);
  }
  EXPECT_LT((color - world.true_color).cwiseAbs().maxCoeff(), 0.002) << color.transpose();
  EXPECT_LT(world.voxel_error(solver), 0.01);
}

/// A solver of the colour alone gives it what voxels do: the check above is about the joint equations.
TEST(JointGaussNewton, TheColourAloneWouldTakeUpWhatVoxelsDo) {
  const LinearPhotos world;
  GaussNewton alone(world.problem);
  Vector color = world.unknowns.start();
  for (int i = 0; i < 40; ++i) color = alone.step(color, world.at(color, world.fields.start()[0]));
  EXPECT_GT((color - world.true_color).cwiseAbs().maxCoeff(), 0.02) << color.transpose();
}

TEST(JointGaussNewton, WithoutInstrumentsResidualsMoveNothing) {
  const LinearPhotos world;
  JointGaussNewton solver(world.problem, world.fields, world.fields.start());
  world.gather(solver);
  const Vector start = world.unknowns.start();
  EXPECT_EQ(solver.step_by_residuals(start, world.at(start, solver.fields()[0])), start);
  EXPECT_EQ(solver.fields()[0], world.fields.start()[0]);
}

TEST(JointGaussNewton, ASavedSolverStepsToTheSameBits) {
  const LinearPhotos world;
  JointGaussNewton first(world.problem, world.fields, world.fields.start());
  Vector color = world.unknowns.start();
  for (int i = 0; i < 3; ++i) {
    world.gather(first);
    color = first.step(color, world.at(color, first.fields()[0]));
  }
  JointGaussNewton second(world.problem, world.fields, world.fields.start());
  SavedState writing;
  first.members(writing);
  SavedState reading(writing.sealed());
  second.members(reading);
  const auto seen = world.at(color, first.fields()[0]);
  EXPECT_EQ(first.step(color, seen), second.step(color, seen));
  EXPECT_EQ(first.fields()[0], second.fields()[0]);
}

}  // namespace
}  // namespace selenite
