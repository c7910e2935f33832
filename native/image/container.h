// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "image/format.h"
#include "image/header/exr_header.h"
#include "image/header/png_chunks.h"
#include "image/header/radiance_header.h"
#include "image/header/tiff_directory.h"

namespace selenite {

/// Which picture of a file is read, and what its header says of it.
struct Contents {
  FileFormat format;
  PngChunks png{};            ///< PNG
  RadianceHeader radiance{};  ///< Radiance
  ExrPart exr{};              ///< OpenEXR: the part that is read
  TiffDirectory page{};       ///< TIFF: the first
  int part = 0;               ///< of the file, as OpenImageIO counts
  std::optional<TiffDirectory> exif{};
  std::string icc_profile{};
  std::string interoperability{};  ///< Exif: "R98", "R03"
  int orientation = 1;             ///< Exif: 1 = upright
  bool cmyk = false;
  /// Stored channels of a TIFF, once CMYK has become RGB, and which of them is alpha
  int colors = 0;
  std::optional<int> alpha{};
  bool associated_alpha = false;  ///< colours are multiplied by it
  std::vector<std::string> warnings{};
};

/// Reads the header and nothing else. Throws FileError for what is not read: camera raw files,
/// thumbnails in front of the photo, palettes, fewer than 8 bits, Lab, deep pictures, several
/// pictures of which none is the photo, and sizes beyond the limits.
Contents examine(const std::string& path);

// The parts of `examine` that have files of their own.
void examine_tiff(const std::string& path, const FileView& view, Contents& contents);
void examine_exr(const std::string& path, const FileView& view, Contents& contents);
/// Exif data of a JPEG or PNG: orientation and colour space.
void take_exif(const TiffFile& file, const TiffDirectory& first, Contents& contents);

}  // namespace selenite
