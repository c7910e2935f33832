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

/// A gain that the photos say of with certainty leaves a residual that the prior alone made, a thousandth
/// of it in the photos: voxels follow the photos.
TEST(JointGaussNewton, VoxelsDoNotFollowThePriorOfAGain) {
  const auto moved = [](GainFreedom freedom) {
    LinearPhotos world;
    for (Photo& photo : world.photos) {
      photo.gain_freedom = freedom;
      for (Colorf& pixel : photo.reference) pixel *= Colorf(1.00002f);
    }
    JointGaussNewton solver(world.problem, world.fields, world.fields.start());
    solver.set_fields({world.true_voxels});
    world.gather(solver);
    auto seen = world.at(world.true_color, world.true_voxels);
    for (Observation& one : seen)
      for (Picture* picture : {&one.film.mean, &one.film.half_a})
        for (Colorf& pixel : *picture) pixel *= Colorf(1 / 1.00002f);
    (void)solver.step(world.true_color, seen);
    return world.voxel_error(solver);
  };
  EXPECT_LT(moved(GainFreedom::kRgb), 5 * moved(GainFreedom::kNone));
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
