// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "fit/inference/confidence_intervals.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "OffsetExpansionOptions".
struct OffsetExpansionOptions {
  /// Value of a transmission there, where the answer is below half of it. It is so small that the slopes
  /// of the others are as at 0 within a tenth.
  double offset = 0.1;
};

/// Where to expand the photos for values that show by their square only, whose slope vanishes at 0 (or a
/// little above, where others make up for their own): well beyond 0, all others as at x. Empty where
/// there is no such value.
std::optional<Vector> offset_point(const Unknowns& unknowns, const Vector& x,
                                   const OffsetExpansionOptions& options = {});
/// What the pass at `there`, which led to `found`, says about those values. A value at its bound, by
/// `components`, stays there if that is within a standard error. Empty for what is better known at x.
std::vector<std::optional<Known>> known_from_offset(const Vector& x,
                                                    const std::vector<Confidence>& components,
                                                    const Vector& there, const Vector& found,
                                                    const std::vector<Confidence>& seen);

/// Whether x lies outside of an interval that is known.
bool excludes(const std::vector<std::optional<Known>>& known, const Vector& x);

}  // namespace selenite
