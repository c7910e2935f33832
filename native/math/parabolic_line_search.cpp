// SPDX-License-Identifier: GPL-3.0-or-later
#include "math/parabolic_line_search.h"

#include <algorithm>
#include <map>

namespace selenite {

double parabolic_line_search(const std::function<double(double)>& function, double start,
                             const LineSearchRange& range, const LineSearchOptions& options) {
  const double step = range.step, origin = std::clamp(start, range.minimum, range.maximum);
  const auto at_step = [&](int i) {
    return std::clamp(origin + i * step, range.minimum, range.maximum);
  };
  std::map<int, double> known;
  const auto value = [&](int i) {
    const auto found = known.find(i);
    return found != known.end() ? found->second : known[i] = function(at_step(i));
  };
  int lowest = 0;
  for (int n = 0; n < options.most_steps; ++n) {
    const int from = lowest;
    for (const int next : {from - 1, from + 1})
      if (value(next) < value(lowest)) lowest = next;
    if (lowest == from) break;
  }
  const bool enclosed = at_step(lowest - 1) > range.minimum && at_step(lowest + 1) < range.maximum;
  const double rise = value(lowest + 1) - value(lowest - 1);
  const double bend = value(lowest - 1) + value(lowest + 1) - 2 * value(lowest);
  if (!enclosed || !(bend > 0)) return at_step(lowest);
  return at_step(lowest) - step * std::clamp(rise / (2 * bend), -0.5, 0.5);
}

}  // namespace selenite
