// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "fit/inference/confidence_intervals.h"

namespace selenite {

/// Where to look for what a look at x knows badly because a picture goes with its square, whose slope
/// vanishes at 0 (or, where others make up for its own, a little further in): well beyond, all else as
/// at x. Empty where there is nothing of the kind.
std::optional<Vector> offset_point(const Unknowns& unknowns, const Vector& x);
/// What the look from `there`, which led to `found`, says about it: where it leads, but a value
/// at its bound, by `components`, stays there if that is within a standard error. Empty for what is
/// better known at x.
std::vector<std::optional<Known>> known_from_offset(const Vector& x,
                                             const std::vector<Confidence>& components,
                                             const Vector& there, const Vector& found,
                                             const std::vector<Confidence>& seen);

/// Whether what is known leaves x out.
bool excludes(const std::vector<std::optional<Known>>& known, const Vector& x);

}  // namespace selenite
