// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "fit/evaluate/photo_evaluator.h"
#include "fit/state/fit_result.h"
#include "fit/state/strategy.h"

namespace selenite {

/// What the paths of a render carry.
enum class Carried {
  kNothing,
  kDerivatives,       ///< of scalars
  kFieldDerivatives,  ///< of every value of the fields
  kShapeDerivatives,  ///< of vertices: a picture, its paths' derivatives, and those of edges
};
/// "none", "scalars", "fields", "shape".
const char* carried_text(Carried carried);

/// Equal renders of all photos.
struct PlannedRenders {
  PhaseKind phase;
  double pixels;  ///< of all photos at the size in question
  int spp;
  double renders;  ///< how many, on average where it depends on what a fit finds
  Carried carried;

  double samples() const { return pixels * spp * renders; }
};

/// What only a fit that has run could tell, as most do.
struct ExpectedCourse {
  /// Iterations after which the values of most fits that are refined have settled.
  /// Measured: docs/measurements/trade.md.
  int converged_after = 15;
  double informative_pixels = 0.5;  ///< share of the pixels that tell something
  /// Share of the candidates of a multi-start that stay apart where parameters are fewer than so many:
  /// the others end in the same basin. Measured: 6 sets of them on three scenes, 0.6 to 0.9.
  double distinct = 0.75;
  int few_parameters = 4;
  /// Candidates that a multi-start ends with, the untouched start among them; and those of them that it
  /// leaves for a comparison with the answer.
  double last_candidates = 4, alternatives = 2;
  double line_search_renders = 4;  ///< by which each IOR is found
  /// Candidates of a comparison before a block of scalars where a roughness is unknown: one where it is
  /// low already, else two.
  double restart_candidates = 1.5;
  double passes = 3;                ///< of a refinement
  double profiled_roughnesses = 5;  ///< of each roughness beside an unknown light
};
inline constexpr ExpectedCourse kExpected;

/// Pixels that a fit renders of photos.
double pixels_of(const std::vector<Photo>& photos);

/// What a fit will render: each phase adds its own, from the numbers that it goes by. What nobody knows
/// before it has run counts as most fits do it (`ExpectedCourse`).
class RenderPlan {
 public:
  /// How many renders a picture with derivatives takes.
  struct Renders {
    int plain = 0, carrying = 0;
  };

  RenderPlan(const FitProblem& of, const Strategy& by)
      : problem(of), strategy(by), pixels(pixels_of(of.photos())) {}

  const FitProblem& problem;
  const Strategy& strategy;
  const double pixels;  ///< of all photos

  /// Equal ones are counted together.
  void add(PhaseKind phase, double of_pixels, int spp, double renders, Carried carried);
  void add(PhaseKind phase, double of_pixels, int spp, double times, const Renders& renders);
  void validate(PhaseKind phase, double times);
  Renders renders_of(Purpose purpose, const Differences& which) const;
  static Renders renders_of(const SceneModel& model, const Point& point, Purpose purpose,
                            const Differences& which);
  /// Unknown parameters with a coordinate of that kind.
  int count_of(Scale scale) const;
  const std::vector<PlannedRenders>& renders() const { return renders_; }

 private:
  std::vector<PlannedRenders> renders_;
};

}  // namespace selenite
