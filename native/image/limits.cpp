// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/limits.h"

#include "image/file_error.h"

namespace selenite {

std::string size_text(std::int64_t width, std::int64_t height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

void check_size(const std::string& path, std::int64_t width, std::int64_t height,
                std::int64_t bytes_per_pixel, std::int64_t most_bytes) {
  if (width < 1 || height < 1)
    refuse(path, "says it has " + size_text(width, height) + " pixels",
           "it must have at least 1 x 1: export it again");
  const bool is_long = width > kLongestSide || height > kLongestSide;
  if (!is_long && width * height <= kMostPixels && width * height * bytes_per_pixel <= most_bytes)
    return;
  const double megabytes = static_cast<double>(width) * static_cast<double>(height) *
                           static_cast<double>(bytes_per_pixel) / 1e6;
  refuse(path,
         "says it has " + size_text(width, height) + " pixels, which take " +
             std::to_string(static_cast<std::int64_t>(megabytes)) + " megabytes",
         "at most " + std::to_string(kLongestSide) + " pixels along a side, " +
             std::to_string(kMostPixels / 1'000'000) + " megapixels and " +
             std::to_string(most_bytes / 1'000'000) +
             " megabytes are read: scale it down, or save fewer bits or channels");
}

}  // namespace selenite
