// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/color.h"
#include "model/parameter.h"

namespace selenite {

/// The number of a member among the `fields` of its owner: how code refers to a parameter, where a user
/// gives its name. A member that is no parameter does not compile.
template <class Owner, class Value, class Base>
consteval int field_index(Value Base::*member) {
  struct Find {
    const Value* wanted;
    int at = 0, found = -1;
    constexpr void compare(const Value* here) {
      if (here == wanted) found = at;
      ++at;
    }
    constexpr void compare(const void*) { ++at; }
    constexpr void operator()(const Parameter&, double& x) { compare(&x); }
    constexpr void operator()(const Parameter&, Color<double>& x) { compare(&x); }
  };
  Owner owner;
  Find find{&(owner.*member)};
  Owner::fields(owner, find);
  if (find.found < 0) throw "not a parameter";
  return find.found;
}

}  // namespace selenite
