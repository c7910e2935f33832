// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "scene/geometry.h"

namespace selenite {

/// The values of a colour attribute of a mesh, one for each of its vertices or corners, linear. They
/// take the place of those that the mesh was built with. Immutable, shared.
class VertexColors {
 public:
  using Elements = std::shared_ptr<const std::vector<int>>;

  /// `elements`: the number of the value that each corner of the mesh shows, three a triangle.
  /// InvalidArgument: one that is not there, or a value that is not finite.
  VertexColors(int mesh, std::string attribute, Elements elements, std::vector<Colorf> values);

  int mesh() const { return mesh_; }
  const std::string& attribute() const { return attribute_; }
  const std::vector<int>& elements() const { return *elements_; }
  const std::vector<Colorf>& values() const { return values_; }
  /// The same attribute with other values; the same errors.
  VertexColors with(std::vector<Colorf> values) const {
    return {mesh_, attribute_, elements_, std::move(values)};
  }

  Colorf at(const Hit& hit) const {
    const int* corner = corners(hit.triangle);
    return values_[static_cast<std::size_t>(corner[0])] * (1 - hit.b1 - hit.b2) +
           values_[static_cast<std::size_t>(corner[1])] * hit.b1 +
           values_[static_cast<std::size_t>(corner[2])] * hit.b2;
  }
  /// Calls `sink(element, derivative)` for the values that make up the colour at a point, where
  /// `derivative` is by that colour.
  template <class Sink>
  void spread(int triangle, float b1, float b2, const Colorf& derivative, Sink&& sink) const {
    const int* corner = corners(triangle);
    const float weights[] = {1 - b1 - b2, b1, b2};
    for (int k = 0; k < 3; ++k)
      sink(static_cast<std::uint32_t>(corner[k]), derivative * weights[k]);
  }

 private:
  const int* corners(int triangle) const {
    return &(*elements_)[3 * static_cast<std::size_t>(triangle)];
  }

  int mesh_;
  std::string attribute_;
  Elements elements_;
  std::vector<Colorf> values_;
};

/// The colours of a scene's meshes that can be other than those that their geometry was built with.
using MeshColors = std::vector<std::shared_ptr<const VertexColors>>;

/// Those of an attribute (empty: the first) on a mesh; null: the geometry has them.
inline const VertexColors* colors_of(const MeshColors& all, int mesh,
                                     const std::string& attribute) {
  for (const auto& one : all)
    if (one->mesh() == mesh && (attribute.empty() || one->attribute() == attribute))
      return one.get();
  return nullptr;
}

/// The colour attribute of a mesh at a hit.
inline Colorf color_at(const Geometry& geometry, const MeshColors& all, const Hit& hit,
                       const std::string& attribute) {
  const VertexColors* const found =
      all.empty() ? nullptr : colors_of(all, geometry.instances()[hit.instance].mesh, attribute);
  return found ? found->at(hit) : geometry.color(hit, attribute);
}

}  // namespace selenite
