// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>

#include "model/narrow.h"

namespace selenite {

/// Position between two nodes of a table's axis, uniform on [0, 1] and clamped to its ends; for
/// multilinear interpolation as Cycles does it.
template <class T>
struct Cell {
  index_t<T> index;
  T t;

  Cell(const T& x, int nodes) {
    using S = scalar_t<T>;
    const T p = clamp01(x) * S(nodes - 1);
    if constexpr (kIsLanes<S>) {
      // Of a lane that does not count x may be anything, NaN as well: its cell is one of the table's.
      index = min(max(truncate(value_of(p)), 0), nodes - 2);
      t = p - T(to_lanes(index));
    } else {
      index = std::min(static_cast<int>(value_of(p)), nodes - 2);
      t = p - T(S(index));
    }
  }
  template <class A>
  auto mix(const A& a, const A& b) const {
    using R = decltype(t * a);
    return R(a) + t * (R(b) - R(a));
  }
};

/// table[index] as S, of each lane its own.
template <class S, class Index>
S entry(const float* table, const Index& index) {
  if constexpr (kIsLanes<S>) {
    return gather(table, index);
  } else {
    return S(table[index]);
  }
}

}  // namespace selenite
