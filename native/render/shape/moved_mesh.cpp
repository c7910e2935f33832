// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/shape/moved_mesh.h"

#include <algorithm>
#include <cmath>

namespace selenite {
namespace {

constexpr float kLeastCosine = 0.01f;

/// The derivative by the sum of the corners' normals, of which the unit vector is the shading normal.
Vec3f by_sum(const Vec3f& by_normal, const Hit& hit, const Surface& surface,
             const Geometry::Face& face, const MovedMesh& mesh) {
  if (mesh.shading == ShadingNormals::kFixed) return {};
  const auto share = shares_of(hit);
  Vec3f sum{};
  for (int k = 0; k < 3; ++k) sum += face.normals[k] * share[k];
  const float size = length(sum);
  if (!(size > 0)) return {};
  return (by_normal - surface.n * dot(surface.n, by_normal)) / size;
}

}  // namespace

void PointSlopes::spread_of_surface(const Hit& hit, const Surface& surface,
                                    VertexSums& sums) const {
  const Geometry::Face& face = *sums.mesh().geometry.face(hit.instance, hit.triangle);
  const Vec3f by_normals = by_sum(normal, hit, surface, face, sums.mesh());
  const auto share = shares_of(hit);
  for (int k = 0; k < 3; ++k) {
    sums.add_position(hit.triangle, k, position * share[k]);
    sums.add_normal(hit.triangle, k, by_normals * share[k]);
  }
}

void PointSlopes::spread_of_ray(const Hit& hit, const Surface& surface, const Vec3f& direction,
                                VertexSums& sums) const {
  const Geometry::Face& face = *sums.mesh().geometry.face(hit.instance, hit.triangle);
  // A surface seen from its side moves far along the ray; few samples are there, and would outweigh all.
  const float along = std::copysign(std::max(std::abs(dot(surface.ng, direction)), kLeastCosine),
                                    dot(surface.ng, direction));
  const Vec3f by_normals = by_sum(normal, hit, surface, face, sums.mesh());
  const float c1 = b1 + dot(by_normals, face.normals[1] - face.normals[0]);
  const float c2 = b2 + dot(by_normals, face.normals[2] - face.normals[0]);
  // The triangle's point that moves by v is left behind: the ray's point moves along the ray by
  // (ng v) / (ng d), and over the triangle by the difference.
  const Vec3f e1 = face.corners[1] - face.corners[0], e2 = face.corners[2] - face.corners[0];
  const Vec3f doubled = cross(e1, e2);
  const float size2 = dot(doubled, doubled);
  const Vec3f q1 = cross(e2, doubled) / size2, q2 = cross(doubled, e1) / size2;
  const Vec3f over = q1 * c1 + q2 * c2;
  const Vec3f by_point =
      surface.ng * ((dot(position, direction) + dot(over, direction)) / along) - over;
  const auto share = shares_of(hit);
  for (int k = 0; k < 3; ++k) {
    sums.add_position(hit.triangle, k, by_point * share[k]);
    sums.add_normal(hit.triangle, k, by_normals * share[k]);
  }
}

}  // namespace selenite
