// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "fit/state/fit_result.h"
#include "fit/state/strategy.h"

namespace selenite {

/// What the paths of a render carry.
enum class Carried {
  kNothing,
  kDerivatives,       ///< of scalars
  kFieldDerivatives,  ///< of every value of the fields
};
/// "none", "scalars", "fields".
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

/// What each phase of a fit will render, from the numbers that the phases go by. What nobody knows
/// before it has run counts as most fits do it (`ExpectedCourse`): iterations until the values have
/// settled, passes of a refinement, alternatives to compare.
std::vector<PlannedRenders> schedule(const FitProblem& problem, const Strategy& strategy);

/// A photo of which only the size is known.
Photo photo_of_size(const std::string& camera, int width, int height);

}  // namespace selenite
