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
                                             const Vector& there, const Vector& found,
                                             const std::vector<Confidence>& seen) {
  std::vector<std::optional<Known>> known(seen.size());
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    if (x[k] == there[k] || !seen[i].determined) continue;
    known[i] = {found[k], seen[i]};
    if (x[k] < seen[i].interval[0] || x[k] > seen[i].interval[1]) continue;
    known[i]->value = x[k];
    known[i]->confidence.at_bound = components[i].at_bound;
  }
  return known;
}

}  // namespace selenite
