// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>

#include "fit/coordinates.h"
#include "fit/optimiser.h"

namespace selenite {

/// Which derivatives are taken as differences of two pictures with equal seeds.
///
/// Where light is mirrored sharply, the derivatives of a path tracer by roughness and IOR are
/// nearly all noise: a path that hits the lamp is seldom, and its slope is 1 / alpha. The
/// difference over a step of fixed length in the optimiser's coordinate has a fraction of that
/// noise, as the paths are the same and the step is long. It is not quite the derivative, which
/// an instrument need not be, and a step's length can do without. Source: facts sheet
/// "estimators", Q1: at roughness 0.05 the noise power of IOR is 1/2000 over 0.05.
enum class Side { kUp, kDown, kBoth };

/// Picture of the capture in question at other values, with the seed of `film`.
using PictureAt = std::function<Film(const Vector& x)>;

/// Puts the differences in place of the derivative pictures of `film`, a render at x: one more
/// picture for each of the parameters, two with `Side::kBoth`. A side that leaves the permitted
/// range gives way to the other.
void take_secants(const Problem& problem, const Coordinates& coordinates, const Vector& x,
                  Side side, const PictureAt& render, Film& film);

}  // namespace selenite
