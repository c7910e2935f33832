// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>

#include "fit/coordinates.h"
#include "fit/optimiser.h"

namespace selenite {

/// Where the other picture of a difference lies.
enum class Side { kUp, kDown, kBoth };

/// Distance of the two pictures in the coordinate of a roughness.
inline constexpr double kBlurSecant = 0.4;

/// Picture of the capture in question at other values, with the seed of `film`. A path chooses lobes and
/// lengths otherwise where it carries derivatives: what is to be held against `film` has to carry the
/// same ones (`like_film`), or equal seeds are not equal paths.
using PictureAt = std::function<Film(const Vector& x, bool like_film)>;

/// Side of the differences that an iteration takes.
Side side_of(Purpose purpose, int iteration);

/// Puts differences of two pictures with equal seeds in place of those derivative pictures of
/// `film`, a render of `scene`, which is that at x, for which that is the better estimate: one more
/// picture for each of those parameters, two with `Side::kBoth`. A side that leaves the permitted
/// range gives way to the other.
///
/// Instruments take roughness, IOR and extinction so, gradients the IOR of what refracts sharply.
///
/// Where light is mirrored or refracted sharply, the derivatives of a path tracer by roughness and
/// IOR are nearly all noise: a path that hits the lamp is seldom, and its slope is 1 / alpha. The
/// difference over a step of fixed length in the optimiser's coordinate has a fraction of that
/// noise, as the paths are the same and the step is long. It is not quite the derivative, which an
/// instrument need not be; a gradient that is made of it vanishes where the residuals do.
/// Sources: facts sheet "estimators", Q1, and `./dev bench estimators` (docs/manual/derivatives.md).
///
/// A slot gets `mean`, `half_a` and `covariance`; its `variance` stays that of the derivative.
void take_secants(const Problem& problem, const Coordinates& coordinates, const Scene& scene,
                  const Vector& x, Purpose purpose, Side side, const PictureAt& render, Film& film);

}  // namespace selenite
