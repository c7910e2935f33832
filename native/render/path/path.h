// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <limits>

#include "model/ray_kind.h"
#include "scene/camera.h"

namespace selenite {

/// State of a path between two vertices.
struct Path {
  /// Density of a direction that cannot be met by chance.
  static constexpr float kSingular = std::numeric_limits<float>::infinity();

  Ray ray;
  RayKind kind = kCameraRay;
  float density = kSingular;  ///< of the ray's direction, per solid angle
  bool refracted = false;     ///< the direction leads through a surface
  Vec3f from{};               ///< where that density was taken
  float travelled = 0;        ///< from there to the ray's origin, through transparent surfaces
  int scatterings = 0;
  bool after_diffuse = false;
  bool sealed = false;  ///< the ray starts inside a body from where no light is seen
  int receiver = -1;    ///< the object that has scattered the light last; -1: none yet
  bool on_film = true;  ///< what is met belongs to the film: straight from the camera, or see World

  bool from_camera() const { return kind == kCameraRay; }
};

}  // namespace selenite
