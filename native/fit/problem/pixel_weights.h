// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "fit/problem/photo.h"

namespace selenite {

// Columns hold the channels of pixels, three numbers a pixel.

/// Brightness of the photo around each pixel, without the pixel itself, kept away from 0. With it
/// weights would go up and down with the photo's noise, and weighted residuals lean to one side.
Eigen::VectorXf brightness(const Photo& photo);

/// Each number's share in the mean over all of `photos` photos.
Eigen::VectorXf shares(const Photo& photo, std::size_t photos);

/// The shares over the squared brightness: a weighted sum of squared residuals is their mean square
/// relative to the photo.
Eigen::VectorXf relative_weights(const Photo& photo, std::size_t photos);

/// Mean over squares of 2 `radius` + 1 pixels, within the picture.
Eigen::VectorXf box_blur(const Eigen::VectorXf& column, int width, int height, int radius);

}  // namespace selenite
