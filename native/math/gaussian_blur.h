// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

namespace selenite {

/// A picture of `channels` numbers a pixel, row by row, smoothed by a Gaussian of `sigma` pixels that
/// is cut at three of them. Beyond an edge lies the opposite edge where the picture `repeats`, else
/// the pixel at the edge. A sigma below 0.2 leaves the picture as it is.
std::vector<double> gaussian_blur(std::vector<double> picture, std::ptrdiff_t height,
                                  std::ptrdiff_t width, int channels, double sigma, bool repeats);

}  // namespace selenite
