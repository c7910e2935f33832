// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/lanes.h"
#include "math/rng.h"

namespace selenite {

/// The random numbers of eight paths, each the same as that of `Random` for its key.
class LaneRandom {
 public:
  /// Each the same as Random(seed, pixel, sample).
  void start(std::uint64_t seed, const LaneInts& pixel, const LaneInts& sample) {
    key_ = mix(mix64(seed + Random::kGolden) ^ (wide(pixel) << 32 | wide(sample)));
    base_ = key_;
  }

  /// Lane `to` becomes lane `from` of others.
  void take(int to, const LaneRandom& others, int from) { key_[to] = others.key_[from]; }

  void start_bounce(const LaneInts& bounce) {
    base_ = key_ + (wide(bounce) << 16) * Random::kGolden;
  }

  /// Uniform in [0, 1), 24 bits; `dimension` names the use within the bounce.
  Lanes uniform(std::uint32_t dimension) const {
    const Raw x = mix(base_ + (dimension + 1) * Random::kGolden);
    return to_lanes(LaneInts(__builtin_convertvector(x >> 40, LaneInts::Raw))) * 0x1p-24f;
  }

 private:
  using Raw = std::uint64_t __attribute__((vector_size(8 * kLanes)));
  static Raw wide(const LaneInts& x) { return __builtin_convertvector(x.v, Raw); }
  /// mix64
  static Raw mix(Raw x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
    return x ^ (x >> 31);
  }
  Raw key_{}, base_{};
};

}  // namespace selenite
