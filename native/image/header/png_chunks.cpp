// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/header/png_chunks.h"

namespace selenite {
namespace {

constexpr int kMostChunks = 10'000;
constexpr std::uint64_t kSignature = 8, kChunkFrame = 12;     // length, name and checksum
constexpr int kPaletteBit = 1, kColorBit = 2, kAlphaBit = 4;  // of the colour type
constexpr double kUnit = 100'000;                             // of gAMA and cHRM

}  // namespace

PngChunks png_chunks(const FileView& view) {
  PngChunks found;
  std::uint64_t at = kSignature;
  for (int i = 0; i < kMostChunks; ++i) {
    const auto length = view.number(at, 4, true);
    const std::string name = view.bytes(at + 4, 4);
    if (!length || name.size() < 4 || name == "IDAT" || name == "IEND") break;
    const std::string data = view.bytes(at + 8, *length < 64 ? *length : 64);
    const auto fixed = [&](std::size_t index) {
      return static_cast<double>(whole_number(data.data() + 4 * index, 4, true)) / kUnit;
    };
    if (name == "IHDR" && data.size() >= 13) {
      found.width = static_cast<std::int64_t>(whole_number(data.data(), 4, true));
      found.height = static_cast<std::int64_t>(whole_number(data.data() + 4, 4, true));
      found.channels = (data[9] & kColorBit ? 3 : 1) + (data[9] & kAlphaBit ? 1 : 0);
      found.bit_depth = static_cast<unsigned char>(data[8]);
      found.palette = (data[9] & kPaletteBit) != 0;
    } else if (name == "iCCP") {
      if (!found.profile) found.profile = view.part(at + 8, *length);
    } else if (name == "sRGB") {
      found.srgb = true;
    } else if (name == "tRNS") {
      ++found.channels;
    } else if (name == "acTL") {
      found.animated = true;
    } else if (name == "gAMA" && data.size() >= 4) {
      found.gamma = fixed(0);
    } else if (name == "cHRM" && data.size() >= 32) {
      found.chromaticities.emplace();
      for (std::size_t k = 0; k < 8; ++k) (*found.chromaticities)[k] = fixed(k);
    } else if (name == "cICP" && data.size() >= 4) {
      found.code_points.emplace();
      for (std::size_t k = 0; k < 4; ++k)
        (*found.code_points)[k] = static_cast<unsigned char>(data[k]);
    } else if (name == "eXIf") {
      found.exif = view.part(at + 8, *length);
    }
    at += *length + kChunkFrame;
  }
  return found;
}

}  // namespace selenite
