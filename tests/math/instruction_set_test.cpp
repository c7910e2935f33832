// SPDX-License-Identifier: GPL-3.0-or-later
#include "math/instruction_set.h"

#include <gtest/gtest.h>

namespace selenite {
namespace {

#if defined(__x86_64__) && defined(__linux__)
TEST(InstructionSet, IsWhatTheCompilersOwnFunctionSays) {
  __builtin_cpu_init();
  EXPECT_EQ(has_sse42(), __builtin_cpu_supports("sse4.2") != 0);
  EXPECT_EQ(has_avx2(), __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                            __builtin_cpu_supports("bmi2"));
}
#elif defined(__x86_64__) && defined(__GNUC__)
TEST(InstructionSet, AProcessorWithAvx2HasTheOlderOne) { EXPECT_LE(has_avx2(), has_sse42()); }
#endif

}  // namespace
}  // namespace selenite
