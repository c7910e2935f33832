// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <tuple>

#include "model/sheen.h"

namespace selenite {

/// Lobes over all other layers, from top to bottom, each for itself: its parameters, value and
/// directions need no other lobe. A new one is a header like sheen.h and a line here. Lanes leave them
/// out, so that a material with one is traced path by path.
template <class T>
using TopLobes = std::tuple<Sheen<T>>;

inline constexpr int kTopLobes = std::tuple_size_v<TopLobes<float>>;

/// Calls `visit(number, lobe)` for each of them, counted from 0.
template <class Top, class Visit>
void for_each_top_lobe(Top& top, [[maybe_unused]] Visit&& visit) {
  [[maybe_unused]] int number = 0;
  std::apply([&](auto&... lobes) { (visit(number++, lobes), ...); }, top);
}

template <class Top>
struct ParametersOf;
template <class... Lobes>
struct ParametersOf<std::tuple<Lobes...>> : Lobes::Parameters... {
  template <class Self, class Visit>
  static constexpr void fields(Self& m, Visit&& visit) {
    (Lobes::Parameters::fields(m, visit), ...);
  }
};
/// The parameters of all of them.
template <class T>
using TopLobeParameters = ParametersOf<TopLobes<T>>;

}  // namespace selenite
