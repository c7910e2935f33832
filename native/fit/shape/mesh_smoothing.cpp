// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/shape/mesh_smoothing.h"

#include <algorithm>

#include "math/fault.h"

namespace selenite {

MeshSmoothing::MeshSmoothing(int vertices, const std::vector<std::array<int, 3>>& triangles,
                             double lambda)
    : matrix_(vertices, vertices),
      factors_(std::make_unique<Eigen::SimplicialLLT<Eigen::SparseMatrix<double>>>()) {
  std::vector<std::pair<int, int>> edges;
  edges.reserve(3 * triangles.size());
  for (const auto& t : triangles)
    for (std::size_t k = 0; k < 3; ++k) edges.emplace_back(std::minmax({t[k], t[(k + 1) % 3]}));
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());

  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(4 * edges.size() + vertices);
  for (int v = 0; v < vertices; ++v) entries.emplace_back(v, v, 1);
  for (const auto& [a, b] : edges) {
    if (a == b) continue;
    entries.emplace_back(a, b, -lambda);
    entries.emplace_back(b, a, -lambda);
    entries.emplace_back(a, a, lambda);
    entries.emplace_back(b, b, lambda);
  }
  matrix_.setFromTriplets(entries.begin(), entries.end());
  factors_->compute(matrix_);
  if (factors_->info() != Eigen::Success)
    throw Refused("", "The mesh's smoothing matrix has no factors", "lower the smoothness");
}

}  // namespace selenite
