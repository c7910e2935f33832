// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "fit/photo/photo.h"

namespace selenite {

/// Pixels around those that count which filters look at: `WienerFilter` with all its blurs and its window,
/// and one more.
inline constexpr int kFilterReach = 12;

/// What a fit renders of a photo: its `pixels`; else those that count and those around them. Null: all.
std::shared_ptr<const PixelMask> rendered_pixels(const Photo& photo);

/// How many these are.
double rendered_count(const Photo& photo);

}  // namespace selenite
