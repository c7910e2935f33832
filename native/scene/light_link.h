// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

namespace selenite {

/// Light linking and shadow linking. Objects that the same lights are linked to make up a set; a light
/// names the sets that it lights, and those that cast shadows of it.
struct LinkedSets {
  static constexpr int kMost = 64;
  static constexpr std::uint64_t kAll = ~std::uint64_t{0};

  std::uint64_t lit = kAll, shading = kAll;

  bool lights(int set) const { return lit >> set & 1; }
  bool is_shaded_by(int set) const { return shading >> set & 1; }
  bool are_all() const { return lit == kAll && shading == kAll; }
};

}  // namespace selenite
