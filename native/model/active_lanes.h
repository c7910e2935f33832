// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/dual.h"

namespace selenite {

/// The lanes that count when something is decided for all of them. What the others hold is arbitrary,
/// and must change nothing. Of a plain number it is always the one.
template <class S>
class ActiveLanes {
 public:
  ActiveLanes(const mask_t<S>& mask) : mask_(mask) {}  // NOLINT(google-explicit-constructor)

  /// Whether one of them is in the mask. A bool is the same for all.
  template <class Mask>
  bool some(const Mask& mask) const {
    if constexpr (kIsLanes<S> && std::is_same_v<Mask, mask_t<S>>) {
      return any(mask & mask_);
    } else {
      return mask;
    }
  }
  /// has_slope of what they hold: a number, a dual or a colour.
  template <class X>
  bool move(const X& x) const {
    if constexpr (kIsLanes<S> && requires { x.r; }) {
      return move(x.r) || move(x.g) || move(x.b);
    } else if constexpr (kIsLanes<S> && kIsLanes<X> && requires { x.d; }) {
      mask_t<S> moving = false;
      for (const S& slope : x.d) moving |= slope != S(0);
      return some(moving);
    } else {
      return has_slope(x);
    }
  }

 private:
  mask_t<S> mask_;
};

}  // namespace selenite
