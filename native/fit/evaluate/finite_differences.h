// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>

#include "fit/problem/reparametrization.h"
#include "fit/problem/problem.h"
#include "render/film/film.h"

namespace selenite {

/// What an optimiser uses derivative pictures for, on which it depends which estimate of them pays:
/// see `render_derivatives`.
enum class Purpose {
  kInstrumental,  ///< gathered over iterations; any error slows the way and leaves the answer as it is
  kGradient,    ///< multiplied with the residuals of the same render
};

/// Where the other picture of a difference lies.
enum class Side { kUp, kDown, kBoth };

/// Distance of the two pictures in the coordinate of a roughness.
inline constexpr double kRoughnessDifference = 0.4;

/// Whose random numbers a picture has.
enum class Paths { kOfFilm, kOther };

/// The photo in question at values x, with the derivatives of `layout`.
using PictureAt = std::function<Film(const Vector& x, const SlotLayout& layout, Paths paths)>;

/// Of the `number`-th difference by a parameter: from above and from below in turns, so that two of
/// them make a central one.
inline Side alternating_side(int number) { return number % 2 == 0 ? Side::kUp : Side::kDown; }

/// Which differences of a picture are taken, and from which side.
struct Differences {
  Side side = Side::kBoth;
  Side of_roughness = side;  ///< pictures change unevenly with a low one
  int first = 0, every = 1;  ///< the first one of them, and how many on the next
  bool roughnesses = true;         ///< whether those by roughness are among them
  bool refractions = true;   ///< whether those by the IOR of what refracts sharply are
  bool picture = true;  ///< else the picture itself may be left black, and its noise is another's

  bool taken(int index) const { return index % every == first; }
  Side side_of(const Parameter& parameter) const {
    return parameter.scale == Scale::kRoughness ? of_roughness : side;
  }
};

/// Of an iteration. Instruments are gathered over iterations: once there are some, a part of them will
/// do; the residuals, which move the values, are new in each.
Differences differences_of(Purpose purpose, int iteration);

/// Whether that is the IOR of facets that refract one direction into another: they turn with it, and
/// their density changes over a width like the roughness, so that the derivative's noise is that of the
/// refracted light divided by it. Facets that mirror stay where they are.
bool is_sharp_refraction(const Scene& scene, const ParameterRef& ref);

/// The picture of `scene`, which is that at x, with a derivative picture for every slot of the problem:
/// those that the paths carry along, and in place of those for which that is the better estimate
/// differences of two pictures with equal seeds: one more picture for each of these parameters, two
/// with `Side::kBoth`. A side that leaves the permitted range gives way to the other. The slots of
/// those that are not taken this time are empty. Without `reparametrization` there are no differences.
///
/// Instruments take roughness, IOR and extinction so, gradients the IOR of what refracts sharply.
///
/// Where light is mirrored or refracted sharply, the derivatives of a path tracer by roughness and
/// IOR are nearly all noise: a path that hits the lamp is seldom, and its slope is 1 / alpha. The
/// difference over a step of fixed length in the optimiser's coordinate has a fraction of that
/// noise, as the paths are the same and the step is long. It is not quite the derivative, which an
/// instrument need not be; a gradient that is made of it vanishes where the residuals do.
/// Source: docs/method/derivatives.md, "Finite differences with common random numbers"; measured:
/// `./dev bench estimators` (docs/measurements/derivatives.md, "Estimators").
///
/// What is replaced is not carried: it would cost time, and paths that bring nothing else are kept
/// alive for it. A path chooses lobes and lengths by what it carries, so what a picture is held
/// against carries the same: else equal seeds are not equal paths. A gradient multiplies the
/// difference with the residuals of the film: two pictures have random numbers of their own then, so
/// that the product has no bias of noise, and none that has to be estimated.
///
/// Of a difference a slot has `mean`, `half_a` and `covariance`; its `variance` is 0.
Film render_derivatives(const Problem& problem, const Reparametrization* reparametrization, const Scene& scene,
                        const Vector& x, Purpose purpose, Differences which,
                        const PictureAt& render);

}  // namespace selenite
