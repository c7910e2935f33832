// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <cstdint>

#include "render/film.h"
#include "render/slots.h"
#include "scene/scene.h"

namespace selenite {

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
