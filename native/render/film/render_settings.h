// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "scene/camera.h"

namespace selenite {

/// Nonzero for those that are in it.
using PixelMask = std::vector<std::uint8_t>;

struct RenderSettings {
  int width = 256, height = 256;
  int spp = 4;
  std::uint64_t seed = 0;
  int depth = 0;    ///< largest number of bounces; 0 = no limit (Russian roulette ends the paths)
  int threads = 0;  ///< 0 = one per core
  PhotoFrame frame;
  /// Paths that a thread traces in lockstep: 1, 8, or 0 for eight where processor and scene permit.
  /// The picture is the same but for rounding.
  int lanes = 0;
  bool aim_pilot = false;  ///< the film measures what aiming at lamps is worth; see decide_aims
  /// Null: all. The others stay black, and those that are rendered are the same as without.
  std::shared_ptr<const PixelMask> pixels{};
  bool has(std::size_t pixel) const { return !pixels || (*pixels)[pixel] != 0; }
  /// Throws InvalidArgument.
  void check() const;
};

/// InvalidArgument naming `what` of a render, its value and the permitted `range`, unless it is good.
void require_setting(bool good, const char* what, long long value, const char* range);

}  // namespace selenite
