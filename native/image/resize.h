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

/// Area filter: every output pixel is the mean of the input over the rectangle that it covers, also
/// where its border cuts input pixels, and also when enlarging. The mean of the picture is kept.
///
/// `pixels` is (height, width, channels), row 0 at the top, in linear light: averaging encoded
/// values darkens edges. NaN spreads to the output pixels it lies in and no further. Throws
/// InvalidArgument on an empty picture or size, or a result of over 100 megapixels.
std::vector<float> resize(const float* pixels, int width, int height, int channels, int new_width,
                          int new_height);

}  // namespace selenite
