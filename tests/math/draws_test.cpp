// SPDX-License-Identifier: GPL-3.0-or-later
#include "math/draws.h"

#include <gtest/gtest.h>

#include <vector>

namespace selenite {
namespace {

template <class T>
void expect(Normal<T> normal, const std::vector<T>& known) {
  std::mt19937 random(5);
  for (const T number : known)
    EXPECT_NEAR(normal(random), number, 4 * std::numeric_limits<T>::epsilon());
}

// As std::normal_distribution of GNU's library draws them.
TEST(Draws, OfANormalDistributionAreTheSameWithEveryLibrary) {
  expect(Normal<float>(0.5f, 0.1f), {0.50996435f, 0.51114941f, 0.44437128f, 0.38026959f});
  expect(Normal<double>(),
         {0.10779446491934412, -0.030636274259069458, -0.19970652250066045, -0.79326673457454833});
}

}  // namespace
}  // namespace selenite
