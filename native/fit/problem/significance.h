// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace selenite {

// Levels that several decisions of a fit share. None of them is measured on its own:
// docs/measurements/constants.md.

/// Standard deviations of a difference from which it counts where a mistake costs iterations only:
/// one in twenty.
inline constexpr double kLikelySigmas = 2;
/// The same where a mistake would be reported to the user: one in 370.
inline constexpr double kCertainSigmas = 3;

/// Share of a component's range, in `Reparametrization`. Values nearer to each other belong to one
/// basin; a standard deviation beyond it says nothing that the bounds do not say.
inline constexpr double kNarrowShare = 0.1;
/// Share of the longest step. Within it the linear model of the photos holds, and the step needs no
/// second look.
inline constexpr double kLinearShare = 0.1;

/// The first passes of a refinement and rounds of a comparison take a sixteenth and a quarter of the
/// samples: the way to where the last one begins.
inline constexpr int kFirstShare = 16, kSecondShare = 4;

}  // namespace selenite
