// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <utility>
#include <vector>

#include "fit/photo/photo.h"
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

/// A photo of which only the camera is known.
inline Photo of_camera(const char* camera) { return photo_of_size(camera, 0, 0); }

inline std::vector<Photo> taken_photos(const Scene& scene, int size, int spp = 400) {
  std::vector<Photo> photos;
  for (const Camera& camera : scene.cameras) {
    Photo photo;
    photo.camera = camera.name;
    photo.width = photo.height = size;
    photo.reference = render(scene, camera, {}, square_settings(size, spp, 99)).mean;
    photos.push_back(std::move(photo));
  }
  check_photos(scene, photos);
  return photos;
}

}  // namespace selenite
