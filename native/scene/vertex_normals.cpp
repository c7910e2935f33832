// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/vertex_normals.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace selenite {
namespace {

/// Normals whose difference is shorter belong to one smooth surface.
constexpr float kSame = 1e-3f;

/// The corner of a triangle at `a`: its share of the vertex's normal is angle times face normal.
struct Corner {
  Vec3d b, c;      ///< the edges from the corner
  Vec3d cross_bc;  ///< twice the area along the face normal
  double size = 0, along = 0, angle = 0;

  Corner(const std::vector<Vec3f>& p, int a, int second, int third)
      : b(Vec3d(p[second]) - Vec3d(p[a])),
        c(Vec3d(p[third]) - Vec3d(p[a])),
        cross_bc(cross(b, c)),
        size(length(cross_bc)),
        along(dot(b, c)),
        angle(std::atan2(size, along)) {}
  bool has_area() const { return size > 0; }
  Vec3d normal() const { return cross_bc / size; }
};

}  // namespace

VertexNormals::VertexNormals(const Mesh& mesh)
    : triangles_(mesh.triangles), normals_(3 * mesh.triangles.size()) {
  std::multimap<int, int> of_vertex;  // to a corner with each of its normals
  for (std::size_t corner = 0; corner < normals_.size(); ++corner) {
    const int vertex = triangles_[corner / 3][corner % 3];
    const auto [first, last] = of_vertex.equal_range(vertex);
    const auto same = std::find_if(first, last, [&](const auto& other) {
      return length(mesh.corner_normals[corner] - mesh.corner_normals[other.second]) < kSame;
    });
    if (same != last) {
      normals_[corner] = normals_[same->second];
      continue;
    }
    normals_[corner] = count_++;
    of_vertex.emplace(vertex, static_cast<int>(corner));
  }
}

std::vector<Vec3d> VertexNormals::sums(const std::vector<Vec3f>& positions) const {
  std::vector<Vec3d> sums(count_);
  for (std::size_t corner = 0; corner < normals_.size(); ++corner) {
    const auto& t = triangles_[corner / 3];
    const std::size_t k = corner % 3;
    const Corner at(positions, t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
    if (at.has_area()) sums[normals_[corner]] += at.normal() * at.angle;
  }
  return sums;
}

std::vector<Vec3f> VertexNormals::corner_normals(const std::vector<Vec3f>& positions) const {
  const std::vector<Vec3d> sums = this->sums(positions);
  std::vector<Vec3f> normals;
  normals.reserve(normals_.size());
  for (const int normal : normals_) {
    const double size = length(sums[normal]);
    normals.push_back(size > 0 ? Vec3f(sums[normal] / size) : Vec3f{0, 0, 1});
  }
  return normals;
}

void VertexNormals::spread(const std::vector<Vec3f>& positions, const std::vector<Vec3d>& by_normal,
                           std::vector<Vec3d>& by_position) const {
  const std::vector<Vec3d> sums = this->sums(positions);
  for (std::size_t corner = 0; corner < normals_.size(); ++corner) {
    const Vec3d& sum = sums[normals_[corner]];
    const double size = length(sum);
    const auto& t = triangles_[corner / 3];
    const std::size_t k = corner % 3;
    const int at = t[k], second = t[(k + 1) % 3], third = t[(k + 2) % 3];
    const Corner one(positions, at, second, third);
    if (!(size > 0) || !one.has_area()) continue;
    // By the sum, of which the unit vector is the normal.
    const Vec3d unit = sum / size, given = by_normal[normals_[corner]];
    const Vec3d by_sum = (given - unit * dot(unit, given)) / size;
    const Vec3d n = one.normal();
    const Vec3d by_face = by_sum * one.angle;
    const double by_angle = dot(by_sum, n);
    // angle = atan2(size, along), n = cross / size.
    const double radius2 = one.size * one.size + one.along * one.along;
    const Vec3d by_cross =
        (by_face - n * dot(n, by_face)) / one.size + n * (by_angle * one.along / radius2);
    const double by_along = -by_angle * one.size / radius2;
    const Vec3d by_b = cross(one.c, by_cross) + one.c * by_along;
    const Vec3d by_c = cross(by_cross, one.b) + one.b * by_along;
    by_position[second] += by_b;
    by_position[third] += by_c;
    by_position[at] += -(by_b + by_c);
  }
}

}  // namespace selenite
