// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "image/samples.h"

namespace selenite {

/// Where the values of a channel stop although the light did not.
struct ClippingLevel {
  /// Stored values from here on are clipped (integers as they are, floats as they are)
  double from = std::numeric_limits<double>::infinity();
  /// Many pixels hold exactly 1.0 in areas with hard edges: an evenly lit area, or an overexposed
  /// one. They count as not clipped.
  bool is_even_white = false;
  /// The level is not the top of integers but follows from how values pile up
  bool is_guessed = false;
  double maximum = 0;  ///< largest finite stored value
};

/// Finds the clipping level of red, green and blue from the numbers alone. A channel is clipped
///
/// 1. At the top of its integers, 255 or 65535, and at the value below it: compression blurs the top.
///    Where all values are multiples of 2^k, the top is the largest multiple. It is 65532, 65520 or
///    65280 of 14, 12 or 8 bits that were shifted. 1023, 4095 and 16383 are tops if they are the
///    maximum of at least 16 pixels.
/// 2. At a maximum of exactly 1.0 in floats, except in areas with hard edges.
/// 3. At any other maximum in which values pile up. At least 16 pixels share it, 8 times as many as
///    share one of the 32 largest values below it. Where areas of such pixels end, half of the ends
///    fall away as a slope that was cut off, or as noise on one, not as an edge. An even area can
///    end as softly, as a clear sky does; it does not count as clipped. Such an area is one in which
///    the other channels are even too, or in which all reach their tops together, at different
///    values or along a fifth of the picture's border.
///
/// A smooth function that has its maximum in the picture is flat around it, and an evenly lit area
/// has edges or one colour; where light is cut in one channel, it goes on in the others.
std::array<ClippingLevel, 3> clipping_levels(const Samples& samples);

}  // namespace selenite
