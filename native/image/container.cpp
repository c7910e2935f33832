// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/container.h"

#include <zlib.h>

#include "image/color/icc_profile.h"
#include "image/file_error.h"
#include "image/header/jpeg_segments.h"
#include "image/limits.h"

namespace selenite {
namespace {

/// The profile in an iCCP chunk: a name, a NUL, the method, and a zlib stream.
std::string unpacked_profile(const std::string& path, const FileView& chunk) {
  constexpr uLongf kMost = 1u << 24;
  const std::string packed = chunk.bytes(0, chunk.size());
  const std::size_t name = packed.find('\0');
  std::string profile(kMost, '\0');
  uLongf size = kMost;
  if (name == std::string::npos || name + 2 > packed.size() ||
      uncompress(reinterpret_cast<Bytef*>(profile.data()), &size,
                 reinterpret_cast<const Bytef*>(packed.data()) + name + 2,
                 static_cast<uLong>(packed.size() - name - 2)) != Z_OK)
    refuse(path, "has a colour profile that is damaged", "export it as sRGB");
  profile.resize(size);
  return profile;
}

void examine_png(const std::string& path, const FileView& view, Contents& contents) {
  contents.png = png_chunks(view);
  const PngChunks& png = contents.png;
  if (png.bit_depth == 0) refuse(path, "is a PNG without a header", "copy or export it again");
  if (png.palette)
    refuse(path, "has a palette instead of colours",
           "save it as RGB with 8 or 16 bits per channel");
  if (png.bit_depth < 8)
    refuse(path, "has fewer than 8 bits per channel", "save it with 8 or 16 bits");
  check_size(path, png.width, png.height, png.channels * png.bit_depth / 8);
  if (png.profile) contents.icc_profile = unpacked_profile(path, *png.profile);
  if (png.animated) contents.warnings.emplace_back("it is animated; its first frame is read");
  if (png.exif) {
    const TiffFile file(*png.exif);
    for (const TiffDirectory& first : file.pages()) {
      take_exif(file, first, contents);
      break;
    }
  }
}

void examine_jpeg(const std::string& path, const FileView& view, Contents& contents) {
  const JpegSegments jpeg = jpeg_segments(view);
  if (jpeg.width > 0) {
    // A progressive picture is held as coefficients of 2 bytes besides.
    const int bytes = jpeg.components * (jpeg.progressive ? 3 : 1);
    check_size(path, jpeg.width, jpeg.height, bytes);
  }
  if (!jpeg.profile) refuse(path, "has a colour profile that is damaged", "export it as sRGB");
  contents.icc_profile = *jpeg.profile;
  if (jpeg.has_gain_map)
    contents.warnings.emplace_back(
        "it is tone mapped for screens (it has a gain map, which is not "
        "applied); bright parts are darker than they were");
  else if (jpeg.has_more_pictures)
    contents.warnings.emplace_back("it holds several pictures; the first is read");
  if (jpeg.exif) {
    const TiffFile file(*jpeg.exif);
    const std::vector<TiffDirectory> pages = file.pages();
    if (!pages.empty()) take_exif(file, pages[0], contents);
  }
}

void examine_radiance(const std::string& path, const FileView& view, Contents& contents) {
  contents.radiance = radiance_header(view);
  const RadianceHeader& header = contents.radiance;
  if (header.scanlines == 0)
    refuse(path, "has no line that gives its size, as in '-Y 480 +X 640'", "export it again");
  constexpr int kBytes = 3 * sizeof(float);
  check_size(path, header.scanline_length, header.scanlines, kBytes);
  if (header.format != "32-bit_rle_rgbe" && header.format != "32-bit_rle_xyze")
    refuse(path, "says FORMAT=" + header.format.substr(0, 40),
           "32-bit_rle_rgbe and 32-bit_rle_xyze are read: export it again");
}

}  // namespace

void take_exif(const TiffFile& file, const TiffDirectory& first, Contents& contents) {
  if (const auto orientation = first.integer(tiff_tag::kOrientation))
    if (*orientation >= 1 && *orientation <= 8)
      contents.orientation = static_cast<int>(*orientation);
  std::vector<TiffDirectory> found = file.below(first, tiff_tag::kExifDirectory);
  if (found.empty()) return;
  const std::vector<TiffDirectory> interoperability =
      file.below(found[0], tiff_tag::kInteroperability);
  if (!interoperability.empty())
    contents.interoperability = interoperability[0].text(tiff_tag::kInteroperabilityIndex);
  contents.exif = std::move(found[0]);
}

Contents examine(const std::string& path) {
  Contents contents{.format = recognise(path)};
  const FileView view(path);
  switch (contents.format) {
    case FileFormat::kPng:
      examine_png(path, view, contents);
      break;
    case FileFormat::kJpeg:
      examine_jpeg(path, view, contents);
      break;
    case FileFormat::kTiff:
      examine_tiff(path, view, contents);
      break;
    case FileFormat::kExr:
      examine_exr(path, view, contents);
      break;
    case FileFormat::kHdr:
      examine_radiance(path, view, contents);
      break;
  }
  // Before any decoder reads it: OpenImageIO trusts the profile's table of contents.
  if (!contents.icc_profile.empty()) check_icc_layout(path, contents.icc_profile);
  if (contents.orientation != 1)
    contents.warnings.push_back("its Exif orientation is " + std::to_string(contents.orientation) +
                                " (turned or mirrored); pixels are taken as stored, as in Blender");
  return contents;
}

}  // namespace selenite
