// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "image/header/file_view.h"

namespace selenite {

/// Tags of TIFF 6.0, its supplements, DNG 1.7 and Exif 2.32 that say what a picture is.
namespace tiff_tag {
inline constexpr std::uint16_t kNewSubfileType = 254, kSubfileType = 255, kWidth = 256,
                               kHeight = 257, kBits = 258, kPhotometric = 262, kMake = 271,
                               kOrientation = 274, kSamples = 277, kTransferFunction = 301,
                               kWhitePoint = 318, kPrimaries = 319, kTileWidth = 322,
                               kTileHeight = 323, kSubDirectories = 330, kExtraSamples = 338,
                               kSampleFormat = 339, kExifDirectory = 34665, kIccProfile = 34675,
                               kDngVersion = 50706, kColorSpace = 40961, kInteroperability = 40965,
                               kInteroperabilityIndex = 1, kGamma = 42240;
}  // namespace tiff_tag

/// One image file directory: its entries and where the next one is.
class TiffDirectory {
 public:
  bool has(std::uint16_t tag) const { return entries_.count(tag) > 0; }
  /// Element `index` as a whole number (types BYTE, SHORT, LONG, LONG8, IFD).
  std::optional<std::uint64_t> integer(std::uint16_t tag, std::size_t index = 0) const;
  /// All elements (whole numbers, fractions, FLOAT and DOUBLE).
  std::vector<double> numbers(std::uint16_t tag) const;
  /// The value as it is stored; empty if there is none.
  std::string bytes(std::uint16_t tag) const;
  /// Text up to the first NUL.
  std::string text(std::uint16_t tag) const;
  std::uint64_t next() const { return next_; }

 private:
  friend class TiffFile;
  struct Entry {
    int type = 0;
    std::string data;
  };
  std::map<std::uint16_t, Entry> entries_;
  std::uint64_t next_ = 0;
  bool big_endian_ = false;
};

/// Directories of a TIFF or BigTIFF file, or of a block of Exif data, which has the same form.
class TiffFile {
 public:
  /// Nothing is read behind the end of `view`. A header that is none gives no directories.
  explicit TiffFile(FileView view);

  /// The chain of directories that begins at the header; a loop or a bad offset ends it.
  std::vector<TiffDirectory> pages() const;
  /// Directories that entry `tag` of `parent` points to.
  std::vector<TiffDirectory> below(const TiffDirectory& parent, std::uint16_t tag) const;

 private:
  std::optional<TiffDirectory> directory(std::uint64_t at) const;

  FileView view_;
  bool big_endian_ = false, is_big_ = false;
  std::uint64_t first_ = 0;
};

}  // namespace selenite
