// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "render/film/film.h"
#include "render/driver/render.h"
#include "scene/scene.h"

namespace selenite {

/// A photo and the camera that took it, at working size.
struct Photo {
  std::string camera;
  int width = 0, height = 0;
  PhotoFrame frame;           ///< of the photo before it was brought to working size
  Picture reference;          ///< linear radiance, row 0 at the top
  std::vector<float> weight;  ///< per pixel, >= 0; 0 = background, clipped or not a number

  /// What is rendered of it; null: all.
  std::shared_ptr<const PixelMask> pixels;

  std::size_t size() const { return reference.size(); }
  /// Weight of a pixel and channel: with it a weighted sum over pixels and channels is a mean.
  double share(std::size_t pixel) const { return weight[pixel] / (3 * total_weight); }

  double total_weight = 0;  ///< sum of `weight`, set by `check_photos`
};

/// Fills empty weights with 1 and sets pixels of weight 0 to black, so that no NaN can leak.
/// Reports all problems at once: InvalidArgument (sizes, NaN or infinite photo pixels, negative or
/// all-zero weights, a camera with two photos), UnknownName (no such camera).
void check_photos(const Scene& scene, std::vector<Photo>& photos);

}  // namespace selenite
