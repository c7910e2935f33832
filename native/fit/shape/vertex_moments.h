// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/problem/saved_state.h"
#include "fit/problem/unknowns.h"
#include "fit/shape/mesh_smoothing.h"

namespace selenite {

/// Whose second moment a gradient is divided by: that of all vertices, by which large gradients move a body as a
/// whole, or of each vertex first, where few vertices hold most of the noise.
enum class StepScale { kShared, kOfVertices };

/// Moments of the gradient by vertices, and the direction of a step that follows from them.
///
/// Sources: Kingma and Ba 2015, "Adam"; Nicolet, Jacobson, Jakob 2021, "Large Steps in Inverse Rendering
/// of Geometry", for the shared second moment.
class VertexMoments {
 public:
  VertexMoments(Eigen::Index vertices, StepScale scale, double first_decay, double second_decay);

  /// Adds a gradient. Returns the mean of the smoothed ones in units of their usual size; empty where they are 0
  /// or not finite.
  VertexMatrix add(const VertexMatrix& gradient, const MeshSmoothing& smoothing);
  /// What led here leads nowhere.
  void forget_mean() { mean_.setZero(); }
  void reset();
  void members(SavedState& state) { state(mean_, squares_, of_vertices_, seen_); }

 private:
  /// Divides the gradient of each vertex by its usual size, but by no less than the median.
  VertexMatrix balanced(VertexMatrix gradient);

  StepScale scale_;
  double first_decay_, second_decay_;
  VertexMatrix mean_, squares_;  ///< of the smoothed gradients
  Vector of_vertices_;           ///< squares of the gradient of each vertex
  int seen_ = 0;
};

}  // namespace selenite
