// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/lanes.h"
#include "render/lanes/lane_camera.h"
#include "render/lanes/lane_light.h"
#include "render/path/path.h"

namespace selenite {

/// Eight paths and what they carry; see Path. `travelled` is left out: nothing is transparent.
template <int L>
struct LanePaths {
  LaneMask live{false};
  LaneRandom random;
  Vec3<Lanes> origin, direction, from;
  Lanes t_max;
  Lanes density;  ///< of the direction, per solid angle
  Lanes beside;   ///< from the surface that the ray has left to its origin, along the ray
  LaneMask camera, refracted, sealed;  ///< as from_camera(), refracted and sealed of Path
  LaneMask inside;                     ///< of the medium
  LaneMask truncated;                  ///< see PathTracer
  LaneInts vertex, scatterings, surfaces;
  HitPacket first;  ///< of the camera rays
  LaneThroughput<L> beta;
  LaneRadiance<L> radiance;

  explicit LanePaths(int slots) : beta(slots), radiance(slots) {}

  /// Takes up the path of a camera ray that lies in lane `from`.
  void start(int lane, const LaneCameraRays& rays, int from, bool is_inside) {
    random.take(lane, rays.random, from);
    set(origin, lane, at(rays.origin, from));
    set(direction, lane, at(rays.direction, from));
    t_max.set(lane, rays.t_max[from]);
    first.instance[lane] = rays.hits.instance[from];
    first.triangle[lane] = rays.hits.triangle[from];
    first.b1[lane] = rays.hits.b1[from];
    first.b2[lane] = rays.hits.b2[from];
    first.t[lane] = rays.hits.t[from];
    set(this->from, lane, {});
    density.set(lane, Path::kSingular);
    beside.set(lane, 0);
    for (LaneMask* mask : {&refracted, &sealed, &truncated}) mask->set(lane, false);
    for (LaneMask* mask : {&live, &camera}) mask->set(lane, true);
    inside.set(lane, is_inside);
    for (LaneInts* count : {&vertex, &scatterings, &surfaces}) count->set(lane, 0);
    beta.start(lane);
    radiance.start(lane);
  }
};

/// Where light is looked for from surface points, and what comes from there.
struct LaneLightSamples {
  LaneMask lit, delta;
  LaneInts source;  ///< -1: none
  Vec3<Lanes> direction;
  Lanes distance, density, heuristic;
  Color<Lanes> shape;
};

/// What a packet of paths has met.
template <int L>
struct LaneVertices {
  LaneMask scattered, met;  ///< by the medium; a surface
  HitPacket hits;
  Lanes distance;

  // Of surface points.
  LaneInts material;
  Vec3<Lanes> position, ng, n;  ///< as they are
  LaneMask back;                ///< seen from behind
  Lanes offset;
  LaneMask medium, sealed;  ///< as has_medium and sealed of the material
  LaneMask dim, opaque;     ///< light is of no use, or of none from behind
  LaneLightSamples lights;
  Vec3<Lanes> direction;  ///< of the ray
  Lanes u[3];             ///< for the bsdf

  // What the bsdf makes of it.
  Color<LaneScalar<L>> value;  ///< towards the light; derivatives only where they are ticked
  Lanes value_density;
  LaneMask goes, transmits, singular;
  Vec3<Lanes> wo;
  Lanes density;                ///< of wo
  Color<LaneScalar<L>> weight;  ///< likewise

  /// Nothing has been met yet.
  void start() {
    for (LaneMask* mask : {&scattered, &met, &medium, &sealed, &dim, &opaque, &lights.lit,
                           &lights.delta, &goes, &transmits, &singular})
      *mask = false;
    lights.source = -1;
  }
  /// See Surface.
  Vec3<Lanes> leave(const Vec3<Lanes>& towards) const {
    return position + ng * select(dot(towards, ng) < 0, -offset, offset);
  }
};

}  // namespace selenite
