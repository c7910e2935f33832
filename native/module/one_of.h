// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "math/fault.h"

namespace selenite {

/// The value that a name stands for; InvalidArgument lists the names.
template <class T>
T one_of(const std::string& what, const std::string& value,
         const std::vector<std::pair<const char*, T>>& choices) {
  std::string names;
  for (const auto& [name, result] : choices) {
    if (value == name) return result;
    names += (names.empty() ? "" : ", ") + std::string(name);
  }
  throw Refused("", what + " = '" + value + "' is not one of " + names);
}

}  // namespace selenite
