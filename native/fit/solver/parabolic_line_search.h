// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>

namespace selenite {

/// Where to look for the bottom of a valley: `step` is what its slopes show in, `minimum` to `maximum`
/// what is allowed.
struct LineSearchRange {
  double step, minimum, maximum;
};

/// The lowest point of a function of one number that falls towards it from `start`: steps until it
/// rises on both sides, then the vertex of the parabola through the lowest point and its neighbours
/// (0.086 of a step off at most where the valley is a wedge). No height is asked for twice.
double parabolic_line_search(const std::function<double(double)>& height, double start,
                     const LineSearchRange& range);

}  // namespace selenite
