// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <vector>

#include "scene/geometry.h"

namespace selenite {

/// How the shading normals of a mesh follow from its vertices, so that they can be recomputed when
/// these move: corners of one vertex whose normals agree share the mean of their triangles' normals,
/// weighted by the angles at the corners.
class VertexNormals {
 public:
  /// Reads which corners share a normal from those that the mesh has.
  explicit VertexNormals(const Mesh& mesh);

  int count() const { return count_; }  ///< of different normals
  int normal(int triangle, int corner) const { return normals_[3 * triangle + corner]; }
  /// Three per triangle, unit.
  std::vector<Vec3f> corner_normals(const std::vector<Vec3f>& positions) const;
  /// Adds to `by_position` the derivative that `by_normal`, one for each normal, is of.
  void spread(const std::vector<Vec3f>& positions, const std::vector<Vec3d>& by_normal,
              std::vector<Vec3d>& by_position) const;

 private:
  std::vector<Vec3d> sums(const std::vector<Vec3f>& positions) const;

  std::vector<std::array<int, 3>> triangles_;
  std::vector<int> normals_;  ///< of each corner
  int count_ = 0;
};

}  // namespace selenite
