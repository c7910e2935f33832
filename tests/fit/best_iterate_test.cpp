// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/state/best_iterate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "fit/synthetic_renderer.h"

namespace selenite {
namespace {

constexpr int kPixels = 100;

/// A loss of so much, spread over pixels that scatter by `scatter` in a pattern of their own.
Validation validated(double loss, double scatter = 0, double phase = 0) {
  Validation one;
  one.unbiased = one.loss = loss;
  one.variance = 0.04;
  for (int i = 0; i < kPixels; ++i)
    one.parts.push_back(
        static_cast<float>(loss / kPixels + scatter * std::sin(1.7 * i + phase) / kPixels));
  return one;
}

/// The iterations of a fit of one roughness, in order.
class Notes {
 public:
  explicit Notes(bool prefers_low_roughness = false) : best(unknowns, prefers_low_roughness) {
    result.best_validation = std::numeric_limits<double>::quiet_NaN();
    result.fields_last = result.fields_best = std::make_shared<FieldValues>();
  }
  void note(double roughness, const Validation& validation) {
    HistoryRow row;
    row.iteration = static_cast<int>(result.history.size());
    row.values = Vector::Constant(1, roughness);
    result.fields_last = std::make_shared<FieldValues>(1, Vector::Constant(1, roughness));
    best.note(row, validation, result);
    result.history.push_back(row);
  }

  Unknowns unknowns{synthetic_scene(), roughness_from(0.5)};
  FitResult result;
  BestIterate best;
};

TEST(BestIterate, IsNotTheNewestWhereThatIsWorse) {
  Notes fit;
  fit.note(0.4, validated(3));
  fit.note(0.5, validated(1));
  fit.note(0.6, validated(2));
  EXPECT_EQ(fit.result.best[0], 0.5);
  EXPECT_EQ(fit.result.best_iteration, 1);
  EXPECT_EQ(fit.result.best_validation, 1);
  EXPECT_NEAR(fit.result.best_validation_standard_error, 0.2, 1e-12);
  ASSERT_EQ(fit.result.fields_best->size(), 1u);
  EXPECT_EQ((*fit.result.fields_best)[0][0], 0.5) << "the fields that belong to it";
  EXPECT_EQ(fit.best.validation().unbiased, 1);
  for (const double loss : {3.0, 1.0, 2.0})
    EXPECT_EQ(fit.result.history[static_cast<std::size_t>(3 - loss)].validation,
              loss == 3 ? 3 : 3 - loss);
}

// Two pictures of a hundred pixels that scatter by 1 each differ in their sums by about 0.1 by chance.
TEST(BestIterate, IsTheNewestOfThoseThatNoiseDoesNotTellApart) {
  Notes fit;
  fit.note(0.4, validated(1, 1));
  fit.note(0.5, validated(1.02, 1, 2));
  EXPECT_EQ(fit.result.best[0], 0.5) << "worse by a fifth of its noise";
  fit.note(0.6, validated(1.5, 1, 4));
  EXPECT_EQ(fit.result.best[0], 0.5) << "worse by several times";
}

TEST(BestIterate, IsComparedWithTheSmallestLossAndNotWithTheLastBest) {
  Notes fit;
  fit.note(0.4, validated(1, 1));
  double loss = 1;
  for (int i = 1; i <= 10; ++i) fit.note(0.4 + 0.01 * i, validated(loss += 0.06, 1, 0.7 * i));
  EXPECT_LT(fit.result.best_validation, 1.3) << "else it would drift away, step by step";
}

TEST(BestIterate, OfLowRoughnessStaysWhereTheOtherExplainsNoMore) {
  const auto kept = [](bool prefers) {
    Notes fit(prefers);
    fit.note(0.02, validated(1, 1));
    fit.note(0.5, validated(0.999, 1, 0.1));
    return fit.result.best[0];
  };
  EXPECT_EQ(kept(true), 0.02);
  EXPECT_EQ(kept(false), 0.5);
}

}  // namespace
}  // namespace selenite
