// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/resize.h"

#include <algorithm>
#include <cstdint>
#include <string>

#include "image/limits.h"
#include "math/fault.h"

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

std::vector<float> resize(const float* pixels, int width, int height, int channels, int new_width,
                          int new_height) {
  if (width < 1 || height < 1 || channels < 1)
    throw Refused("resize",
                  "a picture of " + std::to_string(width) + " x " + std::to_string(height) + " x " +
                      std::to_string(channels) + " holds nothing",
                  "every size must be at least 1");
  if (new_width < 1 || new_height < 1 ||
      static_cast<std::int64_t>(new_width) * new_height > kLargestPicture)
    throw Refused("resize", "new size " + std::to_string(new_width) + " x " +
                                std::to_string(new_height) +
                                " must be at least 1 x 1 and at most 100 megapixels");
  const std::size_t row = static_cast<std::size_t>(width) * channels;
  const std::vector<AreaSpan> across = area_spans(width, new_width);
  const std::vector<AreaSpan> down = area_spans(height, new_height);
  std::vector<float> result(static_cast<std::size_t>(new_width) * new_height * channels);
  std::vector<double> tall(row);  // one output row, still as wide as the input
  float* out = result.data();
  for (const AreaSpan& rows : down) {
    std::fill(tall.begin(), tall.end(), 0.0);
    for (std::size_t i = 0; i < rows.weights.size(); ++i) {
      const double weight = rows.weights[i];
      const float* in = pixels + (static_cast<std::size_t>(rows.first) + i) * row;
      for (std::size_t x = 0; x < row; ++x) tall[x] += weight * in[x];
    }
    for (const AreaSpan& columns : across) {
      for (int c = 0; c < channels; ++c) {
        double sum = 0;
        const double* in = tall.data() + static_cast<std::size_t>(columns.first) * channels + c;
        for (std::size_t i = 0; i < columns.weights.size(); ++i, in += channels)
          sum += columns.weights[i] * *in;
        *out++ = static_cast<float>(sum);
      }
    }
  }
  return result;
}

}  // namespace selenite
