// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/header/exr_header.h"

#include <algorithm>
#include <bit>

namespace selenite {
namespace {

constexpr std::size_t kMostParts = 256;
constexpr int kMostAttributes = 10'000;
constexpr std::uint64_t kLongestName = 256;
constexpr std::uint64_t kLongestValue = 1u << 20;
constexpr std::uint64_t kMultiPart = 0x1000;

std::int64_t signed_int(const char* bytes) {
  return static_cast<std::int32_t>(whole_number(bytes, 4, false));
}

double real(const char* bytes) {
  return std::bit_cast<float>(static_cast<std::uint32_t>(whole_number(bytes, 4, false)));
}

/// Text up to its NUL, which is passed too; nothing if there is none.
std::optional<std::string> text_at(const FileView& view, std::uint64_t& at) {
  const std::string found = view.bytes(at, kLongestName);
  const std::size_t end = found.find('\0');
  if (end == std::string::npos) return std::nullopt;
  at += end + 1;
  return found.substr(0, end);
}

ExrWindow window(const std::string& data) {
  return {signed_int(data.data()), signed_int(data.data() + 4), signed_int(data.data() + 8),
          signed_int(data.data() + 12)};
}

void read_channels(const std::string& data, ExrPart& part) {
  constexpr std::size_t kAfterName = 16;  // type, linearity and padding, two samplings
  for (std::size_t at = 0; at < data.size() && data[at] != '\0';) {
    const std::size_t end = data.find('\0', at);
    if (end == std::string::npos || end + 1 + kAfterName > data.size()) return;
    const char* rest = data.data() + end + 1;
    part.channels.push_back({data.substr(at, end - at), static_cast<int>(signed_int(rest)),
                             static_cast<int>(signed_int(rest + 8)),
                             static_cast<int>(signed_int(rest + 12))});
    at = end + 1 + kAfterName;
  }
}

void read_attribute(const std::string& name, const std::string& data, ExrPart& part) {
  if (name == "channels") {
    read_channels(data, part);
  } else if (name == "dataWindow" && data.size() >= 16) {
    part.data = window(data);
  } else if (name == "displayWindow" && data.size() >= 16) {
    part.display = window(data);
  } else if (name == "chromaticities" && data.size() >= 32) {
    part.chromaticities.emplace();
    for (std::size_t i = 0; i < 8; ++i) (*part.chromaticities)[i] = real(data.data() + 4 * i);
  } else if (name == "adoptedNeutral" && data.size() >= 8) {
    part.adopted_neutral = {real(data.data()), real(data.data() + 4)};
  } else if (name == "pixelAspectRatio" && data.size() >= 4) {
    part.pixel_aspect = real(data.data());
  } else if (name == "name") {
    part.name = data;
  } else if (name == "type") {
    part.type = data;
  } else if (name == "tiles" && data.size() >= 8) {
    part.tile_width = static_cast<std::int64_t>(whole_number(data.data(), 4, false));
    part.tile_height = static_cast<std::int64_t>(whole_number(data.data() + 4, 4, false));
  }
}

}  // namespace

bool ExrPart::has(const std::string& channel) const {
  return std::any_of(channels.begin(), channels.end(),
                     [&](const ExrChannel& item) { return item.name == channel; });
}

std::vector<ExrPart> exr_parts(const FileView& view) {
  const auto version = view.number(4, 4, false);
  if (!version) return {};
  const bool has_several = (*version & kMultiPart) != 0;
  std::vector<ExrPart> parts;
  std::uint64_t at = 8;
  while (parts.size() < kMostParts) {
    ExrPart part;
    for (int i = 0;; ++i) {
      const auto name = text_at(view, at);
      if (!name || i > kMostAttributes) return {};
      if (name->empty()) {
        if (i == 0) return parts;  // an empty header ends the list of parts
        break;
      }
      const auto type = text_at(view, at);
      const auto size = view.number(at, 4, false);
      if (!type || !size || *size > view.size()) return {};
      read_attribute(*name, view.bytes(at + 4, std::min(*size, kLongestValue)), part);
      at += 4 + *size;
    }
    parts.push_back(std::move(part));
    if (!has_several) return parts;
  }
  return parts;
}

}  // namespace selenite
