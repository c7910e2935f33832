// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <set>
#include <vector>

#include "fit/shape/mesh_smoothing.h"
#include "scene/vertex_normals.h"

namespace selenite {

/// The first vertex at the place of each: where a mesh is cut along a seam, several are one.
std::vector<int> joined_vertices(const VertexMatrix& positions);

/// An edge of a mesh that goes through a triangle.
struct Crossing {
  std::array<int, 2> edge{};
  std::array<int, 3> triangle{};
};

/// Those of edges and triangles without a common vertex. `joined`: see above, of the mesh as it was
/// before seams may have opened.
std::vector<Crossing> crossings(const VertexMatrix& positions,
                                const std::vector<std::array<int, 3>>& triangles,
                                const std::vector<int>& joined);

/// Watches over the faces of a mesh that moves: none may turn over, and no surface go through another.
/// What the mesh has of both at its start may stay: an edge that goes through the surface may go
/// through another triangle of it.
class FaceGuard {
 public:
  FaceGuard(std::vector<std::array<int, 3>> triangles, const VertexNormals& normals,
            const VertexMatrix& positions);

  enum class Verdict { kGood, kTurned, kCrossed };
  /// Of a way from the positions before; those become the ones to start from if it is good.
  Verdict move_to(const VertexMatrix& positions);
  /// Vertices of the faces that a way there would turn over.
  std::vector<int> turning(const VertexMatrix& positions) const;
  /// Those of edges and triangles that a way there would lead through each other.
  std::vector<int> crossing(const VertexMatrix& positions) const;
  /// The vertices of all faces that have one of these.
  std::vector<int> around(const std::vector<int>& vertices) const;
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
  bool may_cross(const Crossing& one) const;
  void keep(Faces faces, const std::vector<Crossing>& found);

  std::vector<std::array<int, 3>> triangles_;
  std::vector<int> joined_;
  const VertexNormals* normals_;
  Faces faces_;
  std::vector<double> least_;                    ///< cosine of each face
  std::set<std::array<int, 2>> crossing_edges_;  ///< of the positions before
  std::set<std::array<int, 3>> crossed_triangles_;
};

}  // namespace selenite
