// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/film/render_settings.h"

#include <string>

#include "math/error.h"
#include "scene/packet.h"

namespace selenite {

void require_setting(bool good, const char* what, long long value, const char* range) {
  if (!good)
    throw InvalidArgument(std::string("Render: ") + what + " = " + std::to_string(value) +
                          " is not permitted; set it to " + range);
}

void RenderSettings::check() const {
  require_setting(width >= 1 && width <= 65536, "width", width, "1 to 65536 pixels");
  require_setting(height >= 1 && height <= 65536, "height", height, "1 to 65536 pixels");
  require_setting(static_cast<long long>(width) * height <= 1 << 28, "number of pixels",
                  static_cast<long long>(width) * height, "at most 268435456");
  require_setting(spp >= 1 && spp <= 1 << 20, "samples per pixel", spp, "1 to 1048576");
  require_setting(depth >= 0, "depth", depth, "0 (no limit) or more");
  require_setting(lanes == 0 || lanes == 1 || lanes == kPacket, "lanes", lanes,
                  "0 (as many as go), 1 or 8");
  require_setting(threads >= 0 && threads <= 1024, "threads", threads, "0 (all) to 1024");
  if (pixels)
    require_setting(pixels->size() == static_cast<std::size_t>(width) * height, "size of the mask",
                    static_cast<long long>(pixels->size()), "one entry a pixel");
  frame.check();
}

}  // namespace selenite
