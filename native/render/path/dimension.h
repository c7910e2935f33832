// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

namespace selenite {

/// Which of a path vertex's random numbers decides what.
enum Dimension : std::uint32_t {
  kLobe,
  kLobe1,
  kLobe2,
  kLightChoice,
  kLight1,
  kLight2,
  kTriangle,
  kRoulette,
  kPass,
  kFreePath,
  kFreeChannel,
  kMedium,
  kAlong,
  kAlongChoice,
  kAlong1,
  kAlong2,
  kAlongMedium,
  kExit1,
  kExit2,
  kExitRoulette,
  kExitStart,
  kWalk,  ///< and all after it, below those that follow
  kAlongGrids = (1 << 13) - 1,
  kShadow = 1 << 13,  ///< one a surface on the way to a light
  kToLamp = 1 << 14,  ///< one a lamp
  kFlight = 1 << 15
};

}  // namespace selenite
