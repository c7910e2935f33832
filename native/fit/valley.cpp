// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/valley.h"

#include <algorithm>
#include <map>

namespace selenite {
namespace {

constexpr int kMostSteps = 12;  ///< away from the start

}  // namespace

double valley_bottom(const std::function<double(double)>& height, double start,
                     const ValleyRange& range) {
  const auto [step, minimum, maximum] = range;
  std::map<double, double> known;
  const auto at = [&](double x) {
    const auto found = known.find(x);
    return found != known.end() ? found->second : known[x] = height(x);
  };
  const auto inside = [&](double x) { return std::clamp(x, minimum, maximum); };
  double bottom = inside(start);
  for (int i = 0; i < kMostSteps; ++i) {
    const double from = bottom;
    for (const double next : {inside(from - step), inside(from + step)})
      if (at(next) < at(bottom)) bottom = next;
    if (bottom == from) break;
  }
  const double left = bottom - step, right = bottom + step;
  if (left < minimum || right > maximum) return bottom;
  const double rise = at(right) - at(left), bend = at(left) + at(right) - 2 * at(bottom);
  return bend > 0 ? bottom - step * std::clamp(rise / (2 * bend), -0.5, 0.5) : bottom;
}

}  // namespace selenite
