// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>

#include "image/container.h"
#include "image/file_error.h"
#include "image/limits.h"

namespace selenite {
namespace {

// Of the tag PhotometricInterpretation.
constexpr std::uint64_t kWhiteIsZero = 0, kBlackIsZero = 1, kRgb = 2, kPalette = 3, kMask = 4,
                        kSeparated = 5, kYCbCr = 6, kCieLab = 8, kIccLab = 9, kItuLab = 10,
                        kColorFilterArray = 32803, kLinearRaw = 34892;
constexpr std::uint64_t kReducedBit = 1, kMaskBit = 4, kOldReduced = 2;
constexpr std::uint64_t kUnsigned = 1, kFloat = 3, kUndefined = 4;
constexpr const char* kRawCure =
    "; develop it in a raw developer, without a tone curve, to a 16-bit TIFF or an EXR";

std::uint64_t photometric(const TiffDirectory& page) {
  const auto samples = page.integer(tiff_tag::kSamples).value_or(1);
  return page.integer(tiff_tag::kPhotometric).value_or(samples < 3 ? kBlackIsZero : kRgb);
}

bool is_sensor_data(const TiffDirectory& page) {
  const std::uint64_t kind = photometric(page);
  return kind == kColorFilterArray || kind == kLinearRaw;
}

bool is_reduced(const TiffDirectory& page) {
  return (page.integer(tiff_tag::kNewSubfileType).value_or(0) & kReducedBit) != 0 ||
         page.integer(tiff_tag::kSubfileType) == kOldReduced;
}

std::int64_t side(const TiffDirectory& page, std::uint16_t tag) {
  constexpr std::uint64_t kMost = std::uint64_t{1} << 31;
  return static_cast<std::int64_t>(std::min(page.integer(tag).value_or(0), kMost));
}

std::int64_t area(const TiffDirectory& page) {
  return side(page, tiff_tag::kWidth) * side(page, tiff_tag::kHeight);
}

std::string size_of(const TiffDirectory& page) {
  return size_text(side(page, tiff_tag::kWidth), side(page, tiff_tag::kHeight));
}

/// Camera raw files begin as a TIFF does; decoding one gives its thumbnail or a mosaic.
void check_raw(const std::string& path, const std::vector<TiffDirectory>& pages,
               const std::vector<TiffDirectory>& below) {
  const auto any = [&](const auto& test) {
    return std::any_of(pages.begin(), pages.end(), test) ||
           std::any_of(below.begin(), below.end(), test);
  };
  const bool is_dng =
      any([](const TiffDirectory& page) { return page.has(tiff_tag::kDngVersion); });
  if (!is_dng && !any(is_sensor_data)) return;
  std::string maker = pages[0].text(tiff_tag::kMake);
  std::erase_if(maker, [](char c) { return c < ' ' || c > '~' || c == '\''; });
  refuse(path,
         std::string("is a camera raw file (") + (is_dng ? "DNG" : "sensor data") +
             (maker.empty() ? "" : " by " + maker) + ")",
         kRawCure);
}

void check_pages(const std::string& path, const std::vector<TiffDirectory>& pages,
                 const std::vector<TiffDirectory>& below, Contents& contents) {
  const TiffDirectory& first = pages[0];
  if (is_reduced(first))
    refuse(path, "begins with a reduced copy of " + size_of(first) + " pixels (a thumbnail)",
           "save the photo alone");
  for (const std::vector<TiffDirectory>* list : {&pages, &below})
    for (const TiffDirectory& page : *list)
      if (area(page) > area(first))
        refuse(path,
               "holds a picture of " + size_of(page) + " pixels behind the first one of " +
                   size_of(first),
               "save the photo alone");
  const auto further = std::count_if(pages.begin() + 1, pages.end(), [](const TiffDirectory& page) {
    const auto type = page.integer(tiff_tag::kNewSubfileType).value_or(0);
    return !is_reduced(page) && (type & kMaskBit) == 0;
  });
  if (further > 0)
    contents.warnings.push_back("it holds " + std::to_string(further + 1) +
                                " pages; the first is read");
}

/// Bytes of a sample.
std::int64_t check_numbers(const std::string& path, const TiffDirectory& page,
                           std::uint64_t samples) {
  const auto bits = page.integer(tiff_tag::kBits).value_or(1);
  const auto format = page.integer(tiff_tag::kSampleFormat).value_or(kUnsigned);
  for (std::size_t i = 1; i < samples; ++i)
    if (page.integer(tiff_tag::kBits, i).value_or(bits) != bits)
      refuse(path, "has channels of different depths", "save it with 8 or 16 bits for each");
  if (bits < 8) refuse(path, "has fewer than 8 bits per channel", "save it with 8 or 16 bits");
  const bool is_integer = format == kUnsigned || format == kUndefined;
  const bool known = is_integer ? bits == 8 || bits == 10 || bits == 12 || bits == 14 || bits == 16
                                : format == kFloat && (bits == 16 || bits == 32 || bits == 64);
  if (!known)
    refuse(path,
           "stores " + std::to_string(bits) + "-bit numbers of sample format " +
               std::to_string(format),
           "save it with 8 or 16 bits per channel, or as 32-bit floats");
  return static_cast<std::int64_t>((bits + 7) / 8);
}

std::string color_kind(std::uint64_t kind) {
  if (kind == kCieLab || kind == kIccLab || kind == kItuLab) return "Lab colours";
  if (kind == kMask) return "a transparency mask";
  return "colours of kind " + std::to_string(kind) + " (PhotometricInterpretation)";
}

void read_extra_samples(const std::string& path, std::uint64_t samples, int colors,
                        Contents& contents) {
  constexpr std::uint64_t kAssociated = 1, kUnassociated = 2;
  if (samples < static_cast<std::uint64_t>(colors))
    refuse(path,
           "has " + std::to_string(samples) + " samples per pixel, fewer than its colours need",
           "export it again");
  std::string unnamed;
  for (std::uint64_t i = static_cast<std::uint64_t>(colors); i < samples; ++i) {
    const auto kind = contents.page
                          .integer(tiff_tag::kExtraSamples,
                                   static_cast<std::size_t>(i) - static_cast<std::size_t>(colors))
                          .value_or(0);
    if (!contents.alpha && (kind == kAssociated || kind == kUnassociated)) {
      contents.alpha = static_cast<int>(i);
      contents.associated_alpha = kind == kAssociated;
    } else {
      unnamed += (unnamed.empty() ? "" : ", ") + std::to_string(i + 1);
    }
  }
  if (!unnamed.empty())
    contents.warnings.push_back("its sample " + unnamed +
                                " has no meaning in the file (infrared, or an alpha that is not "
                                "labelled as one); it is not read");
}

}  // namespace

void examine_tiff(const std::string& path, const FileView& view, Contents& contents) {
  const TiffFile file(view);
  const std::vector<TiffDirectory> pages = file.pages();
  if (pages.empty()) refuse(path, "is a TIFF without a page", "copy or export it again");
  const std::vector<TiffDirectory> below = file.below(pages[0], tiff_tag::kSubDirectories);
  check_raw(path, pages, below);
  check_pages(path, pages, below, contents);
  contents.page = pages[0];
  contents.icc_profile = contents.page.bytes(tiff_tag::kIccProfile);
  take_exif(file, pages[0], contents);

  const std::uint64_t kind = photometric(contents.page);
  if (kind == kPalette)
    refuse(path, "has a palette instead of colours",
           "save it as RGB with 8 or 16 bits per channel");
  contents.cmyk = kind == kSeparated;
  if (kind != kWhiteIsZero && kind != kBlackIsZero && kind != kRgb && kind != kYCbCr &&
      !contents.cmyk)
    refuse(path, "stores " + color_kind(kind), "save it as RGB");
  const auto samples = contents.page.integer(tiff_tag::kSamples).value_or(1);
  constexpr std::uint64_t kMostSamples = 64;
  if (samples > kMostSamples)
    refuse(path, "has " + std::to_string(samples) + " channels", "save R, G, B (and A) only");
  const std::int64_t bytes = check_numbers(path, contents.page, samples);
  const std::int64_t pixel = bytes * static_cast<std::int64_t>(std::max<std::uint64_t>(samples, 3));
  check_size(path, side(contents.page, tiff_tag::kWidth), side(contents.page, tiff_tag::kHeight),
             pixel);
  if (contents.page.has(tiff_tag::kTileWidth))
    check_size(path, side(contents.page, tiff_tag::kTileWidth),
               side(contents.page, tiff_tag::kTileHeight), pixel);
  const int inks = contents.cmyk ? 4 : kind == kRgb || kind == kYCbCr ? 3 : 1;
  read_extra_samples(path, samples, inks, contents);
  contents.colors = inks == 1 ? 1 : 3;
  if (contents.cmyk) contents.alpha.reset();  // OpenImageIO gives RGB alone
}

}  // namespace selenite
