// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/beside.h"

#include <algorithm>

namespace selenite {

std::optional<Vector> beside(const Unknowns& unknowns, const Vector& x,
                             const std::vector<Confidence>& components) {
  // Small enough that others' slopes are as at 0, within a tenth.
  constexpr double kBeside = 0.1;
  Vector there = x;
  for (Eigen::Index k = 0; k < x.size(); ++k)
    if (!components[static_cast<std::size_t>(k)].determined && x[k] < kBeside / 2 &&
        unknowns.description_of(static_cast<int>(k)).squared)
      there[k] = std::min(kBeside, unknowns.maximum()[k]);
  if (there == x) return std::nullopt;
  return there;
}

std::vector<std::optional<Known>> known_from(const Vector& x,
                                             const std::vector<Confidence>& components,
                                             const Vector& there,
                                             const std::vector<Confidence>& seen) {
  std::vector<std::optional<Known>> known(seen.size());
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const double value = x[static_cast<Eigen::Index>(i)];
    if (value == there[static_cast<Eigen::Index>(i)] || !seen[i].determined) continue;
    known[i] = {value, components[i]};
    Confidence& one = known[i]->confidence;
    one.determined = true;
    one.standard_error = seen[i].standard_error;
    one.interval = {std::min(value, seen[i].interval[0]), std::max(value, seen[i].interval[1])};
  }
  return known;
}

}  // namespace selenite
