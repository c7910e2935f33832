// SPDX-License-Identifier: GPL-3.0-or-later
#include "math/dual.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "math/color.h"
#include "math/vec.h"

namespace selenite {
namespace {

using D = Dual<double, 2>;

/// A function of two variables, once over duals and once over numbers, and where to try it.
struct Case {
  const char* name;
  std::function<D(D, D)> dual;
  std::function<double(double, double)> plain;
  std::vector<std::array<double, 2>> at;
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

#define SELENITE_CASE(name, expression, ...)                                       \
  Case {                                                                           \
    name, [](D x, D y) -> D { return (void)x, (void)y, expression; },              \
        [](double x, double y) -> double { return (void)x, (void)y, expression; }, \
        std::vector<std::array<double, 2>> __VA_ARGS__                             \
  }

const std::vector<Case>& cases() {
  using std::abs, std::cos, std::exp, std::log, std::pow, std::sin, std::sqrt, std::tan;
  static const std::vector<Case> all = {
      SELENITE_CASE("negate", -x, {{0, 0}, {3, 1}}),
      SELENITE_CASE("add", x + y, {{0, 0}, {3, -1}, {1e-8, 1e8}}),
      SELENITE_CASE("subtract", x - y, {{0, 0}, {3, -1}}),
      SELENITE_CASE("multiply", x * y, {{0, 0}, {0, 2}, {3, -1}, {1e4, 1e-4}}),
      SELENITE_CASE("divide", x / y, {{0, 2}, {3, -1}, {3, 1e-2}, {-5, 40}}),
      SELENITE_CASE("add a constant", x + 2.5, {{1, 0}}),
      SELENITE_CASE("add to a constant", 2.5 + x, {{1, 0}}),
      SELENITE_CASE("subtract a constant", x - 2.5, {{1, 0}}),
      SELENITE_CASE("subtract from a constant", 2.5 - x, {{1, 0}}),
      SELENITE_CASE("multiply by a constant", x * 2.5, {{1, 0}, {0, 0}}),
      SELENITE_CASE("multiply a constant", 2.5 * x, {{1, 0}}),
      SELENITE_CASE("divide by a constant", x / 2.5, {{1, 0}, {0, 0}}),
      SELENITE_CASE("divide a constant", 2.5 / x, {{1, 0}, {-0.1, 0}}),
      SELENITE_CASE("sqrt", sqrt(x), {{1e-4, 0}, {0.3, 0}, {1, 0}, {1e6, 0}}),
      SELENITE_CASE("safe_sqrt", safe_sqrt(x), {{-1, 0}, {1e-4, 0}, {0.3, 0}}),
      SELENITE_CASE("exp", exp(x), {{-30, 0}, {0, 0}, {2, 0}}),
      SELENITE_CASE("log", log(x), {{1e-4, 0}, {1, 0}, {50, 0}}),
      SELENITE_CASE("sin", sin(x), {{0, 0}, {1.5, 0}, {-3, 0}}),
      SELENITE_CASE("cos", cos(x), {{0, 0}, {1.5, 0}, {-3, 0}}),
      SELENITE_CASE("tan", tan(x), {{0, 0}, {1.2, 0}, {-1, 0}}),
      SELENITE_CASE("pow", pow(x, 2.5), {{1e-2, 0}, {1, 0}, {7, 0}}),
      SELENITE_CASE("pow, negative exponent", pow(x, -1.5), {{0.1, 0}, {7, 0}}),
      SELENITE_CASE("square", square(x), {{0, 0}, {-3, 0}}),
      SELENITE_CASE("abs", abs(x), {{-2, 0}, {2, 0}}),
      SELENITE_CASE("max", max(x, y), {{1, 2}, {2, 1}, {-1, -2}}),
      SELENITE_CASE("min", min(x, y), {{1, 2}, {2, 1}, {-1, -2}}),
      SELENITE_CASE("clamp", clamp(x, 0.0, 1.0), {{-0.5, 0}, {0.5, 0}, {1.5, 0}}),
      SELENITE_CASE("select", select(true, x * x, y) + select(false, x, y * x), {{2, 3}}),
      SELENITE_CASE("a long expression",
                    exp(-x * y) / (1.0 + sqrt(x) * sin(y / x)) - pow(x + y, 3.0),
                    {{0.5, 0.2}, {2, -1}}),
  };
  return all;
}
#undef SELENITE_CASE

class DualAgainstDifferences : public testing::TestWithParam<Case> {};

TEST_P(DualAgainstDifferences, ValueAndSlopesAgree) {
  const Case& c = GetParam();
  for (const auto& [x, y] : c.at) {
    const D got = c.dual(D::variable(x, 0), D::variable(y, 1));
    EXPECT_DOUBLE_EQ(got.v, c.plain(x, y));
    for (int k = 0; k < 2; ++k) {
      // Five points: error h^4, so 1e-9 of the size is left beside rounding.
      const double size = k == 0 ? x : y, h = 1e-3 * std::clamp(std::abs(size), 1e-3, 1.0);
      const auto at = [&](double step) {
        return k == 0 ? c.plain(x + step, y) : c.plain(x, y + step);
      };
      const double want = (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h);
      EXPECT_NEAR(got.d[k], want, 1e-8 * std::abs(want) + 1e-13 * std::abs(got.v) / h)
          << "at (" << x << ", " << y << "), slot " << k;
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Functions, DualAgainstDifferences, testing::ValuesIn(cases()),
                         [](const auto& info) { return "Case" + std::to_string(info.index); });

TEST(Dual, CompoundAssignmentIsTheOperator) {
  const D x = D::variable(3, 0), y = D::variable(-2, 1);
  D sum = x, difference = x, product = x, ratio = x;
  sum += y;
  difference -= y;
  product *= y;
  ratio /= y;
  for (const auto& [a, b] :
       {std::pair{sum, x + y}, {difference, x - y}, {product, x * y}, {ratio, x / y}}) {
    EXPECT_EQ(a.v, b.v);
    EXPECT_EQ(a.d, b.d);
  }
}

TEST(Dual, AProductKeepsTheSlopeOfABlackFactor) {
  const D black = D::variable(0, 0), rest = D(5);
  EXPECT_EQ((black * rest).v, 0);
  EXPECT_EQ((black * rest).d[0], 5);
}

TEST(Dual, RootOfZeroHasNoSlopeWhereNoneIsCarried) {
  // The slope of sqrt is infinite at 0; a slot that does not depend on x must not become 0 * inf.
  const D root = sqrt(D(0));
  EXPECT_EQ(root.v, 0);
  EXPECT_EQ(root.d[0], 0);
  EXPECT_EQ(root.d[1], 0);
  const D mixed = sqrt(D::variable(0, 0));
  EXPECT_EQ(mixed.d[1], 0);
  const D safe = safe_sqrt(D::variable(0, 0));
  EXPECT_EQ(safe.v, 0);
  EXPECT_EQ(safe.d[0], 0);
  EXPECT_EQ(pow(D(0), 0.5).d[0], 0);
  EXPECT_EQ(log(D(0)).d[1], 0);
}

TEST(Dual, ClampPassesTheSlopeAtBothEndsAndStopsItOutside) {
  EXPECT_EQ(clamp(D::variable(0, 0), 0.0, 1.0).d[0], 1);
  EXPECT_EQ(clamp(D::variable(1, 0), 0.0, 1.0).d[0], 1);
  EXPECT_EQ(clamp(D::variable(-1e-300, 0), 0.0, 1.0).d[0], 0);
  EXPECT_EQ(clamp(D::variable(std::nextafter(1.0, 2.0), 0), 0.0, 1.0).d[0], 0);
  EXPECT_EQ(clamp(D::variable(-3, 0), 0.0, 1.0).v, 0);
  EXPECT_EQ(clamp(D::variable(3, 0), 0.0, 1.0).v, 1);
}

TEST(Dual, OrderIsThatOfTheValues) {
  const D small = D::variable(1, 0), large = D::variable(2, 1);
  EXPECT_TRUE(small < large && large > small && small <= large && large >= small);
  EXPECT_FALSE(large < small || small > large || large <= small || small >= large);
  EXPECT_TRUE(D::variable(1, 0) <= D(1) && D(1) >= D::variable(1, 1));
  EXPECT_EQ(value_of(small), 1);
  EXPECT_TRUE(has_slope(small));
  EXPECT_FALSE(has_slope(D(2)));
}

TEST(Dual, FloatDualsAgreeWithDoubleOnesToRounding) {
  using F = Dual<float, 1>;
  const auto f = [](const auto& x) { return exp(-x) * sqrt(x) / (1.0f + x * x); };
  for (const double x : {0.01, 0.5, 3.0}) {
    const F got = f(F::variable(static_cast<float>(x), 0));
    const D want = exp(-D::variable(x, 0)) * sqrt(D::variable(x, 0)) /
                   (1.0 + D::variable(x, 0) * D::variable(x, 0));
    EXPECT_NEAR(got.v, want.v, 4e-7 * std::abs(want.v));
    EXPECT_NEAR(got.d[0], want.d[0], 2e-6 * std::abs(want.d[0]));
  }
}

TEST(Vec, DualVectorsFollowTheProductRule) {
  // d/dx of |(x, 1, 2)| and of a cross product, by hand.
  const Vec3<D> v{D::variable(2, 0), D(1), D(2)};
  EXPECT_DOUBLE_EQ(length(v).v, 3);
  EXPECT_DOUBLE_EQ(length(v).d[0], 2.0 / 3);
  const Vec3<D> c = cross(v, Vec3<D>{D(0), D(0), D(1)});
  EXPECT_DOUBLE_EQ(c.x.v, 1);
  EXPECT_DOUBLE_EQ(c.y.v, -2);
  EXPECT_DOUBLE_EQ(c.y.d[0], -1);
  EXPECT_NEAR(dot(normalize(v), normalize(v)).d[0], 0, 1e-15);
}

TEST(Color, WorksChannelByChannel) {
  const Color<double> a{1, 2, 3}, b{4, 5, 6};
  const Color<double> product = a * b, sum = a + b, ratio = b / a, doubled = a * 2.0;
  for (int c = 0; c < 3; ++c) {
    EXPECT_EQ(product[c], a[c] * b[c]);
    EXPECT_EQ(sum[c], a[c] + b[c]);
    EXPECT_EQ(ratio[c], b[c] / a[c]);
    EXPECT_EQ(doubled[c], 2 * a[c]);
  }
  EXPECT_EQ(max_channel(b), 6);
  EXPECT_DOUBLE_EQ(mean_channel(a), 2);
}

}  // namespace
}  // namespace selenite
