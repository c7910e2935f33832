// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "fit/objective/image_prior.h"
#include "fit/objective/mesh_prior.h"
#include "fit/problem/fields.h"
#include "fit/solver/adam.h"

namespace selenite {

/// A step of a field.
struct FieldStep {
  double rate = 1;  ///< in learning rates
  /// Share of an image or mesh over which its gradient is smoothed: the area of a Gaussian, 4 pi sigma^2.
  /// Neighbours are alike more often than not, and one photo shows little but noise of few texels.
  double spread = 0;
  PriorScale prior{};  ///< behind the gradient: by it the prior of an image or mesh counts
};

/// Adam over all fields; a copy is its whole state.
class FieldAdam {
 public:
  explicit FieldAdam(const Fields& fields, const AdamOptions& options = {});
  /// One step along the gradient of each field, one `how` a field. Throws std::runtime_error naming
  /// field and number when a derivative is not finite.
  void step(FieldValues& values, const std::vector<std::vector<double>>& gradients,
            const std::vector<FieldStep>& how);
  void members(SavedState& state);

 private:
  const Fields* fields_;
  std::vector<AdamMoments> moments_;
};

}  // namespace selenite
