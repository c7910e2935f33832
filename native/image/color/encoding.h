// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <string>
#include <vector>

#include "image/color/primaries.h"
#include "image/color/transfer_curve.h"
#include "image/container.h"

namespace selenite {

/// How stored values become linear Rec. 709: a curve for each channel, then a matrix.
struct ColorEncoding {
  std::string name;  ///< for reports: "sRGB", "profile 'Adobe RGB (1998)'"
  std::array<TransferCurve, 3> curves{};
  Matrix3 to_rec709 = kIdentity3;
  std::vector<std::string> warnings{};

  bool has_matrix() const { return to_rec709 != kIdentity3; }
};

/// What the file says of its colours. In this order: of a PNG cICP, iCCP, sRGB, gAMA with cHRM; of
/// JPEG and TIFF the ICC profile, Exif, TIFF's tags of colorimetry; of OpenEXR chromaticities and
/// adoptedNeutral; of Radiance FORMAT, PRIMARIES, EXPOSURE and COLORCORR. Where it says nothing,
/// integers are sRGB, and floats are linear Rec. 709.
/// Throws FileError for a profile, or code points, that are not converted.
ColorEncoding color_encoding(const std::string& path, const Contents& contents, bool is_float,
                             bool grey);

}  // namespace selenite
