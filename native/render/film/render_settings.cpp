// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/film/render_settings.h"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "math/fault.h"
#include "render/film/setting_range.h"
#include "scene/packet.h"

namespace selenite {
namespace {

constexpr std::array kRanges{
    SettingRange{"width", "width", 1, 65536},
    SettingRange{"height", "height", 1, 65536},
    SettingRange{"pixels", "number of pixels", 1, 1 << 28},
    SettingRange{"spp", "samples per pixel", 1, 1 << 20},
    SettingRange{"depth", "depth", 0, 1'000'000},
    SettingRange{"threads", "threads", 0, 1024},
};

void require_in_range(const char* name, long long value) {
  const SettingRange& range = range_of(kRanges, name);
  const auto text = [](double limit) { return std::to_string(static_cast<long long>(limit)); };
  require_setting(range.has(static_cast<double>(value)), range.what, value,
                  ("[" + text(range.lowest) + ", " + text(range.highest) + "]").c_str());
}

}  // namespace

std::span<const SettingRange> render_ranges() { return kRanges; }

const SettingRange& range_of(std::span<const SettingRange> table, const char* name) {
  return *std::ranges::find(table, std::string_view(name),
                            [](const SettingRange& range) { return std::string_view(range.name); });
}

void require_setting(bool good, const char* what, long long value, const char* range) {
  if (!good)
    throw Refused("Render", std::string(what) + " = " + std::to_string(value) + " is not permitted",
                  std::string("set it to ") + range);
}

void RenderSettings::check() const {
  require_in_range("width", width);
  require_in_range("height", height);
  require_in_range("pixels", static_cast<long long>(width) * height);
  require_in_range("spp", spp);
  require_in_range("depth", depth);
  require_in_range("threads", threads);
  require_setting(lanes == 0 || lanes == 1 || lanes == kPacket, "lanes", lanes,
                  "0 (as many as go), 1 or 8");
  if (pixels)
    require_setting(pixels->size() == static_cast<std::size_t>(width) * height, "size of the mask",
                    static_cast<long long>(pixels->size()), "one entry a pixel");
  frame.check();
}

}  // namespace selenite
