// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/problem/mesh_graph.h"

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>

#include "math/scalar.h"

namespace selenite {
namespace {

/// Of the residual at which a smoothing ends: a gradient has more noise.
constexpr double kTolerance = 1e-3;
constexpr int kMostSteps = 100;

}  // namespace

MeshGraph::MeshGraph(const VertexColors& colors, const Mesh& mesh)
    : size_(static_cast<Eigen::Index>(colors.values().size())) {
  const std::vector<int>& elements = colors.elements();
  std::vector<int> at_vertex(mesh.positions.size(), -1);  // the value of a corner there
  const auto join = [&](int a, int b) {
    if (a != b) edges_.push_back({std::min(a, b), std::max(a, b)});
  };
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const int here = elements[3 * t + k];
      join(here, elements[3 * t + (k + 1) % 3]);
      int& other = at_vertex[static_cast<std::size_t>(mesh.triangles[t][k])];
      if (other >= 0) join(here, other);
      other = here;
    }
  std::ranges::sort(edges_);
  edges_.erase(std::ranges::unique(edges_).begin(), edges_.end());
}

Eigen::VectorXd MeshGraph::smoothed(const Eigen::VectorXd& numbers, double values) const {
  // Triangles of equal sides: the variance along an axis is 2 sqrt(3) lambda in units of the area that a
  // value has to itself, and values / (4 pi) is that of the Gaussian.
  const double lambda = values / (8 * kPi<double> * std::sqrt(3.0));
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index i = 0; i < size_; ++i) entries.emplace_back(i, i, 1);
  for (const auto& [a, b] : edges_) {
    entries.emplace_back(a, a, lambda);
    entries.emplace_back(b, b, lambda);
    entries.emplace_back(a, b, -lambda);
    entries.emplace_back(b, a, -lambda);
  }
  Eigen::SparseMatrix<double> matrix(size_, size_);
  matrix.setFromTriplets(entries.begin(), entries.end());
  Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower | Eigen::Upper> solver(matrix);
  solver.setTolerance(kTolerance);
  solver.setMaxIterations(kMostSteps);
  Eigen::VectorXd found(numbers.size());
  const Eigen::Index channels = numbers.size() / size_;
  for (Eigen::Index c = 0; c < channels; ++c) {
    const auto channel = Eigen::seqN(c, size_, channels);
    found(channel) = solver.solve(Eigen::VectorXd(numbers(channel)));
  }
  return found;
}

}  // namespace selenite
