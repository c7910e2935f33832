// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/shape/vertex_moments.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace selenite {

VertexMoments::VertexMoments(Eigen::Index vertices, StepScale scale, double first_decay,
                             double second_decay)
    : scale_(scale),
      first_decay_(first_decay),
      second_decay_(second_decay),
      mean_(VertexMatrix::Zero(vertices, 3)),
      squares_(mean_),
      of_vertices_(Vector::Zero(vertices)) {}

void VertexMoments::reset() {
  mean_.setZero();
  squares_.setZero();
  of_vertices_.setZero();
  seen_ = 0;
}

VertexMatrix VertexMoments::add(const VertexMatrix& gradient, const MeshSmoothing& smoothing) {
  ++seen_;
  const VertexMatrix smooth =
      smoothing.solve(scale_ == StepScale::kOfVertices ? balanced(gradient) : gradient);
  mean_ = mean_ * first_decay_ + smooth * (1 - first_decay_);
  squares_ = squares_ * second_decay_ + smooth.cwiseAbs2() * (1 - second_decay_);
  const double first = 1 - std::pow(first_decay_, seen_);
  const double second = 1 - std::pow(second_decay_, seen_);
  const double typical = std::sqrt(squares_.mean() / second);
  if (!(typical > 0) || !std::isfinite(typical)) return {};
  return mean_ / (first * typical);
}

VertexMatrix VertexMoments::balanced(VertexMatrix gradient) {
  of_vertices_ =
      of_vertices_ * second_decay_ + gradient.rowwise().squaredNorm() * (1 - second_decay_);
  const Vector usual = (of_vertices_ / (1 - std::pow(second_decay_, seen_))).cwiseSqrt();
  std::vector<double> sizes;
  for (const double size : usual)
    if (size > 0) sizes.push_back(size);
  if (sizes.empty()) return gradient;
  const auto middle = sizes.begin() + std::ssize(sizes) / 2;
  std::ranges::nth_element(sizes, middle);
  gradient.array().colwise() /= usual.cwiseMax(*middle).array();
  return gradient;
}

}  // namespace selenite
