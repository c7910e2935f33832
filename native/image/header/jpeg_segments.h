// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "image/header/file_view.h"

namespace selenite {

/// What the segments of a JPEG before its scans say.
struct JpegSegments {
  std::int64_t width = 0, height = 0;  ///< of the frame header; 0 if there is none
  int components = 0;
  bool progressive = false;
  std::optional<FileView> exif;  ///< the TIFF block of APP1
  /// The ICC profile, put together of APP2; empty if there is none, nothing if it is damaged
  std::optional<std::string> profile = std::string();
  bool has_more_pictures = false;  ///< multi-picture format (CIPA DC-007)
  bool has_gain_map = false;  ///< the picture is tone mapped; a gain map undoes it (ISO 21496-1)
};

JpegSegments jpeg_segments(const FileView& view);

}  // namespace selenite
