// SPDX-License-Identifier: GPL-3.0-or-later
#include "math/parabolic_line_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace selenite {
namespace {

/// Start and bottom of a valley.
class Valley : public testing::TestWithParam<std::pair<double, double>> {};

TEST_P(Valley, TheBottomOfAParabolaIsMet) {
  const double start = GetParam().first, bottom = GetParam().second;
  std::set<double> asked;
  const auto height = [&](double x) {
    EXPECT_TRUE(asked.insert(x).second) << "twice at " << x;
    return 3 + 5 * (x - bottom) * (x - bottom);
  };
  EXPECT_NEAR(parabolic_line_search(height, start, {0.04, -10, 10}), bottom, 1e-9);
  EXPECT_LE(asked.size(), 4 + std::abs(start - bottom) / 0.04);
}

TEST_P(Valley, TheBottomOfAWedgeIsMetToAnEleventhOfAStep) {
  const double start = GetParam().first, bottom = GetParam().second;
  const auto height = [&](double x) { return std::abs(x - bottom); };
  EXPECT_NEAR(parabolic_line_search(height, start, {0.04, -10, 10}), bottom, 0.04 / 11);
}
INSTANTIATE_TEST_SUITE_P(StartAndBottom, Valley,
                         testing::Values(std::pair{0.0, 0.0}, std::pair{0.0, 0.013},
                                         std::pair{0.3, 0.011}, std::pair{-0.2, 0.171}));

TEST(Valley, StaysWithinTheRange) {
  const auto height = [](double x) {
    EXPECT_GE(x, 0);
    EXPECT_LE(x, 0.1);
    return x;
  };
  EXPECT_EQ(parabolic_line_search(height, 0.09, {0.04, 0, 0.1}), 0);
  const auto rising_to_the_end = [&](double x) { return -height(x); };
  EXPECT_EQ(parabolic_line_search(rising_to_the_end, -1, {0.04, 0, 0.1}), 0.1) << "a start outside";
}

TEST(Valley, StaysWhereNothingTells) {
  EXPECT_EQ(parabolic_line_search([](double) { return 1.0; }, 0.5, {0.04, 0, 1}), 0.5);
}

TEST(Valley, GivesUpOnASlopeWithoutAnEnd) {
  int asked = 0;
  const double found = parabolic_line_search(
      [&](double x) {
        ++asked;
        return -x;
      },
      0, {1, -1e9, 1e9});
  EXPECT_GT(found, 5);
  EXPECT_LT(asked, 20);
}

}  // namespace
}  // namespace selenite
