// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/area_spans.h"

#include <algorithm>
#include <cstdint>

namespace selenite {

/// On a scale of in * out ticks an input pixel is `out` ticks wide and an output pixel `in`:
/// overlaps are whole numbers, and the weights of a span add up to 1 without rounding drift.
std::vector<AreaSpan> area_spans(int in, int out) {
  std::vector<AreaSpan> all(static_cast<std::size_t>(out));
  for (std::int64_t j = 0; j < out; ++j) {
    const std::int64_t begin = j * in, end = begin + in;
    const std::int64_t first = begin / out, last = (end - 1) / out;
    AreaSpan& span = all[static_cast<std::size_t>(j)];
    span.first = static_cast<int>(first);
    for (std::int64_t i = first; i <= last; ++i) {
      const std::int64_t overlap = std::min(end, (i + 1) * out) - std::max(begin, i * out);
      span.weights.push_back(static_cast<double>(overlap) / in);
    }
  }
  return all;
}

}  // namespace selenite
