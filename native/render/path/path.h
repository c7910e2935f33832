// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <limits>

#include "model/ray_kind.h"
#include "scene/geometry.h"
#include "scene/shader/shading_point.h"

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
  /// The place inside a body where the light of lamps outside was last sought; see RefractedLight.
  struct Inside {
    bool sought = false;  ///< and nothing has been met since
    Vec3f place{};
    float density = 0;  ///< of the direction in which the path went on
    float rate = 0;     ///< typical, of the media
    int body = -1;      ///< its number among the instances
  };
  Inside inside;
  /// Where the ray left that body, by refraction.
  struct Left {
    bool through = false;
    Inside from;
    Hit hit{};
  };
  Left left;
  PathFacts facts;   ///< what shaders ask of its way; `length` and `depth` are filled in at a hit
  float length = 0;  ///< of all rays before this one
  float near = 0;    ///< how far before the near clip plane the ray starts; not part of Ray Length
  /// Radius of a pixel on a surface: where the path starts, and by how much it grows with the length.
  float pixel = 0, pixel_growth = 0;
  bool on_film = true;  ///< what is met belongs to the film: straight from the camera, or see World

  /// Counts a scattering for the facts.
  void count(bool transmits, bool diffuse, bool singular) {
    facts.kinds = static_cast<RayKinds>((transmits ? kTransmissionRay : 0) |
                                        (diffuse ? kDiffuseRay : kGlossyRay));
    facts.singular = singular;
    facts.transmission_depth += transmits;
    facts.diffuse_depth += diffuse && !transmits;
    facts.glossy_depth += !diffuse && !transmits;
  }
  bool from_camera() const { return kind == kCameraRay; }
};

}  // namespace selenite
