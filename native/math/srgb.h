// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>

namespace selenite {

/// Display value in [0, 1] to linear light. Below 0 the linear piece goes on; above 1 the power
/// does. Source: IEC 61966-2-1.
inline float srgb_decode(float encoded) {
  return encoded <= 0.04045f ? encoded / 12.92f : std::pow((encoded + 0.055f) / 1.055f, 2.4f);
}

/// Linear light to display value; inverse of `srgb_decode`.
inline float srgb_encode(float linear) {
  return linear <= 0.0031308f ? linear * 12.92f : 1.055f * std::pow(linear, 1 / 2.4f) - 0.055f;
}

}  // namespace selenite
