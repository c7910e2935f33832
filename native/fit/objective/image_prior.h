// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "fit/problem/unknowns.h"
#include "scene/texture.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "ImagePriorOptions".
struct ImagePriorOptions {
  double deviation =
      0.2;  ///< standard deviation of what a pixel shows, relative to the image's mean
};

/// The residuals behind a gradient.
struct PriorScale {
  double loss = 0;   ///< a mean square, or the sum of those whose gradients were added; 0: no prior
  double count = 3;  ///< of residuals in all photos, three a pixel
};

/// Adds what is known of an image before any photo to the gradient of a mean square: its texels are
/// those of `start` times one colour, and deviate independently. The prior is as strong beside the
/// photos as their residuals are large (a posterior whose noise is the misfit): light and geometry
/// that are wrong leave residuals that differ from photo to photo, and texels would take them up.
/// `channels`: numbers a texel. `moving`: 1 for numbers that a photo has shown, 0 for those that stay. A texel smaller than a pixel
/// shares the deviation of the pixel's. Source: docs/method/fields.md, "Prior of an image".
void add_image_prior(const Texture& image, const Vector& start, const Vector& values,
                     const Vector& moving, const PriorScale& scale, std::vector<double>& gradient,
                     int channels = 3, const ImagePriorOptions& options = {});

}  // namespace selenite
