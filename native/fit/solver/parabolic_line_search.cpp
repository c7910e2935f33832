// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/parabolic_line_search.h"

#include <algorithm>
#include <map>

namespace selenite {
namespace {

constexpr int kMostSteps = 12;  ///< away from the start

}  // namespace

double parabolic_line_search(const std::function<double(double)>& height, double start,
                     const LineSearchRange& range) {
  const double step = range.step, origin = std::clamp(start, range.minimum, range.maximum);
  const auto place = [&](int i) {
    return std::clamp(origin + i * step, range.minimum, range.maximum);
  };
  std::map<int, double> known;
  const auto at = [&](int i) {
    const auto found = known.find(i);
    return found != known.end() ? found->second : known[i] = height(place(i));
  };
  int bottom = 0;
  for (int n = 0; n < kMostSteps; ++n) {
    const int from = bottom;
    for (const int next : {from - 1, from + 1})
      if (at(next) < at(bottom)) bottom = next;
    if (bottom == from) break;
  }
  const bool enclosed = place(bottom - 1) > range.minimum && place(bottom + 1) < range.maximum;
  const double rise = at(bottom + 1) - at(bottom - 1);
  const double bend = at(bottom - 1) + at(bottom + 1) - 2 * at(bottom);
  if (!enclosed || !(bend > 0)) return place(bottom);
  return place(bottom) - step * std::clamp(rise / (2 * bend), -0.5, 0.5);
}

}  // namespace selenite
