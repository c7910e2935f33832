// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "fit/photo/photo.h"
#include "fit/problem/loss.h"
#include "fit/problem/unknowns.h"
#include "render/film/slots.h"

namespace selenite {

/// Up to so many scalars the derivative images of all are kept and the clamps can be searched.
inline constexpr int kFewUnknowns = 12;

class PhotoWeights;

/// What a fit is about; constant while it runs, but for what is learned of its weights.
struct Problem {
  const Unknowns& unknowns;
  const SlotLayout& layout;  ///< slots and rows of all unknowns
  const std::vector<Photo>& photos;
  const Loss& loss;
  int iterations;
  /// Of the residuals, shared by all that compares renders with these photos. Null: a solver has its
  /// own.
  std::shared_ptr<PhotoWeights> weights = nullptr;
  bool goes_on = false;  ///< beyond the iterations, see FitSettings::most_iterations
  int threads = 1;       ///< of a solver; 0: one per core
};

}  // namespace selenite
