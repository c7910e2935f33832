// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "fit/problem/fields.h"

namespace selenite {

class SavedState;

/// Sources: docs/measurements/constants.md, "PhotoAgreementOptions".
struct PhotoAgreementOptions {
  int along = 128;    ///< blocks of texels along a side of an image, at most
  double kept = 0.8;  ///< share that a round keeps of earlier ones
};

/// On how much of the gradients by a field on a surface its photos agree. A residual that follows a texel through
/// several photos gives all of them the same gradient: their products are positive. One that differs from photo
/// to photo, as noise or light that is wrong, gives products that cancel.
/// Source: docs/method/fields.md, "Agreement of photos".
class PhotoAgreement {
 public:
  explicit PhotoAgreement(const Fields& fields, const PhotoAgreementOptions& options = {});
  /// The gradients by all fields of the next photo of a round.
  void add(const std::vector<std::vector<double>>& gradients);
  /// All photos of the round have been seen.
  void end_round();
  /// Share of the squared gradients that agrees, from 0 to 1; 0 where nothing is known.
  double share(std::size_t field) const;
  void members(SavedState& state);

 private:
  struct OfField {
    std::size_t channels = 0;
    std::shared_ptr<const std::vector<int>> block;  ///< of each place; null: no field on a surface
    std::vector<double> sum;      ///< of the gradients of this round, by block and channel
    std::vector<double> squares;  ///< of each photo's, by block
    std::vector<int> photos;      ///< that see the block
    double agreed = 0, all = 0;   ///< over rounds
    void members(SavedState& state);
  };
  PhotoAgreementOptions options_;
  std::vector<OfField> fields_;
};

}  // namespace selenite
