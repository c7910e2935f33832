// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace selenite {

/// The formats that are opened at all; every other kind of content is refused.
enum class FileFormat { kPng, kJpeg, kTiff, kExr, kHdr };

/// Name as in `probe` and as OpenImageIO calls its plugin: png, jpeg, tiff, openexr, hdr.
const char* format_name(FileFormat format);

/// Decides by content, never by the extension. Throws FileError when the file is missing, is not a
/// plain file, is empty, cannot be opened or is none of the known formats; camera raw files and HEIF
/// are named.
FileFormat recognise(const std::string& path);

}  // namespace selenite
