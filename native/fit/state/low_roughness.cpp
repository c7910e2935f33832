// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/state/low_roughness.h"

#include <algorithm>
#include <cmath>

namespace selenite {

Vector at_low_roughness(const Unknowns& unknowns, Vector x) {
  for (int k = 0; k < unknowns.size(); ++k)
    if (unknowns.description_of(k).scale == Scale::kRoughness)
      x[k] = std::min(x[k], ReparametrizationOptions{}.low_roughness);
  return unknowns.project(x);
}

bool is_low_roughness(const Unknowns& unknowns, const Vector& x) {
  return at_low_roughness(unknowns, x) == x;
}

bool explains_as_well(const Validation& one, const Validation& other) {
  return one.unbiased <= other.unbiased + std::sqrt(other.variance) && !is_worse(one, other, 1);
}

}  // namespace selenite
