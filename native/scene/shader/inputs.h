// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "scene/shader/modes.h"
#include "scene/shader/shading_point.h"

// What a shader asks of the hit: plain numbers, which no unknown changes.
namespace selenite::shading {

/// The footprint's two directions on the surface, for Bump.
struct Footprint {
  Vec3f x, y;  ///< of the length of the footprint
  static Footprint of(const ShadingPoint& point);
};

/// The point, or one beside it for a Bump.
class InputPoint {
 public:
  /// `shift`: 0, or 1 and 2 for `width` footprints along x and y.
  InputPoint(const ShadingPoint& point, int shift, float width);

  Colorf geometry(GeometryMode mode) const;
  Colorf attribute(AttributeMode mode, const std::string& name) const;
  Colorf camera(CameraMode mode) const;
  Vec3f position() const;  ///< world

 private:
  Vec3f object_position() const;
  const ShadingPoint& point_;
  Hit hit_;
  Vec3f position_;  ///< relative to the geometry's origin
  int shift_;
};

Colorf object_fact(const ShadingPoint& point, ObjectMode mode);
float path_fact(const PathFacts& path, PathMode mode);

/// Of Mesh::vectors; the position in the object's space where the mesh has none of this name.
Vec3f corner_vector(const Geometry& geometry, const Hit& hit, const std::string& name);

/// Between spaces; `item` is 3 * from + to of Space. Not normalised.
Vec3d transformed(const ShadingPoint& point, TransformMode mode, int item, const Vec3d& v);

/// A normal of the object's space in the world's; unit, or zero.
Vec3f normal_to_world(const ShadingPoint& point, const Vec3f& n);
/// The other way round.
Vec3f normal_to_object(const ShadingPoint& point, const Vec3f& n);

}  // namespace selenite::shading
