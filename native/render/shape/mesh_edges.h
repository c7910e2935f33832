// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <vector>

#include "render/shape/moved_mesh.h"

namespace selenite {

/// An edge of the moved mesh and the triangles at it.
struct MeshEdge {
  int from, to;         ///< vertices
  int first, second;    ///< triangles; second is -1 at the rim of an open mesh
  int across_first;     ///< the first triangle's vertex that is not on the edge
  bool crease = false;  ///< what is seen jumps there: another shading normal or material
};

/// All edges. Those with more than two triangles come once for each pair of neighbours in the list.
std::vector<MeshEdge> edges_of(const MovedMesh& mesh);

/// Angle between the two triangles' planes; pi at a rim.
inline float angle_of(const MovedMesh& mesh, const MeshEdge& edge) {
  if (edge.second < 0) return kPi<float>;
  const Vec3f a = mesh.geometry.face(mesh.instance, edge.first)->ng;
  const Vec3f b = mesh.geometry.face(mesh.instance, edge.second)->ng;
  return std::atan2(length(cross(a, b)), dot(a, b));
}

/// Whether one triangle at least shows its front.
inline bool is_seen(const MovedMesh& mesh, const MeshEdge& edge, const Vec3f& towards) {
  if (edge.second < 0) return true;
  return dot(mesh.geometry.face(mesh.instance, edge.first)->ng, towards) > 0 ||
         dot(mesh.geometry.face(mesh.instance, edge.second)->ng, towards) > 0;
}

/// Whether one triangle shows its front to a point and the other its back; a rim always counts.
/// `direction_from(point)`: towards the viewer or lamp.
inline bool is_outline(const MovedMesh& mesh, const MeshEdge& edge, const Vec3f& towards) {
  if (edge.second < 0) return true;
  const auto faces_it = [&](int triangle) {
    return dot(mesh.geometry.face(mesh.instance, triangle)->ng, towards) > 0;
  };
  return faces_it(edge.first) != faces_it(edge.second);
}

/// Draws edges by weights of theirs.
class EdgeChoice {
 public:
  void add(int edge, double weight) {
    if (!(weight > 0)) return;
    edges_.push_back(edge);
    sums_.push_back(total() + weight);
  }
  double total() const { return sums_.empty() ? 0 : sums_.back(); }
  struct Drawn {
    int edge;
    float along;  ///< u again, within the edge
  };
  /// `u` in [0, 1); there is at least one edge. The probability of an edge is weight / total.
  Drawn draw(double u) const;

 private:
  std::vector<int> edges_;
  std::vector<double> sums_;
};

}  // namespace selenite
