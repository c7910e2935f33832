// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "fit/solver/gauss_newton.h"
#include "fit/synthetic_renderer.h"

// What Gauss-Newton keeps of its iterations, and what it forgets.
namespace selenite {
namespace {

constexpr double kTruth = 0.4;  // roughness of the synthetic scene

/// One photo of it and an unknown roughness.
struct Roughness {
  Scene scene = synthetic_scene();
  Unknowns unknowns{scene, {{"Body", "roughness", {0.9}, 0.05, 0.95, 0.03}}};
  SlotLayout layout{unknowns.layout(scene)};
  std::vector<Photo> photos{synthetic_capture(scene, "Left")};
  Problem problem{unknowns, layout, photos, find_loss("dual-buffer"), 100};

  Roughness() { check_photos(scene, photos); }
  Roughness(const Roughness&) = delete;  // the problem refers to members
  Roughness& operator=(const Roughness&) = delete;

  Observation seen(const Vector& x, const SyntheticRenderer& renderer, std::uint64_t seed) const {
    const Scene now = unknowns.scene_with(scene, x);
    RenderSettings settings;
    settings.width = settings.height = kSyntheticSize;
    settings.spp = 4;
    settings.seed = seed;
    return {0, renderer(now, now.camera("Left"), layout, settings, nullptr), {}};
  }
};

/// How far from the truth a descent without noise is after some steps.
double error_after(int steps, const GaussNewtonOptions& options) {
  const Roughness one;
  GaussNewton fit(one.problem, options);
  Vector x = one.unknowns.start();
  for (int i = 0; i < steps; ++i) {
    const Observation seen = one.seen(x, {0, 0}, 0);
    x = fit.step(x, std::span(&seen, 1));
  }
  return std::abs(x[0] - kTruth);
}

// The picture of a rough body changes by other slopes than that of a smooth one.
TEST(GaussNewton, ForgetsEquationsThatWereMadeFarFromTheAnswer) {
  GaussNewtonOptions keeping;
  keeping.aging = 0;
  EXPECT_LT(error_after(30, {}), 0.5 * error_after(30, keeping));
}

TEST(GaussNewton, EstimatesTheMeanOfItsLastIterates) {
  const Roughness one;
  GaussNewton fit(one.problem);
  Vector x = one.unknowns.start();
  std::vector<double> last;
  for (std::uint64_t i = 0; i < 40; ++i) {
    const Observation seen = one.seen(x, {0.5, 2}, 1 + i);
    x = fit.step(x, std::span(&seen, 1));
    last.push_back(fit.reparametrization().from_values(x)[0]);
  }
  double mean = 0;
  for (std::size_t i = 32; i < 40; ++i) mean += last[i] / 8;
  const double found = fit.reparametrization().from_values(fit.estimate(x))[0];
  EXPECT_NEAR(found, mean, 1e-9);
  EXPECT_GT(std::abs(found - last.back()), 1e-6) << "else nothing is shown";
}

}  // namespace
}  // namespace selenite
