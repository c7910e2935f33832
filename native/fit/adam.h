// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/optimiser.h"

namespace selenite {

/// Adam with a learning rate per unknown and projection on the bounds.
/// Source: Kingma and Ba 2015, algorithm 1.
class Adam final : public Optimiser {
 public:
  explicit Adam(const Problem& problem);
  Vector step(const Vector& x, std::span<const Observation> seen) override;
  std::unique_ptr<Optimiser> clone() const override { return std::make_unique<Adam>(*this); }

  /// One update with a known gradient.
  Vector update(const Vector& x, const Vector& gradient);

 private:
  const Problem* problem_;
  Vector first_, second_;  ///< running moments of the gradient
  int steps_ = 0;
};

}  // namespace selenite
