// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "fit/inference/confidence.h"
#include "fit/problem/unknowns.h"

namespace selenite {

/// By what factor the samples behind the intervals of `components` must grow until each is as narrow as
/// asked: half of it at most `share` of the distance of the bounds, or twice that of the value at `x`.
/// The bounds of a logarithmic value say nothing of how well it should be known. At most 1: it is.
/// 0 where the photos do not determine a component.
///
/// Intervals are taken to narrow with the root of the samples, but for `Confidence::lasting`; infinite
/// where that alone is wider than asked. Noise of the photos does not narrow either, so no factor is too
/// large for what it leaves out; instruments that are still noisy narrow faster.
Vector samples_factors(const Unknowns& unknowns, const Vector& x,
                       const std::vector<Confidence>& components, double share);

}  // namespace selenite
