// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/shape/face_guard.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <unordered_map>

namespace selenite {
namespace {

/// A face lies at most 78 degrees off the surface that its smoothed neighbours make.
constexpr double kLeastCosine = 0.2;
/// Of a cosine at the start below that: its neighbours turn the smoothed surface.
constexpr double kCosineSlack = 0.05;

using Triangle = std::array<int, 3>;

Vec3d row(const VertexMatrix& m, int i) { return {m(i, 0), m(i, 1), m(i, 2)}; }

/// Whether a segment crosses the inside of a triangle. Source: Moeller, Trumbore 1997.
bool cross_each_other(const Vec3d& from, const Vec3d& to, const Vec3d& a, const Vec3d& b,
                      const Vec3d& c) {
  const Vec3d along = to - from, e1 = b - a, e2 = c - a;
  const Vec3d p = cross(along, e2);
  const double volume = dot(e1, p);
  if (volume == 0) return false;
  const Vec3d s = from - a;
  const double u = dot(s, p) / volume;
  if (!(u > 0 && u < 1)) return false;
  const Vec3d q = cross(s, e1);
  const double v = dot(along, q) / volume;
  if (!(v > 0 && u + v < 1)) return false;
  const double t = dot(e2, q) / volume;
  return t > 0 && t < 1;
}

/// The cells of a grid that boxes touch.
class Cells {
 public:
  Cells(const VertexMatrix& positions, double side)
      : low_(positions.colwise().minCoeff()), side_(side) {}

  using Place = std::array<int, 3>;
  Place place(const Eigen::RowVector3d& at) const {
    Place found{};
    for (std::size_t axis = 0; axis < 3; ++axis)
      found[axis] = static_cast<int>(
          (at[static_cast<Eigen::Index>(axis)] - low_[static_cast<Eigen::Index>(axis)]) / side_);
    return found;
  }
  template <class Action>
  void for_each(const Eigen::RowVector3d& low, const Eigen::RowVector3d& high,
                Action&& action) const {
    const Place from = place(low), to = place(high);
    for (int z = from[2]; z <= to[2]; ++z)
      for (int y = from[1]; y <= to[1]; ++y)
        for (int x = from[0]; x <= to[0]; ++x)
          action((static_cast<std::int64_t>(z) << 42) + (static_cast<std::int64_t>(y) << 21) + x);
  }

 private:
  Eigen::RowVector3d low_;
  double side_;
};

std::vector<std::array<int, 2>> edges_of(const std::vector<Triangle>& triangles) {
  std::vector<std::array<int, 2>> edges;
  edges.reserve(3 * triangles.size());
  for (const Triangle& t : triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [a, b] = std::minmax(t[k], t[(k + 1) % 3]);
      edges.push_back({a, b});
    }
  std::ranges::sort(edges);
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

}  // namespace

std::vector<int> joined_vertices(const VertexMatrix& positions) {
  constexpr double kSamePlace = 1e-5;  // of the diagonal: both ends of a seam are rounded
  const double size = (positions.colwise().maxCoeff() - positions.colwise().minCoeff()).norm();
  const double side = size > 0 ? kSamePlace * size : 1;
  std::map<std::array<long long, 3>, int> first;
  std::vector<int> joined;
  for (int v = 0; v < positions.rows(); ++v) {
    const auto rounded = [&](int axis) { return std::llround(positions(v, axis) / side); };
    joined.push_back(first.try_emplace({rounded(0), rounded(1), rounded(2)}, v).first->second);
  }
  return joined;
}

std::vector<Crossing> crossings(const VertexMatrix& positions,
                                const std::vector<Triangle>& triangles,
                                const std::vector<int>& joined) {
  if (triangles.empty()) return {};
  const std::vector<std::array<int, 2>> edges = edges_of(triangles);
  double sum = 0;
  for (const auto& [a, b] : edges) sum += (positions.row(a) - positions.row(b)).norm();
  constexpr double kMostCells = 128;  // along the mesh: one large face touches all of them
  const double size = (positions.colwise().maxCoeff() - positions.colwise().minCoeff()).norm();
  const double side = std::max(sum / static_cast<double>(edges.size()), size / kMostCells);
  if (!(side > 0)) return {};
  const Cells cells(positions, side);
  std::unordered_map<std::int64_t, std::vector<int>> inside;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const auto& [a, b, c] = triangles[i];
    const Eigen::RowVector3d pa = positions.row(a), pb = positions.row(b), pc = positions.row(c);
    cells.for_each(pa.cwiseMin(pb).cwiseMin(pc), pa.cwiseMax(pb).cwiseMax(pc),
                   [&](std::int64_t cell) { inside[cell].push_back(static_cast<int>(i)); });
  }
  std::vector<Crossing> found;
  std::vector<int> near;
  for (const auto& [from, to] : edges) {
    const Eigen::RowVector3d pa = positions.row(from), pb = positions.row(to);
    near.clear();
    cells.for_each(pa.cwiseMin(pb), pa.cwiseMax(pb), [&](std::int64_t cell) {
      if (const auto here = inside.find(cell); here != inside.end())
        near.insert(near.end(), here->second.begin(), here->second.end());
    });
    std::ranges::sort(near);
    near.erase(std::unique(near.begin(), near.end()), near.end());
    for (const int i : near) {
      const Triangle& t = triangles[static_cast<std::size_t>(i)];
      const auto meets = [&](int vertex) {
        const auto at = [&](int v) { return joined[static_cast<std::size_t>(v)]; };
        return std::ranges::any_of(t, [&](int v) { return at(v) == at(vertex); });
      };
      if (meets(from) || meets(to)) continue;
      if (cross_each_other(row(positions, from), row(positions, to), row(positions, t[0]),
                           row(positions, t[1]), row(positions, t[2])))
        found.push_back({{from, to}, t});
    }
  }
  return found;
}

FaceGuard::FaceGuard(std::vector<Triangle> triangles, const VertexNormals& normals,
                     const VertexMatrix& positions)
    : triangles_(std::move(triangles)), joined_(joined_vertices(positions)), normals_(&normals) {
  set(positions);
  for (const double cosine : faces_.cosine)
    least_.push_back(std::min(kLeastCosine, cosine - kCosineSlack));
}

void FaceGuard::set(const VertexMatrix& positions) {
  keep(faces_of(positions), crossings(positions, triangles_, joined_));
}

void FaceGuard::keep(Faces faces, const std::vector<Crossing>& found) {
  faces_ = std::move(faces);
  crossing_edges_.clear();
  crossed_triangles_.clear();
  for (const Crossing& one : found) {
    crossing_edges_.insert(one.edge);
    crossed_triangles_.insert(one.triangle);
  }
}

FaceGuard::Verdict FaceGuard::move_to(const VertexMatrix& positions) {
  Faces faces = faces_of(positions);
  if (!turned(faces).empty()) return Verdict::kTurned;
  const std::vector<Crossing> found = crossings(positions, triangles_, joined_);
  if (!std::ranges::all_of(found, [&](const Crossing& one) { return may_cross(one); }))
    return Verdict::kCrossed;
  keep(std::move(faces), found);
  return Verdict::kGood;
}

bool FaceGuard::may_cross(const Crossing& one) const {
  return crossing_edges_.contains(one.edge) || crossed_triangles_.contains(one.triangle);
}

FaceGuard::Faces FaceGuard::faces_of(const VertexMatrix& positions) const {
  std::vector<Vec3f> points;
  points.reserve(static_cast<std::size_t>(positions.rows()));
  for (int i = 0; i < positions.rows(); ++i) points.emplace_back(row(positions, i));
  const std::vector<Vec3f> normals = normals_->corner_normals(points);
  Faces faces;
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    const Triangle& t = triangles_[i];
    const Vec3d a = row(positions, t[0]);
    const Vec3d doubled = cross(row(positions, t[1]) - a, row(positions, t[2]) - a);
    const Vec3d smooth(normals[3 * i] + normals[3 * i + 1] + normals[3 * i + 2]);
    const double sizes = length(doubled) * length(smooth);
    faces.doubled.push_back(doubled);
    faces.cosine.push_back(sizes > 0 ? dot(doubled, smooth) / sizes : -1);
  }
  return faces;
}

std::vector<std::size_t> FaceGuard::turned(const Faces& faces) const {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < faces.cosine.size(); ++i)
    if (!(dot(faces.doubled[i], faces_.doubled[i]) > 0) || faces.cosine[i] < least_[i])
      found.push_back(i);
  return found;
}

std::vector<int> FaceGuard::turning(const VertexMatrix& positions) const {
  std::set<int> vertices;
  for (const std::size_t i : turned(faces_of(positions)))
    vertices.insert(triangles_[i].begin(), triangles_[i].end());
  return {vertices.begin(), vertices.end()};
}

std::vector<int> FaceGuard::around(const std::vector<int>& vertices) const {
  const std::set<int> inner(vertices.begin(), vertices.end());
  std::set<int> found = inner;
  for (const Triangle& t : triangles_)
    if (std::ranges::any_of(t, [&](int v) { return inner.contains(v); }))
      found.insert(t.begin(), t.end());
  return {found.begin(), found.end()};
}

std::vector<int> FaceGuard::crossing(const VertexMatrix& positions) const {
  std::set<int> vertices;
  for (const Crossing& one : crossings(positions, triangles_, joined_)) {
    if (may_cross(one)) continue;
    vertices.insert(one.edge.begin(), one.edge.end());
    vertices.insert(one.triangle.begin(), one.triangle.end());
  }
  return {vertices.begin(), vertices.end()};
}

}  // namespace selenite
