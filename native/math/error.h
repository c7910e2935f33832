// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <stdexcept>

namespace selenite {

/// Bad input: the message names object, value, permitted range and cure. Python sees ValueError.
struct InvalidArgument : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};
/// A name that is not there. Python sees KeyError.
struct UnknownName : std::out_of_range {
  using std::out_of_range::out_of_range;
};
/// Work stopped because its caller asked for it. Python sees Cancelled.
struct Cancelled : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace selenite
