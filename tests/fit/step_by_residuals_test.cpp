// SPDX-License-Identifier: GPL-3.0-or-later
// Gauss-Newton beside fields: steps of the scalars without derivatives of their own.
#include <gtest/gtest.h>

#include "fit/solver/gauss_newton.h"
#include "fit/synthetic_renderer.h"

namespace selenite {
namespace {

/// Two photos, whose truth may move, as it does where fields move.
class Followed {
 public:
  explicit Followed(double noise) : renderer_{noise, noise} { take_photos(scene_); }
  Followed(const Followed&) = delete;  // the problem refers to members
  Followed& operator=(const Followed&) = delete;

  /// The photos as they are at other values.
  void move_to(const Vector& x) { take_photos(unknowns_.scene_with(scene_, x)); }
  std::vector<Observation> seen(const Vector& x, const SlotLayout& layout, std::uint64_t seed) {
    RenderSettings settings;
    settings.width = settings.height = kSyntheticSize;
    settings.spp = 16;
    const Scene scene = unknowns_.scene_with(scene_, x);
    std::vector<Observation> both;
    for (int i = 0; i < 2; ++i) {
      settings.seed = 2 * seed + static_cast<std::uint64_t>(i);
      Film film =
          renderer_(scene, scene_.cameras[static_cast<std::size_t>(i)], layout, settings, nullptr);
      both.push_back({i, std::move(film), {}});
    }
    return both;
  }
  const SlotLayout& layout() const { return layout_; }
  const Unknowns& unknowns() const { return unknowns_; }
  const Problem& problem() const { return problem_; }

 private:
  void take_photos(const Scene& scene) {
    photos_ = {synthetic_capture(scene, "Left"), synthetic_capture(scene, "Right")};
    check_photos(scene_, photos_);
  }

  SyntheticRenderer renderer_;
  Scene scene_ = synthetic_scene();
  Unknowns unknowns_{scene_, synthetic_unknowns()};
  SlotLayout layout_{unknowns_.layout(scene_)};
  std::vector<Photo> photos_;
  Problem problem_{unknowns_, layout_, photos_, losses()[0], 12};
};

class StepByResiduals : public testing::TestWithParam<double> {};

/// But for a roughness, which waits for its own turn: fields paint what blur would be needed for.
TEST_P(StepByResiduals, GoesWhereThePhotosLeadByWhatHasBeenGathered) {
  Followed about(GetParam());
  GaussNewton optimiser(about.problem());
  Vector x = about.unknowns().start();
  EXPECT_EQ(optimiser.step_by_residuals(x, about.seen(x, SlotLayout(), 99)), x)
      << "nothing is known yet";
  for (std::uint64_t i = 0; i < 12; ++i) x = optimiser.step(x, about.seen(x, about.layout(), i));
  ASSERT_LT((x - synthetic_truth()).cwiseAbs().maxCoeff(), 0.1);
  Vector there = synthetic_truth();
  there.head(3) -= Vector::Constant(3, 0.05);
  there[5] += 0.05;
  const double roughness = there[3] = x[3];
  about.move_to(there);
  const double before = (x - there).cwiseAbs().maxCoeff();
  for (std::uint64_t i = 0; i < 20; ++i)
    x = optimiser.step_by_residuals(x, about.seen(x, SlotLayout(), 100 + i));
  EXPECT_LT((x - there).cwiseAbs().maxCoeff(), 0.4 * before);
  EXPECT_EQ(x[3], roughness);
}
INSTANTIATE_TEST_SUITE_P(Noise, StepByResiduals, testing::Values(0.0, 0.2));

TEST(StepByResiduals, KnowsNothingOfAPlaceToWhichTheValuesWereMoved) {
  Followed about(0);
  GaussNewton optimiser(about.problem());
  Vector x = about.unknowns().start();
  for (std::uint64_t i = 0; i < 4; ++i) x = optimiser.step(x, about.seen(x, about.layout(), i));
  optimiser.reset_everything();
  const Vector other = about.unknowns().start();
  EXPECT_EQ(optimiser.step_by_residuals(other, about.seen(other, SlotLayout(), 9)), other);
  x = optimiser.step(other, about.seen(other, about.layout(), 10));
  EXPECT_NE(x, other);
  EXPECT_NE(optimiser.step_by_residuals(x, about.seen(x, SlotLayout(), 11)), x)
      << "one step tells again";
}

TEST(StepByResiduals, StaysInsideTheBounds) {
  Followed about(0);
  GaussNewton optimiser(about.problem());
  Vector x = about.unknowns().start();
  for (std::uint64_t i = 0; i < 12; ++i) x = optimiser.step(x, about.seen(x, about.layout(), i));
  Vector beyond = synthetic_truth();
  beyond[4] = about.unknowns().maximum()[4];
  about.move_to(beyond);
  for (std::uint64_t i = 0; i < 20; ++i) {
    x = optimiser.step_by_residuals(x, about.seen(x, SlotLayout(), 100 + i));
    EXPECT_EQ(x, about.unknowns().project(x));
  }
  EXPECT_GT(x[4], 0.9);
}

}  // namespace
}  // namespace selenite
