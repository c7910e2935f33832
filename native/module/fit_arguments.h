// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

#include "fit/problem/settings.h"

namespace selenite {

/// From a dict. ValueError: a name that there is not, a value of another type.
/// Names as in `FitSettings`; what is left out keeps its default.
FitSettings settings_of(const pybind11::handle& object);

}  // namespace selenite
