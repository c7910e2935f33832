// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "math/rng.h"

namespace selenite {

/// What a seed of a fit is for; streams of different purposes never meet.
enum class Stream : std::uint64_t {
  kStep = 1,
  kValidation = 2,
  kMultiStart = 3,
  kRefinement = 4,
  kAlternativeMinima = 5,
  kLightStart = 6,
  kRoughnessProfile = 7,
  kRotationStart = 8,
  kAlignmentStart = 9,
  kParts = 10,
  kTexels = 11
};

/// Hash of a seed and what its samples are for: neighbouring numbers share nothing.
inline std::uint64_t seed_of(std::uint64_t seed, int purpose, int photo) {
  const std::uint64_t key = mix64(seed ^ static_cast<std::uint64_t>(purpose));
  return mix64(key ^ (static_cast<std::uint64_t>(photo) << 32));
}
inline std::uint64_t stream_seed(std::uint64_t seed, Stream stream, int iteration, int photo) {
  const std::uint64_t key = mix64(seed + 0x9e3779b97f4a7c15ull);
  return seed_of(mix64(key ^ static_cast<std::uint64_t>(stream)), iteration, photo);
}

}  // namespace selenite
