// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/inference/offset_expansion.h"

#include <algorithm>
#include <cmath>

namespace selenite {
namespace {

bool holds(const Confidence& one, double value) {
  return one.interval[0] <= value && value <= one.interval[1];
}

}  // namespace

std::optional<Vector> offset_point(const Unknowns& unknowns, const Vector& x,
                                   const OffsetExpansionOptions& options) {
  Vector there = x;
  for (Eigen::Index k = 0; k < x.size(); ++k)
    if (x[k] < options.offset / 2 && unknowns.description_of(static_cast<int>(k)).squared)
      there[k] = std::min(options.offset, unknowns.maximum()[k]);
  if (there == x) return std::nullopt;
  return there;
}

std::vector<std::optional<Known>> known_from_offset(const Vector& x,
                                                    const std::vector<Confidence>& components,
                                                    const Vector& there, const Vector& found,
                                                    const std::vector<Confidence>& seen) {
  std::vector<std::optional<Known>> known(seen.size());
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    if (x[k] == there[k] || !seen[i].determined) continue;
    // Next to 0 the square of a value shows by a slope that is not known there.
    if (components[i].determined && components[i].by_slope <= seen[i].by_slope) continue;
    known[i] = {found[k], seen[i]};
    // A value at its bound stays there if that is a standard error away at most: a body that lets no
    // light through is a body of its own. Farther off the bound is one end of the interval.
    if (components[i].at_bound == AtBound::kNo ||
        std::abs(found[k] - x[k]) > seen[i].standard_error)
      continue;
    known[i]->value = x[k];
    known[i]->confidence.at_bound = components[i].at_bound;
  }
  return known;
}

bool excludes(const std::vector<std::optional<Known>>& known, const Vector& x) {
  for (std::size_t i = 0; i < known.size(); ++i)
    if (known[i] && !holds(known[i]->confidence, x[static_cast<Eigen::Index>(i)])) return true;
  return false;
}

}  // namespace selenite
