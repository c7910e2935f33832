// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

#include <cstddef>

#include "fit/problem/photo.h"
#include "fit/problem/settings.h"
#include "fit/problem/unknowns.h"

// What a fit is asked for, from the dicts in which Python says it. All throw ValueError naming what is
// wrong; `index` is for that.
namespace selenite {

/// {id, camera, reference, weight, frame}, and by name the parameters of a photo
Photo photo_of(const pybind11::handle& object, std::size_t index);
/// {owner, parameter, start, minimum, maximum, learning_rate}
UnknownParameter unknown_of(const pybind11::handle& object, std::size_t index);
std::vector<UnknownParameter> unknowns_of(const pybind11::list& unknowns);
/// Names as in `FitSettings`; what is left out keeps its default.
FitSettings settings_of(const pybind11::handle& object);

}  // namespace selenite
