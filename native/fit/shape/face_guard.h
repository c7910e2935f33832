// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <vector>

#include "fit/shape/mesh_smoothing.h"
#include "scene/vertex_normals.h"

namespace selenite {

/// The first vertex at the place of each: where a mesh is cut along a seam, several are one.
std::vector<int> joined_vertices(const VertexMatrix& positions);

/// How many pairs of an edge and a triangle of a mesh, without a common vertex, cross each other.
/// `joined`: see above, of the mesh as it was before seams may have opened.
int crossings(const VertexMatrix& positions, const std::vector<std::array<int, 3>>& triangles,
              const std::vector<int>& joined);

/// Watches over the faces of a mesh that moves: none may turn over, and no surface go through another.
/// What the mesh has of both at its start may stay.
class FaceGuard {
 public:
  FaceGuard(std::vector<std::array<int, 3>> triangles, const VertexNormals& normals,
            const VertexMatrix& positions);

  enum class Verdict { kGood, kTurned, kCrossed };
  /// Of a way from the positions before; those become the ones to start from if it is good.
  Verdict move_to(const VertexMatrix& positions);
  /// Vertices of the faces that a way there would turn over.
  std::vector<int> turning(const VertexMatrix& positions) const;
  /// Without a check.
  void set(const VertexMatrix& positions);

 private:
  /// Of each face twice its area along its normal, and its cosine to the smoothed surface.
  struct Faces {
    std::vector<Vec3d> doubled;
    std::vector<double> cosine;
  };
  Faces faces_of(const VertexMatrix& positions) const;
  std::vector<std::size_t> turned(const Faces& faces) const;

  std::vector<std::array<int, 3>> triangles_;
  std::vector<int> joined_;
  const VertexNormals* normals_;
  Faces faces_;
  std::vector<double> least_;  ///< cosine of each face
  int crossings_ = 0;
};

}  // namespace selenite
