// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string_view>

#include "math/rng.h"

namespace selenite {

/// Hash of bytes, against damage and mix-ups, not against malice.
inline std::uint64_t hash64(std::string_view bytes) {
  std::uint64_t sum = mix64(bytes.size());
  for (std::size_t i = 0; i < bytes.size(); i += sizeof sum) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + i, std::min(sizeof word, bytes.size() - i));
    sum = mix64(sum ^ word);
  }
  return sum;
}

}  // namespace selenite
