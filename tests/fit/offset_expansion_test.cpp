// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/inference/offset_expansion.h"

#include <gtest/gtest.h>

#include "fit/synthetic_renderer.h"

namespace selenite {
namespace {

TEST(OffsetExpansion, WhatLiesAtItsBoundStaysWithinAStandardErrorOfIt) {
  constexpr double kBound = 0.001;
  const Vector x = Vector::Constant(1, kBound), there = Vector::Constant(1, 0.1);
  Confidence at_x, seen;
  at_x.determined = seen.determined = true;
  at_x.by_slope = 0.3;
  at_x.at_bound = AtBound::kMinimum;
  seen.by_slope = 0.004;
  seen.interval = {kBound, 0.06};
  seen.standard_error = 0.018;
  const auto known = [&](double found) {
    return *known_from_offset(x, {at_x}, there, Vector::Constant(1, found), {seen})[0];
  };
  EXPECT_EQ(known(0.018).value, kBound);
  EXPECT_EQ(known(0.018).confidence.at_bound, AtBound::kMinimum);
  EXPECT_EQ(known(0.03).value, 0.03) << "inside its interval, and still farther than that";
  EXPECT_EQ(known(0.03).confidence.at_bound, AtBound::kNo);
  at_x.at_bound = AtBound::kNo;
  EXPECT_EQ(known(0.018).value, 0.018);
}

// The square of a transmission shows; a metallic of 0 has a slope of its own.
TEST(OffsetExpansion, MovesOnlyWhatShowsByItsSquare) {
  const Unknowns unknowns(synthetic_scene(), {{"Body", "transmission", {0.5}, 0, 1, 0.03},
                                              {"Body", "metallic", {0.5}, 0, 1, 0.03}});
  const OffsetExpansionOptions options;
  const auto there = offset_point(unknowns, Vector::Zero(2), options);
  ASSERT_TRUE(there);
  EXPECT_EQ((*there)[0], options.offset);
  EXPECT_EQ((*there)[1], 0);
  EXPECT_FALSE(offset_point(unknowns, Vector{{0.5, 0.0}}, options));
}

}  // namespace
}  // namespace selenite
