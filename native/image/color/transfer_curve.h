// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <limits>
#include <vector>

namespace selenite {

/// Stored value, 1 at the top of integers, to linear light.
struct TransferCurve {
  std::function<double(double)> decode;                      ///< empty: the value is linear
  double highest = std::numeric_limits<double>::infinity();  ///< the curve says nothing above

  bool linear() const { return !decode; }
};

TransferCurve srgb_curve();
/// value^exponent.
TransferCurve power_curve(double exponent);
/// Inverse of the transfer function of the cameras of Rec. ITU-R BT.709 and BT.2020.
TransferCurve bt709_curve();
/// Linear between equally spaced values from 0 to 1.
TransferCurve table_curve(std::vector<double> values);

}  // namespace selenite
