// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "math/rng.h"

namespace selenite {

/// What a seed of a fit is for; streams of different purposes never meet.
enum class Stream : std::uint64_t { kStep = 1, kValidation = 2, kSearch = 3, kVerification = 4 };

/// Hash of all four: neighbouring iterations, captures and seeds share nothing.
inline std::uint64_t stream_seed(std::uint64_t seed, Stream stream, int iteration, int capture) {
  std::uint64_t key = mix64(seed + 0x9e3779b97f4a7c15ull);
  key = mix64(key ^ static_cast<std::uint64_t>(stream));
  key = mix64(key ^ static_cast<std::uint64_t>(iteration));
  return mix64(key ^ (static_cast<std::uint64_t>(capture) << 32));
}

}  // namespace selenite
