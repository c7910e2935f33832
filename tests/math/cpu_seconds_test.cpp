// SPDX-License-Identifier: GPL-3.0-or-later
#include "math/cpu_seconds.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

namespace selenite {
namespace {

double time_on_the_wall() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

TEST(CpuSeconds, StandWhileTheProcessSleeps) {
  const double start = cpu_seconds();
  std::this_thread::sleep_for(std::chrono::milliseconds(400));
  EXPECT_LT(cpu_seconds() - start, 0.2);
}

TEST(CpuSeconds, CountWorkAndNoMoreThanOneThreadHas) {
  const double start = cpu_seconds(), wall = time_on_the_wall();
  while (cpu_seconds() - start < 0.2 && time_on_the_wall() - wall < 60) {
  }
  const double work = cpu_seconds() - start;
  EXPECT_GE(work, 0.2);
  EXPECT_LE(work, time_on_the_wall() - wall + 0.05);  // Windows counts in ticks of 16 ms
}

}  // namespace
}  // namespace selenite
