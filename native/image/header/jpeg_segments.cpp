// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/header/jpeg_segments.h"

#include <map>
#include <string_view>

namespace selenite {
namespace {

using namespace std::string_view_literals;

constexpr int kMostSegments = 10'000;
constexpr unsigned kApp1 = 0xe1, kApp2 = 0xe2, kStartOfScan = 0xda, kEndOfImage = 0xd9;
constexpr std::string_view kExif = "Exif\0\0"sv, kProfile = "ICC_PROFILE\0"sv,
                           kMultiPicture = "MPF\0"sv, kXmp = "http://ns.adobe.com/xap/1.0/\0"sv,
                           kGainMap = "urn:iso:std:iso:ts:21496:-1\0"sv;

/// Pieces of a profile, each with its number and how many there are. Source: ICC.1:2022, annex B.4.
class ProfileParts {
 public:
  void add(const FileView& data) {
    if (data.bytes(0, kProfile.size()) != kProfile) return;
    const auto number = data.number(kProfile.size(), 1, true);
    const auto count = data.number(kProfile.size() + 1, 1, true);
    is_damaged_ |=
        !number || !count || *number < 1 || *number > *count || (count_ > 0 && *count != count_);
    if (is_damaged_) return;
    count_ = *count;
    const FileView rest = data.part(kProfile.size() + 2, data.size());
    is_damaged_ |= !parts_.try_emplace(*number, rest.bytes(0, rest.size())).second;
  }
  std::optional<std::string> joined() const {
    if (is_damaged_ || parts_.size() != count_) return std::nullopt;
    std::string all;
    for (const auto& [number, bytes] : parts_) all += bytes;
    return all;
  }

 private:
  std::map<std::uint64_t, std::string> parts_;
  std::uint64_t count_ = 0;
  bool is_damaged_ = false;
};

/// SOF0 to SOF15; three of the codes are tables.
bool is_frame(unsigned marker) {
  return marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
}

}  // namespace

JpegSegments jpeg_segments(const FileView& view) {
  JpegSegments found;
  ProfileParts profile;
  std::uint64_t at = 2;
  for (int i = 0; i < kMostSegments; ++i) {
    while (view.number(at, 1, true) == 0xff && view.number(at + 1, 1, true) == 0xff) ++at;  // fill
    const auto lead = view.number(at, 1, true), marker = view.number(at + 1, 1, true);
    const auto length = view.number(at + 2, 2, true);
    if (lead != 0xff || !length || *length < 2 || marker == kStartOfScan || marker == kEndOfImage)
      break;
    const FileView data = view.part(at + 4, *length - 2);
    if (is_frame(static_cast<unsigned>(*marker))) {
      found.height = static_cast<std::int64_t>(data.number(1, 2, true).value_or(0));
      found.width = static_cast<std::int64_t>(data.number(3, 2, true).value_or(0));
      found.components = static_cast<int>(data.number(5, 1, true).value_or(0));
      found.progressive = marker != 0xc0 && marker != 0xc1;
    }
    if (marker == kApp1) {
      if (!found.exif && data.bytes(0, kExif.size()) == kExif)
        found.exif = data.part(kExif.size(), data.size());
      else if (data.bytes(0, kXmp.size()) == kXmp)
        found.has_gain_map |= data.bytes(0, data.size()).find("hdrgm:") != std::string::npos;
    } else if (marker == kApp2) {
      found.has_more_pictures |= data.bytes(0, kMultiPicture.size()) == kMultiPicture;
      profile.add(data);
      found.has_gain_map |= data.bytes(0, kGainMap.size()) == kGainMap;
    }
    at += 2 + *length;
  }
  found.profile = profile.joined();
  return found;
}

}  // namespace selenite
