// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>

#include "image/container.h"
#include "image/file_error.h"
#include "image/limits.h"

namespace selenite {
namespace {

bool has_rgb(const ExrPart& part) { return part.has("R") && part.has("G") && part.has("B"); }

/// The one channel of a grey picture; empty if there are several.
std::string grey_channel(const ExrPart& part) {
  if (part.has("Y")) return "Y";
  if (part.has("I")) return "I";
  std::string found;
  for (const ExrChannel& channel : part.channels) {
    if (channel.name == "A" && part.channels.size() > 1) continue;
    if (!found.empty()) return {};
    found = channel.name;
  }
  return found;
}

bool is_luminance_chroma(const ExrPart& part) { return part.has("RY") || part.has("BY"); }

std::string names_of(const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 6;
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), kMost); ++i)
    text += (i ? ", " : "") + names[i];
  return text + (names.size() > kMost ? ", ..." : "");
}

/// OpenEXR asks for memory for every part of a file, read or not.
void check_windows(const std::string& path, const ExrPart& part) {
  constexpr std::int64_t kBytes = 3 * sizeof(float);
  check_size(path, part.data.width(), part.data.height(), kBytes);
  check_size(path, part.display.width(), part.display.height(), kBytes);
  if (part.tile_width > 0 || part.tile_height > 0)
    check_size(path, part.tile_width, part.tile_height, kBytes);
  if (part.type.starts_with("deep")) refuse(path, "is a deep picture", "save it flat");
  constexpr std::size_t kMostChannels = 1024;
  if (part.channels.size() > kMostChannels)
    refuse(path, "has " + std::to_string(part.channels.size()) + " channels",
           "save R, G, B (and A) only");
}

std::size_t choose_part(const std::string& path, const std::vector<ExrPart>& parts) {
  std::vector<std::size_t> found;
  const auto collect = [&](const auto& test) {
    for (std::size_t i = 0; i < parts.size() && found.size() < parts.size(); ++i)
      if (test(parts[i])) found.push_back(i);
  };
  collect(has_rgb);
  if (found.empty() && std::any_of(parts.begin(), parts.end(), is_luminance_chroma))
    refuse(path, "stores luminance and chroma (Y, RY, BY)", "save it as RGB");
  if (found.empty()) collect([](const ExrPart& part) { return !grey_channel(part).empty(); });
  std::vector<std::string> names;
  if (found.empty()) {
    for (const ExrPart& part : parts)
      for (const ExrChannel& channel : part.channels) names.push_back(channel.name);
    refuse(path, "has no channels R, G, B or one grey channel but: " + names_of(names),
           "save it as plain RGB or RGBA (not multilayer)");
  }
  if (found.size() > 1) {
    for (const std::size_t i : found) names.push_back("'" + parts[i].name + "'");
    refuse(path, "holds " + std::to_string(found.size()) + " pictures (" + names_of(names) + ")",
           "save the photo alone");
  }
  return found[0];
}

void check_channels(const std::string& path, const ExrPart& part, Contents& contents) {
  const std::array<std::string, 3> rgb{"R", "G", "B"};
  const std::string grey = has_rgb(part) ? "" : grey_channel(part);
  std::vector<std::string> unread;
  for (const ExrChannel& channel : part.channels) {
    const bool is_color = grey.empty()
                              ? std::find(rgb.begin(), rgb.end(), channel.name) != rgb.end()
                              : channel.name == grey;
    const bool is_read = is_color || channel.name == "A";
    if (!is_read) unread.push_back(channel.name);
    if (is_read && (channel.x_sampling != 1 || channel.y_sampling != 1))
      refuse(path, "stores channel " + channel.name + " with fewer pixels than the picture has",
             "save it as plain RGB");
    constexpr int kWholeNumbers = 0;
    if (is_color && channel.type == kWholeNumbers)
      refuse(path, "stores whole numbers", "save it as half or float");
  }
  if (!unread.empty())
    contents.warnings.push_back("its further channels are not read: " + names_of(unread));
}

}  // namespace

void examine_exr(const std::string& path, const FileView& view, Contents& contents) {
  const std::vector<ExrPart> parts = exr_parts(view);
  if (parts.empty()) refuse(path, "has a damaged OpenEXR header", "copy or export it again");
  for (const ExrPart& part : parts) check_windows(path, part);
  const std::size_t chosen = choose_part(path, parts);
  const ExrPart& part = parts[chosen];
  contents.exr = part;
  contents.part = static_cast<int>(chosen);
  contents.associated_alpha = true;
  check_channels(path, part, contents);
  if (parts.size() > 1)
    contents.warnings.push_back("it holds " + std::to_string(parts.size()) + " parts; '" +
                                part.name + "' is read");
  if (!(part.pixel_aspect > 0.999 && part.pixel_aspect < 1.001))
    contents.warnings.push_back("its pixels are " + std::to_string(part.pixel_aspect) +
                                " times as wide as high; they are taken for those of the camera");
  const ExrWindow &data = part.data, &frame = part.display;
  if (data.x1 < frame.x0 || data.x0 > frame.x1 || data.y1 < frame.y0 || data.y0 > frame.y1)
    refuse(path, "stores no pixel of its frame of " + size_text(frame.width(), frame.height()),
           "save the whole frame");
  if (data.x0 > frame.x0 || data.y0 > frame.y0 || data.x1 < frame.x1 || data.y1 < frame.y1)
    contents.warnings.push_back(
        "it stores " + size_text(data.width(), data.height()) + " pixels of a frame of " +
        size_text(frame.width(), frame.height()) + "; the rest is left out");
}

}  // namespace selenite
