// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/lanes.h"
#include "math/rng.h"

namespace selenite {

/// The random numbers of eight paths, each the same as that of `Random` for its key.
class LaneRandom {
 public:
  void start(int lane, const Random& random) { key_[lane] = random.key(); }

  /// Lane `from` of others becomes lane `to`.
  void take(int to, const LaneRandom& others, int from) { base_[to] = others.base_[from]; }

  void start_bounce(const LaneInts& bounce) {
    base_ = key_ + (__builtin_convertvector(bounce.v, Raw) << 16) * Random::kGolden;
  }

  /// Uniform in [0, 1), 24 bits; `dimension` names the use within the bounce.
  Lanes uniform(std::uint32_t dimension) const {
    Raw x = base_ + (dimension + 1) * Random::kGolden;  // then mix64
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
    x = x ^ (x >> 31);
    return to_lanes(LaneInts(__builtin_convertvector(x >> 40, LaneInts::Raw))) * 0x1p-24f;
  }

 private:
  using Raw = std::uint64_t __attribute__((vector_size(8 * kLanes)));
  Raw key_{}, base_{};
};

}  // namespace selenite
