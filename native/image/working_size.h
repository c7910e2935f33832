// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "image/read.h"

namespace selenite {

/// A photo at the size of a fit.
struct WorkingPhoto {
  PictureInfo info, mask_info;      ///< of the files, with warnings of their pixels
  std::vector<float> reference;     ///< (height, width, 3) linear Rec. 709
  std::vector<float> weight;        ///< (height, width) in [0, 1]: alpha times mask
  PixelCounts counts, mask_counts;  ///< of the pixels of the files
};

/// Reads a photo, and a mask of its size unless `mask_path` is empty, through an area filter. The
/// pixels of the photo are never in memory as floats. A pixel has weight only if all photo pixels
/// in it can be used, so that neither the background nor a clipped highlight bleeds into it.
/// Throws FileError, and InvalidArgument for a size that is not between 1 and that of the photo.
WorkingPhoto read_at_size(const std::string& path, const std::string& mask_path, int width,
                          int height);

}  // namespace selenite
