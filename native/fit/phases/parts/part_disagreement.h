// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "fit/inference/confidence.h"
#include "fit/problem/reparametrization.h"

namespace selenite {

/// What some of the photos say alone.
struct PartAnswer {
  Vector x;
  std::vector<Confidence> components;  ///< by what the part shows
  void members(SavedState& state) { state(x, components); }
};

/// Widens what `report` says of x by how far the answers of disjoint parts of the photos lie from it.
///
/// Their scatter is the variance of one part; the answer has as many parts as there are. It counts where it
/// exceeds what chance makes of the variance that the report knows. A part that does not determine a value
/// counts by the end of its interval, if that excludes x: a dark photo may want a colour of 1. Parts of a few photos lie farther apart
/// than the linear jackknife over photos says, as pictures do not change evenly that far.
void widen_by_parts(const Unknowns& unknowns, const Reparametrization& reparametrization,
                    const Vector& x, const std::vector<PartAnswer>& parts, TrustReport& report);

}  // namespace selenite
