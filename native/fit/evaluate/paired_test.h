// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>

#include "fit/problem/photo.h"
#include "render/film/film.h"

namespace selenite {

/// A picture in two parts with seeds of their own.
using FilmPair = std::array<Film, 2>;

/// Both parts as one film, a half each.
Film merged(const FilmPair& parts);

/// How much nearer to the photos one picture is than another, rendered with equal seeds.
///
/// Squares drown where a part of the light comes by rare bright paths, and tiles that differ count as
/// noise of their own. So: on which side of the picture half-way between the two does the photo lie?
/// The way from one to the other, made of one half of the samples and filtered like an instrument,
/// times what the middle of the other half is above the photo, pixel by pixel.
struct PairedMidpointTest {
  double sum = 0, variance = 0;

  /// Adds what a photo says. weights: of the residuals, 3 numbers a pixel.
  void add(const Photo& photo, const Eigen::VectorXf& weights, const FilmPair& one,
           const FilmPair& other);
  /// Whether `one` is nearer by so many standard deviations.
  bool significant(double sigmas) const;
  /// By how many the other is: 0 where the pictures are the same.
  double z_score() const;
};

}  // namespace selenite
