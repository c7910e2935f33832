// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>

namespace selenite {

/// Pixels of a picture that is written or resized.
inline constexpr std::int64_t kLargestPicture = 100'000'000;
/// Pixels and bytes of a picture that is read, as it is stored once unpacked; judged by the header,
/// before a decoder asks for memory. A photo of 100 megapixels with 16 bits takes 600 million.
inline constexpr std::int64_t kMostPixels = 200'000'000;
inline constexpr std::int64_t kMostBytes = 640'000'000;
inline constexpr std::int64_t kLongestSide = 100'000;
/// Bytes of a picture that is read whole, as floats, and while it is unpacked.
inline constexpr std::int64_t kMostBytesAsFloats = 900'000'000;

/// Throws FileError unless a picture of this size is read.
void check_size(const std::string& path, std::int64_t width, std::int64_t height,
                std::int64_t bytes_per_pixel, std::int64_t most_bytes = kMostBytes);

std::string size_text(std::int64_t width, std::int64_t height);

}  // namespace selenite
