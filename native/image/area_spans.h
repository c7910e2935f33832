// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

namespace selenite {

/// Input pixels under one output pixel, with their share of it.
struct AreaSpan {
  int first = 0;
  std::vector<double> weights;
};

/// Of an area filter from `in` pixels to `out`; the weights of a span add up to 1.
std::vector<AreaSpan> area_spans(int in, int out);

}  // namespace selenite
