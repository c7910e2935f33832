// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/header/exr_header.h"

#include <algorithm>
#include <array>
#include <bit>
#include <string_view>

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

constexpr std::size_t kAfterName = 16;  // of a channel: type, linearity and padding, two samplings

/// Types whose values all take as many bytes. Source: openexr.com, "OpenEXR File Layout", "Predefined
/// Attribute Types".
struct FixedType {
  std::string_view name;
  std::uint64_t size;
};
constexpr std::array kFixedTypes{
    FixedType{"box2i", 16}, FixedType{"box2f", 16},      FixedType{"chromaticities", 32},
    FixedType{"double", 8}, FixedType{"compression", 1}, FixedType{"deepImageState", 1},
    FixedType{"envmap", 1}, FixedType{"float", 4},       FixedType{"int", 4},
    FixedType{"m33f", 36},  FixedType{"keycode", 28},    FixedType{"lineOrder", 1},
    FixedType{"m33d", 72},  FixedType{"m44f", 64},       FixedType{"m44d", 128},
    FixedType{"v2i", 8},    FixedType{"rational", 8},    FixedType{"tiledesc", 9},
    FixedType{"v2f", 8},    FixedType{"timecode", 8},    FixedType{"v2d", 16},
    FixedType{"v3i", 12},   FixedType{"v3f", 12},        FixedType{"v3d", 24},
};

/// Whether a channel list ends where its value does.
bool is_whole_list(const std::string& data) {
  std::size_t at = 0;
  while (at < data.size() && data[at] != '\0') {
    const std::size_t end = data.find('\0', at);
    if (end == std::string::npos) return false;
    at = end + 1 + kAfterName;
  }
  return at + 1 == data.size();
}

/// Whether a value takes the bytes that its type does. OpenEXR reads as many as the type says, whatever
/// stands in front of them: all that follows would be another header than the one that is checked here,
/// and ask for any memory.
bool has_its_size(const std::string& type, const FileView& value) {
  if (type == "chlist") return is_whole_list(value.bytes(0, kLongestValue));
  if (type == "preview") {
    const auto width = value.number(0, 4, false), height = value.number(4, 4, false);
    return width && height && (value.size() - 8) / 4 == *width * *height;
  }
  const auto fixed = std::ranges::find(kFixedTypes, std::string_view(type), &FixedType::name);
  return fixed == kFixedTypes.end() || fixed->size == value.size();
}

void read_channels(const std::string& data, ExrPart& part) {
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
      const FileView value = view.part(at + 4, *size);
      if (!has_its_size(*type, value)) return {};
      read_attribute(*name, value.bytes(0, kLongestValue), part);
      at += 4 + *size;
    }
    parts.push_back(std::move(part));
    if (!has_several) return parts;
  }
  return parts;
}

}  // namespace selenite
