// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/format.h"

#include <array>
#include <fstream>
#include <string_view>

#include "image/file_error.h"

namespace selenite {
namespace {

using namespace std::string_view_literals;

struct Magic {
  std::string_view bytes;
  FileFormat format;
};

constexpr std::array kMagic{
    Magic{"\x89PNG\r\n\x1a\n"sv, FileFormat::kPng},
    Magic{"\xff\xd8\xff"sv, FileFormat::kJpeg},
    Magic{"II*\0"sv, FileFormat::kTiff},
    Magic{"MM\0*"sv, FileFormat::kTiff},
    Magic{"II+\0"sv, FileFormat::kTiff},
    Magic{"MM\0+"sv, FileFormat::kTiff},
    Magic{"v/1\x01"sv, FileFormat::kExr},
    Magic{"#?RADIANCE"sv, FileFormat::kHdr},
    Magic{"#?RGBE"sv, FileFormat::kHdr},
};
/// Camera raw files of this maker begin as a TIFF does; decoding one gives its thumbnail.
constexpr std::string_view kCanonRaw = "CR";
constexpr std::size_t kCanonRawAt = 8;
// Positions in a PNG: the IHDR chunk always comes first.
constexpr std::size_t kPngBitDepthAt = 24, kPngColorTypeAt = 25;
constexpr char kPngPalette = 3;

}  // namespace

const char* format_name(FileFormat format) {
  switch (format) {
    case FileFormat::kPng:
      return "png";
    case FileFormat::kJpeg:
      return "jpeg";
    case FileFormat::kTiff:
      return "tiff";
    case FileFormat::kExr:
      return "openexr";
    default:
      return "hdr";
  }
}

FileHead recognise(const std::string& path) {
  const std::filesystem::path file = path_from_utf8(path);
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (!std::filesystem::exists(status))
    throw FileError("'" + path + "' does not exist; choose the photo again");
  if (!std::filesystem::is_regular_file(status))  // a pipe would hang, a folder has no bytes
    throw FileError("'" + path + "' is not a file; choose a photo");
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw FileError("'" + path + "' cannot be opened; check its permissions");
  std::array<char, 32> bytes{};
  stream.read(bytes.data(), bytes.size());
  const std::string_view head(bytes.data(), static_cast<std::size_t>(stream.gcount()));
  if (head.empty()) throw FileError("'" + path + "' is empty; copy the photo again");
  if (head.substr(0, 2) == "II" && head.size() > kCanonRawAt &&
      head.substr(kCanonRawAt, kCanonRaw.size()) == kCanonRaw)
    throw FileError("'" + path + "' is a camera raw file; develop it to a 16-bit TIFF or EXR");
  for (const Magic& magic : kMagic) {
    if (!head.starts_with(magic.bytes)) continue;
    FileHead found{magic.format};
    if (found.format == FileFormat::kPng && head.size() > kPngColorTypeAt) {
      found.png_bit_depth = static_cast<unsigned char>(head[kPngBitDepthAt]);
      found.png_palette = head[kPngColorTypeAt] == kPngPalette;
    }
    return found;
  }
  throw FileError("'" + path +
                  "' holds no PNG, JPEG, TIFF, OpenEXR or Radiance HDR picture (judged by its "
                  "content, not by its name); convert it to one of these");
}

}  // namespace selenite
