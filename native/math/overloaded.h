// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace selenite {

/// One function for each alternative of a std::variant, for std::visit.
template <class... Functions>
struct Overloaded : Functions... {
  using Functions::operator()...;
};
template <class... Functions>
Overloaded(Functions...) -> Overloaded<Functions...>;

}  // namespace selenite
