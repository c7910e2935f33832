// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>

#include "fit/photo/photo.h"
#include "render/film/film.h"

namespace selenite {

/// A picture in two parts, each with a seed of its own.
using FilmPair = std::array<Film, 2>;

/// Both parts as one film, a half each.
Film merged(const FilmPair& parts);

/// How much nearer to the photos one picture is than another, rendered with equal seeds.
///
/// Where a part of the light comes by rare bright paths, squares are mostly noise, and tiles that differ
/// count as noise of their own. So the test asks on which side of the midpoint of both pictures the photo
/// lies. It multiplies, pixel by pixel, the difference of the two by the midpoint minus the photo. The
/// first is made of one half of the samples and filtered like an instrument, the second of the other.
struct PairedMidpointTest {
  double sum = 0, variance = 0;

  /// Adds a photo. weights: of the residuals, 3 numbers a pixel.
  void add(const Photo& photo, const Eigen::VectorXf& weights, const FilmPair& one,
           const FilmPair& other);
  /// Whether `one` is nearer by so many standard deviations.
  bool significant(double sigmas) const;
  /// By how many `other` is nearer: 0 where the pictures are the same.
  double z_score() const;
};

}  // namespace selenite
