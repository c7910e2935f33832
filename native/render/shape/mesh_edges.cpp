// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/shape/mesh_edges.h"

#include <algorithm>
#include <map>

namespace selenite {

std::vector<MeshEdge> edges_of(const MovedMesh& mesh) {
  const Mesh& m = mesh.mesh();
  const auto normal_at = [&](int triangle, int vertex) {
    const auto& t = m.triangles[triangle];
    const auto corner = std::find(t.begin(), t.end(), vertex) - t.begin();
    return mesh.normals.normal(triangle, static_cast<int>(corner));
  };
  std::vector<MeshEdge> edges;
  std::map<std::pair<int, int>, int> open;  // ends, to an edge that lacks a triangle
  for (int i = 0; i < static_cast<int>(m.triangles.size()); ++i) {
    const auto& t = m.triangles[i];
    for (std::size_t k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      const auto key = std::minmax(a, b);
      const auto found = open.find(key);
      if (found == open.end()) {
        open.emplace(key, static_cast<int>(edges.size()));
        edges.push_back({a, b, i, -1, t[(k + 2) % 3]});
        continue;
      }
      MeshEdge& edge = edges[found->second];
      edge.second = i;
      edge.crease = normal_at(edge.first, a) != normal_at(i, a) ||
                    normal_at(edge.first, b) != normal_at(i, b) ||
                    m.material_slots[edge.first] != m.material_slots[i];
      open.erase(found);
    }
  }
  return edges;
}

EdgeChoice::Drawn EdgeChoice::draw(double u) const {
  const double at = u * total();
  auto found = std::upper_bound(sums_.begin(), sums_.end(), at);
  if (found == sums_.end()) --found;
  const double before = found == sums_.begin() ? 0 : *(found - 1);
  const auto along = static_cast<float>((at - before) / (*found - before));
  return {edges_[found - sums_.begin()], std::clamp(along, 0.0f, 1.0f)};
}

}  // namespace selenite
