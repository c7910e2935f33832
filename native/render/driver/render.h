// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "render/film/film.h"
#include "render/film/slots.h"
#include "scene/scene.h"

namespace selenite {

/// Nonzero for those that are in it.
using PixelMask = std::vector<std::uint8_t>;

struct RenderSettings {
  int width = 256, height = 256;
  int spp = 4;
  std::uint64_t seed = 0;
  int depth = 0;    ///< largest number of bounces; 0 = no limit (Russian roulette ends the paths)
  int threads = 0;  ///< 0 = one per core
  PhotoFrame frame;
  /// Paths that a thread traces in lockstep: 1, 8, or 0 for eight where processor and scene permit.
  /// The picture is the same but for rounding.
  int lanes = 0;
  /// Null: all. The others stay black, and those that are rendered are the same as without.
  std::shared_ptr<const PixelMask> pixels{};
  bool has(std::size_t pixel) const { return !pixels || (*pixels)[pixel] != 0; }
  /// Throws InvalidArgument.
  void check() const;
};

/// Shared between a render and whoever watches it; any thread may read or set.
struct Progress {
  std::atomic<bool> cancelled{false};
  std::atomic<float> fraction{0};
};

/// Image, variance and, for the parameters of `layout`, the per-pixel Jacobian in the same pass.
///
/// Unbiased; detached sampling (directions are drawn at the scene's values and carry no derivative;
/// f and df are both divided by the same density). The result depends on scene, camera, layout and
/// settings, not on `threads`. Different seeds give independent pictures.
/// Throws Cancelled (polled per tile), InvalidArgument.
Film render(const Scene& scene, const Camera& camera, const SlotLayout& layout,
            const RenderSettings& settings, Progress* progress = nullptr);

}  // namespace selenite
