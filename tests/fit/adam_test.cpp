// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/adam.h"

#include <gtest/gtest.h>

#include "fit/synthetic_renderer.h"

namespace selenite {
namespace {

struct Setting {
  Scene scene = synthetic_scene();
  Unknowns unknowns;
  SlotLayout layout;
  std::vector<Photo> photos;
  Problem problem{unknowns, layout, photos, losses()[0], 100};
  explicit Setting(const std::vector<UnknownParameter>& wanted)
      : unknowns(scene, wanted), layout(unknowns.layout(scene)) {}
};

/// loss = 1/2 sum a_k (x_k - t_k)^2
Vector run_quadratic(Adam& adam, Vector x, const Vector& scale, const Vector& target, int steps) {
  for (int i = 0; i < steps; ++i) x = adam.update(x, scale.cwiseProduct(x - target));
  return x;
}

TEST(Adam, FirstStepIsTheLearningRateWhateverTheScale) {
  const Setting s({{"Body", "base_color", {0.5, 0.5, 0.5}, 0, 1, 0.02}});
  Adam adam(s.problem);
  const Vector x = adam.update(s.unknowns.start(), Vector{{1e-9, -1e6, 0}});
  EXPECT_NEAR(x[0], 0.48, 1e-12);
  EXPECT_NEAR(x[1], 0.52, 1e-12);
  EXPECT_EQ(x[2], 0.5) << "an unknown that the picture does not show stays";
}

TEST(Adam, FindsTheMinimumOfAnIllConditionedQuadratic) {
  const Setting s(synthetic_unknowns());
  Adam adam(s.problem);
  const Vector scale{{1, 10, 100, 0.01, 1, 1e4}}, target = synthetic_truth();
  const Vector x = run_quadratic(adam, s.unknowns.start(), scale, target, 1000);
  EXPECT_LT((x - target).norm(), 1e-3);
}

TEST(Adam, HasALearningRateForEachParameter) {
  const Setting s({{"Body", "roughness", {0.5}, 0, 1, 0.1}, {"Body", "ior", {1.5}, 1, 2, 0.001}});
  Adam adam(s.problem);
  const Vector x = adam.update(s.unknowns.start(), Vector{{1, 1}});
  EXPECT_NEAR(x[0], 0.4, 1e-12);
  EXPECT_NEAR(x[1], 1.499, 1e-12);
}

TEST(Adam, StopsAtTheBoundAndLeavesItAtOnce) {
  const Setting s({{"Body", "roughness", {0.5}, 0.02, 0.9, 0.03}});
  Adam adam(s.problem);
  Vector x = s.unknowns.start();
  for (int i = 0; i < 60; ++i) x = adam.update(x, Vector{{1}});
  EXPECT_EQ(x[0], 0.02);
  // The gradient turns: without care for the momentum it would take 7 steps to turn as well.
  x = adam.update(x, Vector{{-1}});
  EXPECT_GT(x[0], 0.02);
}

TEST(Adam, ACopyGoesOnAlike) {
  const Setting s(synthetic_unknowns());
  Adam adam(s.problem);
  const Vector scale = Vector::Ones(6), target = synthetic_truth();
  const Vector x = run_quadratic(adam, s.unknowns.start(), scale, target, 20);
  const auto copy = adam.clone();
  EXPECT_EQ(run_quadratic(adam, x, scale, target, 20),
            run_quadratic(dynamic_cast<Adam&>(*copy), x, scale, target, 20));
}

TEST(Adam, NamesTheUnknownWhoseDerivativeIsNotFinite) {
  Setting s(synthetic_unknowns());
  s.photos = {synthetic_capture(s.scene, "Left", 4)};
  check_photos(s.scene, s.photos);
  RenderSettings settings;
  settings.width = settings.height = 4;
  std::vector<Observation> seen(1);
  seen[0].film = SyntheticRenderer()(s.scene, s.scene.cameras[0], s.layout, settings, nullptr);
  seen[0].film.slots[1].mean[5].g = std::nanf("");
  seen[0].loss = s.problem.loss.evaluate(seen[0].film, s.photos[0]);
  Adam adam(s.problem);
  try {
    adam.step(s.unknowns.start(), seen);
    FAIL();
  } catch (const std::runtime_error& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("Body:roughness"), std::string::npos) << text;
    EXPECT_NE(text.find("'Left'"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace selenite
