// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "image/read.h"
#include "image/response.h"
#include "image/working/weighted_rows.h"

namespace selenite {

/// What is known of a mask's file.
struct MaskInfo {
  PictureInfo info;  ///< with warnings of its pixels
  PixelCounts counts;
};

/// A photo at the size of a fit.
struct WorkingPhoto {
  PictureInfo info;              ///< of the file, with warnings of its pixels
  std::vector<MaskInfo> masks;   ///< in the order in which they were given
  std::vector<float> reference;  ///< (height, width, 3) linear Rec. 709
  std::vector<float> weight;     ///< (height, width) in [0, 1]: alpha times masks
  std::vector<float> inside;     ///< (height, width): share where alpha and masks are not 0; 1: all
  PixelCounts counts;            ///< of the pixels of the file
  double isolated = 0;           ///< share of light in isolated bright pixels; 0: not worth telling
};

/// A mask of any size and of the photo's shape.
struct MaskFile {
  std::string path;
  MaskKind kind = MaskKind::kInclude;
};

/// How a photo is brought to the size of a fit.
struct Reading {
  std::vector<MaskFile> masks{};
  Response response{};
  /// Where the corners of the pixels lie in the photo, (height + 1, width + 1, 2): x, y in its pixels
  /// from its top left corner; NaN: nowhere. Empty: evenly over all of it.
  std::vector<double> corners{};
  /// (height, width): of which pixels warnings are; not 0: of this one. Empty: of all.
  std::vector<std::uint8_t> within{};
};

/// Reads a photo through an area filter, which follows the pixels' outlines if their corners are
/// given. The pixels of the photo are never all in memory as floats. A pixel has weight only if all
/// photo pixels in it can be used and none lies outside, so that neither the background nor a clipped
/// highlight bleeds into it.
/// Throws FileError, and InvalidArgument for a size that is not between 1 and that of the photo.
WorkingPhoto read_at_size(const std::string& path, int width, int height,
                          const Reading& reading = {});

}  // namespace selenite
