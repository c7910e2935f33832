// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "fit/evaluate/finite_differences.h"

namespace selenite {

/// A photo rendered at values x, with the slots of all unknowns and the differences that
/// `derivatives` names.
using RenderAt = std::function<Film(const Vector& x, const Photo& photo, int spp,
                                    std::uint64_t seed, std::optional<Differences> derivatives)>;

}  // namespace selenite
