// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>

namespace selenite {

/// Shared between a render and whoever watches it; any thread may read or set.
struct Progress {
  std::atomic<bool> cancelled{false};
  std::atomic<float> fraction{0};
};

}  // namespace selenite
