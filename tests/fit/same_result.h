// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <gtest/gtest.h>

#include <cmath>

#include "fit/state/fit_result.h"

namespace selenite {

/// Bit by bit, but for the time taken.
inline void expect_same_result(const FitResult& a, const FitResult& b) {
  EXPECT_EQ(a.phase, b.phase);
  EXPECT_EQ(a.best, b.best);
  EXPECT_EQ(a.last, b.last);
  EXPECT_EQ(a.best_iteration, b.best_iteration);
  EXPECT_EQ(a.samples, b.samples);
  if (!std::isnan(a.best_validation)) {
    EXPECT_EQ(a.best_validation, b.best_validation);
  }
  EXPECT_EQ(std::isnan(a.best_validation), std::isnan(b.best_validation));
  ASSERT_EQ(a.history.size(), b.history.size());
  for (std::size_t i = 0; i < a.history.size(); ++i) {
    EXPECT_EQ(a.history[i].values, b.history[i].values) << i;
    EXPECT_EQ(a.history[i].loss, b.history[i].loss) << i;
  }
  EXPECT_EQ(a.report.covariance, b.report.covariance);
  ASSERT_EQ(a.photos.size(), b.photos.size());
  for (std::size_t i = 0; i < a.photos.size(); ++i) {
    EXPECT_EQ(a.photos[i].residual_rms, b.photos[i].residual_rms) << i;
    EXPECT_EQ(a.photos[i].alignment, b.photos[i].alignment) << i;
    for (int c = 0; c < 3; ++c) EXPECT_EQ(a.photos[i].gain[c], b.photos[i].gain[c]) << i;
  }
}

}  // namespace selenite
