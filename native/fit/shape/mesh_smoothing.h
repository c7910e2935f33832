// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/SparseCholesky>
#include <array>
#include <memory>
#include <vector>

namespace selenite {

/// A number for each vertex and coordinate.
using VertexMatrix = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// I + lambda L of a mesh, L its Laplacian with equal weights, and its inverse: in coordinates
/// u = (I + lambda L) x a step moves neighbours together.
///
/// Source: Nicolet, Jacobson, Jakob 2021, "Large Steps in Inverse Rendering of Geometry".
class MeshSmoothing {
 public:
  MeshSmoothing(int vertices, const std::vector<std::array<int, 3>>& triangles, double lambda);

  VertexMatrix apply(const VertexMatrix& x) const { return matrix_ * x; }
  VertexMatrix solve(const VertexMatrix& u) const { return factors_->solve(u); }

 private:
  Eigen::SparseMatrix<double> matrix_;
  std::unique_ptr<Eigen::SimplicialLLT<Eigen::SparseMatrix<double>>> factors_;
};

}  // namespace selenite
