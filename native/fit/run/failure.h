// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <exception>
#include <string>
#include <vector>

#include "math/fault.h"

namespace selenite {

/// What an error that ends a fit says; `where` is the object of what names none.
std::vector<Fault> failure(const std::exception& error, const std::string& where);

}  // namespace selenite
