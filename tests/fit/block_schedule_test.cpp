// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/state/block_schedule.h"

#include <gtest/gtest.h>

#include <cctype>
#include <string>

namespace selenite {
namespace {

std::string moved(const BlockSchedule& schedule) {
  std::string found;
  for (int i = 0; i < schedule.iterations(); ++i) {
    const Block block = schedule.block(i);
    const char letter = block.scalars ? (block.fields ? 'b' : 's') : 'f';
    found += static_cast<char>(block.first ? std::toupper(letter) : letter);
  }
  return found;
}

}  // namespace

// Letters: s scalars, f fields, b both; a capital begins a block.

TEST(BlockSchedule, TexelsMoveAloneBeforeScalarsJoinThem) {
  BlockSchedule::Kind kind{true, true, false, true};
  kind.together = true;
  EXPECT_EQ(moved(BlockSchedule(kind, 20)), "FfffffBbbbbbbbbbBbbb");
}

TEST(BlockSchedule, ARefinementKeepsScalarsForItself) {
  BlockSchedule::Kind kind{true, true, false, true};
  kind.together = kind.texels_alone = true;
  EXPECT_EQ(moved(BlockSchedule(kind, 20)), "F" + std::string(19, 'f'));
}

TEST(BlockSchedule, ScalarsComeFirstWithoutAMultiStartAndLastAfterOne) {
  EXPECT_EQ(moved(BlockSchedule({true, true, false, false}, 20)), "SssssFffffSssssFffff");
  EXPECT_EQ(moved(BlockSchedule({true, true, true, false}, 20)), "FffffffSssFffffffSss");
}

TEST(BlockSchedule, VoxelsBesideScalarsBeginBriefly) {
  EXPECT_EQ(moved(BlockSchedule({true, true, false, true}, 20)), "FfSssFffffffSssFfSss");
}

}  // namespace selenite
