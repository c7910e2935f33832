// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>

#include "fit/problem/problem.h"
#include "fit/problem/reparametrization.h"
#include "render/film/film.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "FiniteDifferenceOptions". Lengths are distances of the two
/// pictures in `Reparametrization`; noise falls with the length.
struct FiniteDifferenceOptions {
  double log = 0.5;         ///< of log x (extinction), as instruments
  double log_excess = 0.4;  ///< of log(x - 1) (IOR), as instruments
  double roughness = 0.4;   ///< longer ones no longer go with the slope
  double angle = 0.05;      ///< of a rotation, radians; as instruments and gradients
  /// Of log(x - 1), as gradients: their noise multiplies that of the residuals, so it is longer.
  double gradient_log_excess = 0.7;
  /// Transmission over roughness above which the difference by an IOR is the better gradient.
  double sharp = 2;
  int first_iterations = 4;  ///< that take all differences, twice from each side
  int round = 3;             ///< iterations that share the differences from then on
};

/// What an optimiser does with derivative pictures, which decides which estimate of them is better: see
/// `render_derivatives`.
enum class Purpose {
  kInstrumental,  ///< accumulated over iterations; errors slow the way and leave its end
  kGradient,      ///< multiplied with the residuals of the same render
};

/// Where the other picture of a difference lies.
enum class Side { kUp, kDown, kBoth };

/// Which paths a picture has: those of the film, those of other random numbers, or those of the film as
/// far as the first surface and the lights that it is lit by.
enum class Paths { kOfFilm, kOther, kDirect };

/// The photo at values x, with the derivatives of `layout`.
using PictureAt = std::function<Film(const Vector& x, const SlotLayout& layout, Paths paths)>;

/// Side of the `number`-th difference by a parameter: two of them make a central one.
inline Side alternating_side(int number) { return number % 2 == 0 ? Side::kUp : Side::kDown; }

/// Of which surfaces a difference has its direct share, among those that let light through.
enum class DirectOf { kAll, kMedia };

/// Which differences of a picture are taken, and from which side.
struct Differences {
  Side side = Side::kBoth;
  Side of_roughness = side;  ///< pictures change unevenly with a low one
  int first = 0, every = 1;  ///< the first one of them, and the distance to the next
  bool roughnesses = true;   ///< whether those by roughness are among them
  bool refractions = true;   ///< whether those by the IOR of what refracts sharply are
  bool picture = true;       ///< else the picture itself may stay black, and its noise is another's
  DirectOf direct = DirectOf::kAll;

  bool taken(int index) const { return index % every == first; }
  Side side_of(const Parameter& parameter) const {
    return parameter.scale == Scale::kRoughness ? of_roughness : side;
  }
};

/// Those of the `number`-th portion of a refinement pass. With its many samples the direct share pays where
/// there is a medium: docs/measurements/derivatives.md, "Direct share".
inline Differences differences_of_refinement(int number) {
  return {
      .side = alternating_side(number), .of_roughness = Side::kBoth, .direct = DirectOf::kMedia};
}
/// Those of a refinement of fields beside scalars: the picture has been rendered by itself.
inline Differences differences_of_field_refinement(bool roughnesses) {
  return {.side = Side::kBoth,
          .of_roughness = Side::kBoth,
          .roughnesses = roughnesses,
          .picture = false,
          .direct = DirectOf::kMedia};
}

/// Those of an iteration. Instruments accumulate over iterations: once there are some, a part of the
/// differences is enough. The residuals, which move the values, are new in each.
Differences differences_of(Purpose purpose, int iteration,
                           const FiniteDifferenceOptions& options = {});

/// Whether that is the IOR of facets that refract one direction into another. They turn with it, and
/// their density changes over a width like the roughness, so the derivative has the noise of the
/// refracted light divided by it. Facets that mirror stay where they are.
bool is_sharp_refraction(const Scene& scene, const ParameterRef& ref,
                         const FiniteDifferenceOptions& options = {});

/// The picture of `scene`, which is that of a photo at x, with a derivative picture for every slot of
/// the problem: 0 for what the photo does not show, empty for its own parameters.
///
/// Paths carry the derivatives along. Where a difference of two pictures with equal seeds is the better
/// estimate, it stands in their place: instruments take roughness, IOR and extinction so, gradients the
/// IOR of what refracts sharply. Each costs one more picture, two with `Side::kBoth`. A side that leaves
/// the permitted range gives way to the other. Slots of differences that are not taken are empty.
/// Without `reparametrization` there are no differences.
///
/// Where light is mirrored or refracted sharply, derivatives of a path tracer by roughness and IOR are
/// nearly all noise: few paths hit the lamp, and their slope is 1 / alpha. The difference over a step of
/// fixed length in `Reparametrization` has a fraction of that noise, as the paths are the same. It is not
/// the derivative, which an instrument need not be; a gradient that is made of it vanishes where the
/// residuals do. Source: docs/method/derivatives.md, "Finite differences with common random numbers";
/// measured: docs/measurements/derivatives.md, "Estimators".
///
/// A derivative that a difference replaces is not carried: it would take time, and keep paths alive that
/// bring nothing else. A path chooses lobes and lengths by what it carries, so the pictures of a
/// difference carry the same: else equal seeds are not equal paths. A gradient multiplies the difference
/// with the residuals of the film. Its two pictures have random numbers of their own, so that the product
/// has no bias of noise.
///
/// The slot of a difference has `mean`, `half_a` and `covariance`; its `variance` is 0. Of an instrument
/// by roughness or IOR of what lets light through it also has the direct share: highlights change with
/// little noise, and the rest of the paths would bury them. That takes one more picture of short paths,
/// and one or two for each of these parameters.
Film render_derivatives(const Problem& problem, const Reparametrization* reparametrization,
                        const Scene& scene, const Photo& photo, const Vector& x, Purpose purpose,
                        Differences which, const PictureAt& render,
                        const FiniteDifferenceOptions& options = {});

}  // namespace selenite
