// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "model/ray_kind.h"
#include "scene/vertex_colors.h"

namespace selenite {

/// What a shader may ask about the ray that met the surface: Blender's Light Path.
struct PathFacts {
  RayKinds kinds = kCameraRay;  ///< 0: a light sample, which is none of them
  bool singular = false;        ///< scattered by a perfect mirror or glass
  float length = 0;             ///< since the last hit, transparent ones counted
  int depth = 0;                ///< scatterings, as Cycles counts them
  int diffuse_depth = 0, glossy_depth = 0, transparent_depth = 0, transmission_depth = 0;
};

/// The camera of the picture, at every bounce.
struct CameraPlace {
  Vec3f right{1, 0, 0}, up{0, 1, 0}, forward{0, 0, -1};  ///< unit, world frame
  Vec3f position;                                        ///< relative to the geometry's origin

  static CameraPlace of(const Camera& camera);
};

/// Where a shader is evaluated.
struct ShadingPoint {
  const Geometry* geometry = nullptr;
  const MeshColors* mesh_colors = nullptr;  ///< null: the geometry's
  Hit hit{};
  Surface surface{};  ///< `n`, `ng` by the winding, as `Geometry::surface` gives them
  Vec3f wi;           ///< unit, to the viewer
  PathFacts path;
  const CameraPlace* camera = nullptr;
  float footprint = 0;  ///< radius of a pixel at the surface, for Bump; 0: a Bump does nothing

  bool backfacing() const { return dot(surface.ng, wi) < 0; }
  /// Both normals on the side of the viewer.
  Vec3f normal() const { return backfacing() ? -surface.n : surface.n; }
  Vec3f true_normal() const { return backfacing() ? -surface.ng : surface.ng; }
};

}  // namespace selenite
