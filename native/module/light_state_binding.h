// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

#include <string>

#include "scene/lights/light_state.h"

namespace selenite {

/// From a dict {lamps: names or None for all, world: bool, places: {name: (matrix (4, 4), radiance scale
/// or None)}}; a key that is missing is as in the scene. `what` begins messages.
LightState light_state_of(const pybind11::handle& object, const std::string& what);

}  // namespace selenite
