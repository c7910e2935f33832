// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/SparseCholesky>
#include <array>
#include <memory>
#include <vector>

namespace selenite {

/// A number for each vertex and coordinate.
using VertexMatrix = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// The inverse of I + lambda L of a mesh, L its Laplacian with equal weights: neighbours that it is
/// applied to move together.
///
/// Source: Nicolet, Jacobson, Jakob 2021, "Large Steps in Inverse Rendering of Geometry".
class MeshSmoothing {
 public:
  MeshSmoothing(int vertices, const std::vector<std::array<int, 3>>& triangles, double lambda);

  VertexMatrix solve(const VertexMatrix& u) const { return factors_->solve(u); }

 private:
  std::unique_ptr<Eigen::SimplicialLLT<Eigen::SparseMatrix<double>>> factors_;
};

}  // namespace selenite
