// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/photo/photo.h"

namespace selenite {

/// Whether a pixel of the file lies in several of the photo, as an area filter leaves it that makes a photo
/// smaller by no whole factor: then neighbours have noise in common. False where the file is not known, and
/// of the small pictures of a search: what lies two of their pixels off is another part of the body.
inline bool shares_pixels(const Photo& photo) {
  const PhotoFrame& file = photo.frame;
  return !photo.is_small && file.width > 0 &&
         (file.width % photo.width != 0 || file.height % photo.height != 0);
}

}  // namespace selenite
