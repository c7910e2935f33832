// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>

#include "model/narrow.h"

namespace selenite {

/// Position between two nodes of a table's axis, uniform on [0, 1] and clamped to its ends; for
/// multilinear interpolation as Cycles does it.
template <class T>
struct Cell {
  int index;
  T t;

  Cell(const T& x, int nodes) {
    using S = scalar_t<T>;
    const T p = clamp01(x) * S(nodes - 1);
    index = std::min(static_cast<int>(value_of(p)), nodes - 2);
    t = p - T(S(index));
  }
  template <class A>
  T mix(const A& a, const A& b) const {
    return T(a) + t * (T(b) - T(a));
  }
};

}  // namespace selenite
