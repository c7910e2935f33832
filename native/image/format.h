// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace selenite {

/// The formats that are opened at all; every other kind of content is refused.
enum class FileFormat { kPng, kJpeg, kTiff, kExr, kHdr };

/// Name as in `probe` and as OpenImageIO calls its plugin: png, jpeg, tiff, openexr, hdr.
const char* format_name(FileFormat format);

/// What the first bytes of a file tell, before any decoder has seen it.
struct FileHead {
  FileFormat format;
  int png_bit_depth = 0;     ///< PNG only
  bool png_palette = false;  ///< PNG only
};

/// Decides by content, never by the extension. Throws FileError when the file is missing, is not a
/// plain file, is empty, cannot be opened or is none of the known formats.
FileHead recognise(const std::string& path);

}  // namespace selenite
