// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <utility>
#include <vector>

#include "fit/problem/photo.h"
#include "render/driver/render.h"

// Photos of a real scene by all of its cameras, for fits of fields.
namespace selenite {

/// Square pictures, one thread.
inline RenderSettings square_settings(int size, int spp, std::uint64_t seed) {
  RenderSettings settings;
  settings.width = settings.height = size;
  settings.spp = spp;
  settings.seed = seed;
  settings.threads = 1;
  return settings;
}

inline std::vector<Capture> taken_photos(const Scene& scene, int size, int spp = 400) {
  std::vector<Capture> captures;
  for (const Camera& camera : scene.cameras) {
    Capture capture;
    capture.camera = camera.name;
    capture.width = capture.height = size;
    capture.reference = render(scene, camera, {}, square_settings(size, spp, 99)).mean;
    captures.push_back(std::move(capture));
  }
  check_captures(scene, captures);
  return captures;
}

}  // namespace selenite
