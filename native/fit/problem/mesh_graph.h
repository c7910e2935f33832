// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "scene/vertex_colors.h"

namespace selenite {

/// Which values of a mesh lie next to each other: those of two vertices with an edge between them, and
/// where each corner has a value of its own, those of corners of one triangle or at one vertex.
class MeshGraph {
 public:
  /// `mesh`: that of the colours.
  MeshGraph(const VertexColors& colors, const Mesh& mesh);

  /// Pairs of numbers of values, in order.
  const std::vector<std::array<int, 2>>& edges() const { return edges_; }
  Eigen::Index size() const { return size_; }
  /// The numbers of all values, as many for each, smoothed as if each were spread over `values` of them
  /// by a Gaussian: the solution x of (1 + lambda L) x = numbers, where L is the Laplacian of the graph.
  Eigen::VectorXd smoothed(const Eigen::VectorXd& numbers, double values) const;

 private:
  Eigen::Index size_;
  std::vector<std::array<int, 2>> edges_;
};

}  // namespace selenite
