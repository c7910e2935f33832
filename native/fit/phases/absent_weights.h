// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "fit/inference/confidence.h"
#include "fit/problem/reparametrization.h"

namespace selenite {

/// A weight at 0: what it weighs is not there.
struct AbsentWeight {
  int component;
  Confidence confidence;  ///< by the photos, where the weight was free
};

/// Values that may explain the photos as well as the answer of a fit.
struct Alternative {
  Vector x;
  std::vector<AbsentWeight> absent{};  ///< these stay at 0
  void members(SavedState& state) { state(x, absent); }
};

/// The answer `x` without what the photos do not tell from nothing: all such weights at 0, then each of
/// several alone. The other values make up for them as far as the covariance of `report` says.
std::vector<Alternative> without_weights(const Unknowns& unknowns,
                                         const Reparametrization& reparametrization,
                                         const Vector& x, const TrustReport& report);

}  // namespace selenite
