// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

namespace selenite {

// Both write beside the target under a temporary name and rename: a file is never half there.
// They throw FileError (folder missing, no permission, disk full) and InvalidArgument (sizes,
// names).

/// 32-bit float OpenEXR, ZIP. `pixels` is (height, width, channels), row 0 at the top, linear.
/// `names`: one distinct name per channel; empty: R G B (A) for 3 (4) channels, Y for 1.
void write_exr(const std::string& path, const float* pixels, int width, int height, int channels,
               std::vector<std::string> names = {});

/// PNG with 8 or 16 bits per channel, no metadata. `pixels` is (height, width, channels) linear
/// light, 1 or 3 channels; the sRGB curve is applied, values are cut to [0, 1], NaN becomes 0.
void write_png(const std::string& path, const float* pixels, int width, int height, int channels,
               int bit_depth = 8);

}  // namespace selenite
