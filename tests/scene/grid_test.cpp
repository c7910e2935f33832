// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/grid.h"

#include <gtest/gtest.h>

#include <limits>

#include "math/error.h"
#include "scene/small_scenes.h"

namespace selenite {
namespace {

/// 2 x 3 x 4 voxels, each with its own number: x + 10 y + 100 z.
Grid numbered() {
  std::vector<float> values;
  for (int z = 0; z < 4; ++z)
    for (int y = 0; y < 3; ++y)
      for (int x = 0; x < 2; ++x) values.push_back(static_cast<float>(x + 10 * y + 100 * z));
  return {"numbered", {2, 3, 4}, 1, values};
}

TEST(Grid, GivesAVoxelAtItsCentreAndTheMeanBetweenTwo) {
  const Grid grid = numbered();
  EXPECT_EQ(grid.at({0.25, 0.5, 0.125}).r, 10);
  EXPECT_EQ(grid.at({0.75, 0.5, 0.875}).g, 311);
  EXPECT_EQ(grid.at({0.5, 0.5, 0.125}).b, 10.5f);
  // A linear function of the place is met everywhere between the centres:
  // x = 2 u - 1/2, y = 3 v - 1/2, z = 4 w - 1/2.
  const Vec3d u{0.4, 0.7, 0.3};
  EXPECT_NEAR(grid.at(u).r, 0.3 + 10 * 1.6 + 100 * 0.7, 1e-4);
}

TEST(Grid, KeepsTheValueOfItsEdgeOutside) {
  const Grid grid = numbered();
  EXPECT_EQ(grid.at({0, 0, 0}).r, 0);
  EXPECT_EQ(grid.at({-5, 0.5, 1e30}).r, 310);
  EXPECT_EQ(grid.at({1e30, 1e30, -1e30}).r, 21);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(grid.at({nan, nan, nan}).r, 0);
}

TEST(Grid, ConstantGridIsExactEverywhere) {
  const Grid grid("constant", {3, 5, 2}, 3, std::vector<float>(90, 0.1f));
  for (int i = 0; i < 200; ++i) {
    const double t = -0.2 + 0.007 * i;
    const Colorf c = grid.at({t, 1 - t, 0.3 + t * t});
    EXPECT_EQ(c.r, 0.1f);
    EXPECT_EQ(c.b, 0.1f);
  }
}

TEST(Grid, TapsAreTheLookup) {
  const Grid grid = numbered();
  for (int i = 0; i < 100; ++i) {
    const Vec3d u{-0.3 + 0.016 * i, 0.011 * i, 1.2 - 0.013 * i};
    const GridTaps taps = grid.taps(u);
    float sum = 0, weights = 0;
    for (int k = 0; k < 8; ++k) {
      sum += taps.weight[k] * grid.values()[taps.voxel[k]];
      weights += taps.weight[k];
    }
    EXPECT_NEAR(sum, grid.at(u).r, 1e-4);
    EXPECT_NEAR(weights, 1, 1e-6);
  }
}

TEST(Grid, OneVoxelIsAConstant) {
  const Grid grid("one", {1, 1, 1}, 3, {0.25f, 0.5f, 1});
  const Colorf c = grid.at({0.9, -3, 0.1});
  EXPECT_EQ(c.r, 0.25f);
  EXPECT_EQ(c.g, 0.5f);
  EXPECT_EQ(c.b, 1);
}

TEST(Grid, IsPlacedInTheSceneAndFollowsItsOrigin) {
  // A box from (10, -2, 0) to (14, 0, 1), numbers growing along x.
  PlacedGrid placed;
  placed.grid =
      std::make_shared<Grid>("ramp", std::array<int, 3>{2, 1, 1}, 1, std::vector<float>{0, 1});
  placed.to_unit = matrix({0.25, 0, 0}, {0, 0.5, 0}, {0, 0, 1}, {-2.5, 1, 0});
  EXPECT_FLOAT_EQ(placed.at({12, -1, 0.5f}).r, 0.5f);
  EXPECT_FLOAT_EQ(placed.at({11.5f, -1, 0.5f}).r, 0.25f);
  placed.move_origin({10, 0, 0});
  EXPECT_FLOAT_EQ(placed.at({1.5f, -1, 0.5f}).r, 0.25f);
}

struct Refusal {
  std::array<int, 3> size;
  int channels;
  std::vector<float> values;
  std::string words;
};
class GridRefuses : public testing::TestWithParam<Refusal> {};

TEST_P(GridRefuses, ByNameWithTheCure) {
  const Refusal& r = GetParam();
  try {
    const Grid grid("smoke", r.size, r.channels, r.values);
    FAIL() << "accepted";
  } catch (const InvalidArgument& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("Grid 'smoke'"), std::string::npos) << text;
    EXPECT_NE(text.find(r.words), std::string::npos) << text;
  }
}
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();
INSTANTIATE_TEST_SUITE_P(
    BadGrids, GridRefuses,
    testing::Values(Refusal{{0, 1, 1}, 1, {}, "along x is 0; it must lie in [1, 4096]"},
                    Refusal{{1, 1, 5000}, 1, {}, "along z is 5000"},
                    Refusal{{1, 1, 1}, 2, {0, 0}, "give 1 (numbers) or 3 (colours)"},
                    Refusal{{4096, 4096, 4096}, 3, {}, "give a coarser one"},
                    Refusal{{2, 1, 1}, 1, {0}, "1 numbers are given for 2 x 1 x 1 voxels"},
                    Refusal{{2, 1, 1}, 1, {0, -1}, "number 1 is -1"},
                    Refusal{{1, 1, 1}, 1, {kNan}, "number 0 is nan"},
                    Refusal{{1, 1, 1}, 1, {kInf}, "finite and at least 0"}));

}  // namespace
}  // namespace selenite
