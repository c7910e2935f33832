// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "render/derivatives/sparse_gradient.h"
#include "scene/geometry.h"
#include "scene/vertex_normals.h"

namespace selenite {

/// Whether a derivative lets the shading normals that rays meet turn as vertices move.
enum class ShadingNormals { kFollow, kFixed };

/// The object whose vertices are unknown. Its mesh is kept in world space.
struct MovedMesh {
  const Geometry& geometry;
  int instance;
  const VertexNormals& normals;
  ShadingNormals shading = ShadingNormals::kFollow;

  const Mesh& mesh() const { return geometry.meshes()[geometry.instances()[instance].mesh]; }
  std::size_t vertex_count() const { return mesh().positions.size(); }
  /// Numbers of a derivative by everything that moves: its vertices, and after them its normals.
  std::size_t places() const { return vertex_count() + normals.count(); }
  bool has(const Hit& hit) const { return hit.instance == instance; }
};

/// Derivatives of a loss by the vertices and the shading normals of a mesh, as one tile collects them.
class VertexSums {
 public:
  VertexSums(const MovedMesh& mesh, SparseGradient& to) : mesh_(mesh), to_(to) {}

  void add_vertex(int vertex, const Vec3f& derivative) {
    to_.add(static_cast<std::uint32_t>(vertex), {derivative.x, derivative.y, derivative.z});
  }
  void add_position(int triangle, int corner, const Vec3f& derivative) {
    add_vertex(mesh_.mesh().triangles[triangle][corner], derivative);
  }
  void add_normal(int triangle, int corner, const Vec3f& derivative) {
    const auto place = mesh_.vertex_count() + mesh_.normals.normal(triangle, corner);
    to_.add(static_cast<std::uint32_t>(place), {derivative.x, derivative.y, derivative.z});
  }
  const MovedMesh& mesh() const { return mesh_; }

 private:
  const MovedMesh& mesh_;
  SparseGradient& to_;
};

/// Shares of the three corners in a hit.
inline std::array<float, 3> shares_of(const Hit& hit) {
  return {1 - hit.b1 - hit.b2, hit.b1, hit.b2};
}

/// A point that a fixed ray meets on the mesh, and on what of it something depends.
struct PointSlopes {
  Vec3f position;        ///< by where the point is
  Vec3f normal;          ///< by the shading normal, unit, as `Surface` has it
  float b1 = 0, b2 = 0;  ///< by which point of the triangle it is, with both held

  /// Of a point that stays where it is on its triangle.
  void spread_of_surface(const Hit& hit, const Surface& surface, VertexSums& sums) const;
  /// Of a point that stays on the ray.
  void spread_of_ray(const Hit& hit, const Surface& surface, const Vec3f& direction,
                     VertexSums& sums) const;
};

}  // namespace selenite
