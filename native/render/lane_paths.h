// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include "math/lanes.h"
#include "render/lane_light.h"
#include "render/lane_random.h"
#include "render/path.h"
#include "scene/packet.h"

namespace selenite {

// Vectors and packets lane by lane.
inline void set(Vec3<Lanes>& v, int lane, const Vec3f& x) {
  v.x.set(lane, x.x), v.y.set(lane, x.y), v.z.set(lane, x.z);
}
inline Vec3f at(const Vec3<Lanes>& v, int lane) { return {v.x[lane], v.y[lane], v.z[lane]}; }
inline Lanes load(const Packet<float>& from) {
  return Lanes(*reinterpret_cast<const Lanes::Raw*>(from.lane));
}
inline Vec3<Lanes> load3(const Packet<float>* from) {
  return {load(from[0]), load(from[1]), load(from[2])};
}
inline LaneInts load(const Packet<int>& from) {
  return LaneInts(*reinterpret_cast<const LaneInts::Raw*>(from.lane));
}
inline void store(const Lanes& x, Packet<float>& to) {
  *reinterpret_cast<Lanes::Raw*>(to.lane) = x.v;
}
inline void store(const Vec3<Lanes>& v, Packet<float>* to) {
  store(v.x, to[0]), store(v.y, to[1]), store(v.z, to[2]);
}

/// Eight paths and what they carry; see Path. `travelled` is left out: nothing is transparent.
template <int L>
struct LanePaths {
  LaneMask live{false};
  LaneRandom random;
  Vec3<Lanes> origin, direction, from;
  Lanes t_max;
  Lanes density;  ///< of the direction, per solid angle
  Lanes beside;   ///< from the surface that the ray has left to its origin, along the ray
  LaneMask camera, refracted, sealed;  ///< as camera_ray, refracted and sealed of Path
  LaneMask inside;                     ///< of the medium
  LaneMask truncated;                  ///< see PathTracer
  LaneInts vertex, scatterings, surfaces;
  HitPacket first;  ///< of the camera rays
  LaneThroughput<L> beta;
  LaneRadiance<L> radiance;

  explicit LanePaths(int slots) : beta(slots), radiance(slots) {}

  void start(int lane, const Random& numbers, const Ray& ray, const std::optional<Hit>& hit,
             bool is_inside) {
    first.instance[lane] = -1;
    if (hit) {
      first.instance[lane] = hit->instance, first.triangle[lane] = hit->triangle;
      first.b1[lane] = hit->b1, first.b2[lane] = hit->b2, first.t[lane] = hit->t;
    }
    random.start(lane, numbers);
    set(origin, lane, ray.origin);
    set(direction, lane, ray.direction);
    set(from, lane, {});
    t_max.set(lane, ray.t_max);
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
