// SPDX-License-Identifier: GPL-3.0-or-later
// What a search leaves out of many photos.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "fit/phases/multi_start.h"
#include "fit/run/fit.h"
#include "fit/synthetic_renderer.h"

namespace selenite {
namespace {

std::vector<Photo> many(std::size_t count, int size = 8) {
  std::vector<Photo> photos;
  for (std::size_t i = 0; i < count; ++i) {
    photos.push_back(grey_capture(size));
    photos.back().id = "Photo " + std::to_string(i);
  }
  return photos;
}

std::vector<std::size_t> searched(std::size_t count, std::vector<UnknownParameter> unknowns) {
  const Scene scene = synthetic_scene();
  const FitProblem problem(scene, many(count), unknowns, synthetic_settings());
  return searched_photos(problem.scalars(), scene);
}

TEST(SearchedPhotos, AreAllOfAFewAndSomeOfEachPartOfMany) {
  const std::vector<UnknownParameter> unknowns = synthetic_unknowns();
  for (const std::size_t count : {1, 5, 12}) {
    std::vector<std::size_t> all(count);
    std::iota(all.begin(), all.end(), std::size_t{0});
    EXPECT_EQ(searched(count, unknowns), all);
  }
  for (const std::size_t count : {13, 24, 51}) {
    const std::vector<std::size_t> some = searched(count, unknowns);
    ASSERT_EQ(some.size(), 12u);
    for (std::size_t i = 0; i < some.size(); ++i) {
      EXPECT_GE(some[i], i * count / 12);
      EXPECT_LT(some[i], (i + 1) * count / 12);
    }
  }
  // Lists repeat: left and right, one lamp after another.
  for (const std::size_t period : {2, 3, 4}) {
    std::set<std::size_t> kinds;
    for (const std::size_t photo : searched(12 * period, unknowns)) kinds.insert(photo % period);
    EXPECT_EQ(kinds.size(), period);
  }
}

TEST(SearchedPhotos, ShowEveryUnknown) {
  const std::vector<UnknownParameter> colour{synthetic_unknowns()[0]};
  const std::vector<std::size_t> some = searched(51, colour);
  std::size_t other = 0;  // that is none of them
  while (std::ranges::find(some, other) != some.end()) ++other;
  std::vector<UnknownParameter> unknowns = colour;
  unknowns.push_back({"Photo " + std::to_string(other), "gain", {1, 1, 1}, 0.1, 10, 0.03});
  std::vector<std::size_t> more = searched(51, unknowns);
  EXPECT_EQ(more.size(), 13u);
  EXPECT_EQ(std::erase(more, other), 1u);
  EXPECT_EQ(more, some);
}

// Steps of a candidate are portions of their own: progress moves and a fit is saved between them.
TEST(Search, OfManyPhotosGoesOnInSmallPortions) {
  FitSettings settings = exact_settings(SyntheticRenderer{0.2, 0.2}, 4);
  settings.search = "on";
  settings.finite_differences = true;
  settings.spp = 8;
  Fit fit(synthetic_scene(), many(40), synthetic_unknowns(), settings);
  const double pixels = 12 * 64;
  std::vector<double> done, samples;
  while (fit.result().phase == PhaseKind::kMultiStart) {
    const double before = static_cast<double>(fit.result().samples);
    ASSERT_TRUE(fit.step());
    const double taken = static_cast<double>(fit.result().samples) - before;
    EXPECT_LE(taken, MultiStartOptions{}.final_spp * pixels);
    samples.push_back(before + taken);
    if (fit.result().phase != PhaseKind::kMultiStart) break;
    done.push_back(fit.result().phase_fraction);
    EXPECT_GT(done.back(), done.size() > 1 ? done[done.size() - 2] : 0);
  }
  // How many candidates will turn out to be of one basin is not known before.
  double sum = 0;
  for (std::size_t i = 0; i < done.size(); ++i) {
    const double off = std::abs(done[i] - samples[i] / samples.back());
    EXPECT_LT(off, 0.1) << "portion " << i;
    sum += off;
  }
  EXPECT_LT(sum / static_cast<double>(done.size()), 0.04);
}

}  // namespace
}  // namespace selenite
