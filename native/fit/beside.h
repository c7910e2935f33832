// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "fit/uncertainty.h"

namespace selenite {

/// Where to look for what is not determined at x because a picture goes with its square, whose slope
/// vanishes at 0: further in, all else as at x. Empty where there is nothing of the kind.
std::optional<Vector> beside(const Unknowns& unknowns, const Vector& x,
                             const std::vector<Confidence>& components);
/// What the look from `there`, which led to `found`, says about it: it stays as at x, `components`,
/// unless its interval tells otherwise.
std::vector<std::optional<Known>> known_from(const Vector& x,
                                             const std::vector<Confidence>& components,
                                             const Vector& there, const Vector& found,
                                             const std::vector<Confidence>& seen);

}  // namespace selenite
