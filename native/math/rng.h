// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

namespace selenite {

/// Finaliser of a 64-bit hash: every output bit depends on every input bit.
/// Source: Stafford 2011, "Better Bit Mixing", variant 13 (as used by SplitMix64, Steele et al. 2014).
constexpr std::uint64_t mix64(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

/// Counter-based random numbers keyed by (seed, pixel, sample, bounce, dimension).
///
/// A number depends on its key alone: not on the thread, the tile, the lane width or on how many
/// numbers were drawn before. Equal seeds therefore give equal paths at displaced parameters (common
/// random numbers), and different seeds give independent ones.
class Random {
 public:
  Random(std::uint64_t seed, std::uint32_t pixel, std::uint32_t sample)
      : key_(mix64(mix64(seed + kGolden) ^ (static_cast<std::uint64_t>(pixel) << 32 | sample))) {}

  void start_bounce(std::uint32_t bounce) { counter_ = static_cast<std::uint64_t>(bounce) << 16; }

  /// A stream of its own for a use that needs nobody knows how many numbers: there `dimension`
  /// counts them.
  Random branch(std::uint32_t dimension) const {
    Random other = *this;
    other.key_ = mix64(mix64(key_ + (counter_ + dimension + 1) * kGolden) + kGolden);
    other.counter_ = 0;
    return other;
  }

  /// Uniform in [0, 1), 24 bits; `dimension` names the use within the bounce.
  float uniform(std::uint32_t dimension) const {
    const std::uint64_t bits = mix64(key_ + (counter_ + dimension + 1) * kGolden);
    return static_cast<float>(bits >> 40) * 0x1p-24f;
  }

  static constexpr std::uint64_t kGolden = 0x9e3779b97f4a7c15ull;

 private:
  std::uint64_t key_;
  std::uint64_t counter_ = 0;
};

}  // namespace selenite
