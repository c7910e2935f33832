// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/run/staged_fit.h"

#include <gtest/gtest.h>

#include "fit/synthetic_renderer.h"

namespace selenite {
namespace {

Stage stage_of(const Scene& scene, std::vector<std::string> parameters, int iterations,
               std::uint64_t seed) {
  Stage stage;
  stage.name = parameters.front();
  stage.parameters = std::move(parameters);
  stage.scene = scene;
  stage.photos = {synthetic_capture(scene, "Left"), synthetic_capture(scene, "Right")};
  stage.settings = synthetic_settings();
  stage.settings.optimiser = "adam";
  stage.settings.refinement = "off";
  stage.settings.tolerance = 0;
  stage.settings.iterations = iterations;
  stage.settings.seed = seed;
  return stage;
}

/// The colour, then all.
std::vector<Stage> two_stages(const Scene& scene) {
  std::vector<std::string> all;
  for (const UnknownParameter& one : synthetic_unknowns())
    all.push_back(one.owner + ":" + one.parameter);
  return {stage_of(scene, {all[0]}, 9, 1), stage_of(scene, all, 7, 2)};
}

TEST(StagedFit, EachStageStartsAtTheBestValuesOfTheOneBefore) {
  const Scene scene = synthetic_scene();
  const std::vector<UnknownParameter> unknowns = synthetic_unknowns();
  std::vector<Stage> stages = two_stages(scene);
  stages[1].settings.search = "on";
  StagedFit run(unknowns, stages);
  while (run.ended().empty()) ASSERT_TRUE(run.step());
  EXPECT_EQ(run.fit().settings().search, "off") << "only the first stage searches";
  const FitResult& first = run.ended()[0]->result;
  EXPECT_EQ(first.iterations, 9);
  EXPECT_EQ(first.stopped, StopReason::kIterations);
  const Unknowns& of_first = run.ended()[0]->problem->unknowns();
  ASSERT_EQ(of_first.names().size(), 1u);
  const std::vector<double> colour = of_first.values_of(0, first.best);
  EXPECT_NE(colour, unknowns[0].start);
  EXPECT_EQ(run.point()->scalar(of_first.names()[0]), colour);
  const Unknowns& of_second = run.fit().unknowns();
  EXPECT_EQ(of_second.values_of(0, run.fit().values()), colour);
  for (std::size_t i = 1; i < unknowns.size(); ++i)
    EXPECT_EQ(of_second.values_of(static_cast<int>(i), run.fit().values()), unknowns[i].start) << i;
  while (run.step()) {
  }
  EXPECT_EQ(run.stopped(), StopReason::kIterations);
  EXPECT_EQ(run.fit().result().iterations, 7);
}

TEST(StagedFit, ValuesOfStagesBeforeStandInTheScene) {
  const Scene scene = synthetic_scene();
  std::vector<Stage> stages = two_stages(scene);
  stages[1].parameters.erase(stages[1].parameters.begin());  // the colour stays as it was found
  StagedFit run(synthetic_unknowns(), stages);
  while (run.ended().empty()) ASSERT_TRUE(run.step());
  const UnknownParameter colour = synthetic_unknowns()[0];
  const Scene now = run.fit().problem()->scene_at(run.fit().values());
  EXPECT_EQ(now.get(now.find(colour.owner, colour.parameter)),
            run.point()->scalar(colour.owner + ":" + colour.parameter));
}

TEST(StagedFit, IsResumedInAnyStageToTheSameBits) {
  const Scene scene = synthetic_scene();
  const std::vector<UnknownParameter> unknowns = synthetic_unknowns();
  StagedFit whole(unknowns, two_stages(scene));
  std::vector<std::string> states{whole.saved()};
  while (whole.step()) states.push_back(whole.saved());
  states.push_back(whole.saved());
  ASSERT_GT(states.size(), 16u);
  for (const std::string& state : states) {
    StagedFit again(unknowns, two_stages(scene));
    again.restore(state);
    EXPECT_TRUE(again.saved() == state);  // too long to be shown
    while (again.step()) {
    }
    EXPECT_EQ(again.ended().size(), 1u);
    EXPECT_EQ(again.fit().result().best, whole.fit().result().best);
    EXPECT_EQ(again.fit().result().samples, whole.fit().result().samples);
    EXPECT_EQ(again.ended()[0]->result.best, whole.ended()[0]->result.best);
  }
}

TEST(StagedFit, AStateOfOtherStagesIsRefused) {
  const Scene scene = synthetic_scene();
  StagedFit run(synthetic_unknowns(), two_stages(scene));
  while (run.ended().empty()) run.step();
  const std::string state = run.saved();
  StagedFit one(synthetic_unknowns(), {two_stages(scene)[1]});
  EXPECT_THROW(one.restore(state), InvalidArgument);
  std::vector<Stage> turned = two_stages(scene);
  std::swap(turned[0], turned[1]);
  StagedFit other(synthetic_unknowns(), turned);
  EXPECT_THROW(other.restore(state), InvalidArgument);
  EXPECT_THROW(StagedFit(synthetic_unknowns(), {}), InvalidArgument);
}

TEST(StagedFit, StopsWithoutAnotherStage) {
  const Scene scene = synthetic_scene();
  StagedFit run(synthetic_unknowns(), two_stages(scene));
  Progress progress;
  while (run.fit().result().iterations < 8) ASSERT_TRUE(run.step(&progress));
  progress.cancelled = true;
  while (run.step(&progress)) {
  }
  EXPECT_EQ(run.stopped(), StopReason::kCancelled);
  EXPECT_TRUE(run.ended().empty());
}

}  // namespace
}  // namespace selenite
