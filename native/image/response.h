// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "image/color/transfer_curve.h"

namespace selenite {

/// Code values of one channel that count, 1 at the top of integers.
struct CodeRange {
  double lowest = -std::numeric_limits<double>::infinity();
  double highest = std::numeric_limits<double>::infinity();
};

/// How a camera made code values of light, where that is known better than the file says.
struct Response {
  std::vector<TransferCurve> curves{};  ///< of red, green and blue; none: as the file says
  std::array<CodeRange, 3> counted{};
  bool finds_clipping = true;  ///< besides, see clipping.h
};

/// Linear between rows of (code value, red, green, blue), whose code values increase; what lies
/// outside of them does not count. Throws InvalidArgument: fewer than two rows, values that are not
/// finite, light that falls while the code value rises.
Response table_response(const std::vector<std::array<double, 4>>& rows);

}  // namespace selenite
