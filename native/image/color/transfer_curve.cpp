// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/color/transfer_curve.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "math/srgb.h"

namespace selenite {

TransferCurve srgb_curve() {
  return {[](double value) { return static_cast<double>(srgb_decode(static_cast<float>(value))); }};
}

TransferCurve power_curve(double exponent) {
  if (exponent == 1) return {};
  return {[exponent](double value) { return value > 0 ? std::pow(value, exponent) : value; }};
}

TransferCurve bt709_curve() {
  // Source: Rec. ITU-R BT.2020-2, table 4, with the constants of 12-bit systems.
  constexpr double kAlpha = 1.09929682680944, kBeta = 0.018053968510807;
  return {[](double value) {
    return value < 4.5 * kBeta ? value / 4.5 : std::pow((value + kAlpha - 1) / kAlpha, 1 / 0.45);
  }};
}

TransferCurve table_curve(std::vector<double> values) {
  const double last = static_cast<double>(values.size() - 1);
  return {[values = std::move(values), last](double value) {
            const double at = std::clamp(value, 0.0, 1.0) * last;
            const auto below = static_cast<std::size_t>(std::min(at, std::max(0.0, last - 1)));
            const std::size_t above = std::min(below + 1, values.size() - 1);
            const double share = at - static_cast<double>(below);
            return values[below] + share * (values[above] - values[below]);
          },
          1.0};
}

}  // namespace selenite
