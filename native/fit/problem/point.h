// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/problem/fields.h"
#include "fit/problem/saved_state.h"

namespace selenite {

/// The unknowns of a fit at one moment: scalars in the order of `Unknowns`, fields in that of `Fields`.
struct Point {
  Vector scalars;
  FieldValues fields{};

  void members(SavedState& state) { state(scalars, fields); }
};

}  // namespace selenite
