// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/photo/photo.h"
#include "render/film/film.h"

namespace selenite {

/// Source: docs/measurements/constants.md, "ResidualOptions".
struct ResidualOptions {
  double sigmas = 2;         ///< standard errors below which a residual may be noise of the render
  double shared_sigmas = 3;  ///< the same of what neighbours share
};
inline constexpr ResidualOptions kResidual;

/// Root mean square of what a render differs by from its photo, without the render's noise; 0 where
/// that may be all of it: a few pixels of a highlight leave as much as a misfit of the whole picture.
double residual_rms(const Film& film, const Photo& photo);

/// What a render does not explain of a photo, as a share of the photo's brightness: the root of what
/// neighbouring pixels share of the residual, where each pixel counts as the photo says. The tails of the
/// weights by which a fit compares hide what is very wrong in places. 0 where noise may be all of it.
double unexplained_share(const Film& film, const Photo& photo);

}  // namespace selenite
