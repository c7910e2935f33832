// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>

namespace selenite {

/// Sources: docs/measurements/constants.md, "LineSearchOptions".
struct LineSearchOptions {
  int most_steps = 12;  ///< away from the start
};

/// `step`: distance over which the function changes by more than its noise.
struct LineSearchRange {
  double step, minimum, maximum;
};

/// The minimum of a function of one number that falls towards it from `start`. Steps until the function
/// rises on both sides, then takes the vertex of the parabola through the lowest point and its
/// neighbours: where the function is a wedge it is 0.086 of a step off at most. No value is asked for
/// twice.
double parabolic_line_search(const std::function<double(double)>& function, double start,
                             const LineSearchRange& range, const LineSearchOptions& options = {});

}  // namespace selenite
