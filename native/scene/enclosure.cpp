// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/enclosure.h"

#include <algorithm>
#include <numeric>
#include <vector>

namespace selenite {
namespace {

using Positions = std::span<const Vec3f>;
using Triangles = std::span<const std::array<int, 3>>;

/// More hollows than this are not looked at one by one.
constexpr int kMostHollows = 16;

/// Every edge is run along once in either direction.
bool is_closed(Positions positions, Triangles triangles) {
  // The ends of all edges by where they begin: few for each vertex, so that looking is cheap.
  std::vector<int> begin(positions.size() + 1, 0);
  for (const auto& t : triangles)
    for (const int corner : t) ++begin[corner + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<int> ends(3 * triangles.size());
  std::vector<int> next(begin.begin(), begin.end() - 1);
  for (const auto& t : triangles)
    for (int k = 0; k < 3; ++k) ends[next[t[k]]++] = t[(k + 1) % 3];
  for (std::size_t v = 0; v < positions.size(); ++v)
    std::sort(&ends[0] + begin[v], &ends[0] + begin[v + 1]);
  const auto count = [&](int from, int to) {
    const auto range =
        std::equal_range(ends.begin() + begin[from], ends.begin() + begin[from + 1], to);
    return range.second - range.first;
  };
  return std::all_of(triangles.begin(), triangles.end(), [&](const auto& t) {
    for (int k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      if (count(a, b) != 1 || count(b, a) != 1) return false;
    }
    return true;
  });
}

/// Vertex -> a vertex that stands for its connected piece.
std::vector<int> pieces_of(Positions positions, Triangles triangles) {
  std::vector<int> above(positions.size());
  std::iota(above.begin(), above.end(), 0);
  const auto top = [&](int v) {
    while (above[v] != v) v = above[v] = above[above[v]];
    return v;
  };
  for (const auto& t : triangles)
    for (int k = 1; k < 3; ++k) above[top(t[k])] = top(t[0]);
  for (std::size_t v = 0; v < above.size(); ++v) above[v] = top(static_cast<int>(v));
  return above;
}

/// Solid angle under which a point sees a triangle, positive from behind it.
/// Source: Van Oosterom and Strackee 1983.
double solid_angle(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const double la = length(a), lb = length(b), lc = length(c);
  return 2 * std::atan2(dot(a, cross(b, c)),
                        la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
}

}  // namespace

bool encloses(Positions positions, Triangles triangles) {
  if (triangles.empty() || !is_closed(positions, triangles)) return false;
  const std::vector<int> piece = pieces_of(positions, triangles);
  std::vector<double> volume(positions.size(), 1);  // six times that of a piece; 1: no piece
  for (const auto& t : triangles) volume[piece[t[0]]] = 0;
  for (const auto& t : triangles) {
    const Vec3d o(positions[piece[t[0]]]);
    const Vec3d a(positions[t[0]]), b(positions[t[1]]), c(positions[t[2]]);
    volume[piece[t[0]]] += dot(a - o, cross(b - o, c - o));
  }
  int hollows = 0;
  for (std::size_t p = 0; p < volume.size(); ++p) {
    if (volume[p] > 0) continue;
    if (++hollows > kMostHollows) return false;
    const Vec3d o(positions[p]);
    double around = 0;
    for (const auto& t : triangles)
      if (piece[t[0]] != static_cast<int>(p))
        around += solid_angle(Vec3d(positions[t[0]]) - o, Vec3d(positions[t[1]]) - o,
                              Vec3d(positions[t[2]]) - o);
    if (around < 2 * kPi<double>) return false;  // not once around
  }
  return true;
}

}  // namespace selenite
