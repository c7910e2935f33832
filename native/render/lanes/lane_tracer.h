// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "math/sampling.h"
#include "model/medium.h"
#include "render/lanes/lane_flight.h"
#include "render/lanes/lane_lights.h"
#include "render/lanes/lane_shading.h"
#include "render/path/dimension.h"

namespace selenite {

/// PathTracer for many paths at a time, eight in lockstep in the lanes of each packet. A path draws the
/// random numbers that it would draw alone, so both tracers render the same picture but for rounding.
/// A lane whose path has ended takes up the next one; see `start`.
template <int L>
class LaneTracer {
 public:
  /// Packets under way together: enough of them that their surface points fill most lanes of the
  /// bsdfs, few enough to stay in the nearest cache.
  static constexpr int kPackets = 8;
  static_assert(kPackets <= LaneShading<L>::kMostPackets);

  LaneTracer(const Prepared<L>& prepared, int depth)
      : p_(prepared),
        depth_(depth),
        lights_(prepared),
        shading_(prepared),
        packets_(kPackets, Paths(prepared.slots)),
        vertices_(kPackets) {
    for (const PreparedMaterial<L>& m : p_.materials)
      if (m.has_medium) medium_ = &m;
  }

  /// Puts the path of a camera ray, in lane `from`, into a lane of a packet.
  void start(int packet, int lane, const LaneCameraRays& camera, int from) {
    bool inside = false;
    if (medium_) {
      MediaStack<L> media(p_);
      media.locate(at(camera.origin, from));
      inside = !media.empty();
    }
    packets_[packet].start(lane, camera, from, inside);
    if (p_.visibility.seen_lamps && !inside)
      lights_.add_seen_lamps(lane, camera, from, packets_[packet]);
  }

  const LanePaths<L>& packet(int i) const { return packets_[i]; }
  /// Whether any path is under way.
  bool busy() const {
    return std::any_of(packets_.begin(), packets_.end(),
                       [](const Paths& p) { return any(p.live); });
  }

  /// One vertex of every path; then `ended(packet, lanes)` for those whose paths have ended.
  template <class Ended>
  void step(Ended&& ended) {
    for (int i = 0; i < kPackets; ++i) travel(packets_[i], vertices_[i]);
    shading_.shade(vertices_);
    for (int i = 0; i < kPackets; ++i) {
      Paths& paths = packets_[i];
      if (!any(paths.live)) continue;
      const LaneMask before = paths.live;
      go_on(vertices_[i], paths);
      if (const LaneMask lanes = before & !paths.live; any(lanes)) ended(i, lanes);
    }
  }

 private:
  using X = LaneScalar<L>;
  using Paths = LanePaths<L>;
  using Vertices = LaneVertices<L>;

  static constexpr float kInfinity = std::numeric_limits<float>::infinity();
  static constexpr int kRouletteStart = 4;
  static constexpr int kHardLimit = 1 << 17, kMediumLimit = 1 << 24;  // as in PathTracer
  static constexpr float kLeastCosine = 0.01f;

  /// To the next surfaces, with light sampled there, or to where the medium scatters.
  void travel(Paths& paths, Vertices& v) const {
    v.start();
    if (!any(paths.live)) return;
    paths.random.start_bounce(paths.vertex + 1);
    const LaneMask flying = paths.live & paths.inside, sealed = paths.inside | paths.sealed;
    Lanes drawn(kInfinity);
    if (any(flying))
      drawn = select(flying, draw_flight(*medium_, paths.beta.value, paths.random), drawn);
    // Nothing but the boundary is met in there: no need to look beyond the end of the flight.
    paths.t_max = select(sealed, min(paths.t_max, drawn), paths.t_max);
    const LaneMask hit = intersect(paths, v);
    const Lanes distance = select(hit, v.distance, Lanes(kInfinity));
    if (const LaneMask lit = paths.live & !paths.camera & !sealed; any(lit))
      lights_.add_lamps(lit, distance, paths);
    if (any(flying)) {
      const LaneFlight flight = fly(*medium_, flying, drawn, distance, paths.beside, paths.beta);
      paths.beside = select(flying, Lanes(0), paths.beside);
      v.scattered = flight.scatters;
      if (any(v.scattered)) scatter_in_medium(v.scattered, flight, paths);
    }
    if (const LaneMask missed = paths.live & !v.scattered & !hit; any(missed))
      lights_.add_world(missed, paths);
    v.met = paths.live & !v.scattered & hit;
    paths.surfaces = select(v.met, paths.surfaces + 1, paths.surfaces);
    if (const LaneMask over = v.met & (paths.surfaces >= kHardLimit + 1); any(over)) {
      paths.truncated |= over;
      v.met &= !over;
    }
    if (depth_ > 0) {
      v.scattered &= paths.scatterings < depth_;
      v.met &= paths.scatterings < depth_;
    }
    if (any(v.met)) {
      load_surfaces(paths, v);
      shading_.classify(v);
      lights_.sample(v.met & !v.dim, paths, v);
    }
  }

  /// The hits of all live lanes.
  LaneMask intersect(const Paths& paths, Vertices& v) const {
    const LaneMask others = paths.live & !paths.camera, camera = paths.live & paths.camera;
    if (any(others)) {
      RayPacket rays;
      store(paths.origin, rays.origin);
      store(paths.direction, rays.direction);
      store(Lanes(0), rays.t_min);
      store(paths.t_max, rays.t_max);
      p_.geometry.intersect(rays, others.bits(), false, v.hits);
    } else {
      v.hits.instance = {-1, -1, -1, -1, -1, -1, -1, -1};
    }
    for_each_lane(camera, [&](int i) {
      const HitPacket& first = paths.first;
      v.hits.instance[i] = first.instance[i], v.hits.triangle[i] = first.triangle[i];
      v.hits.b1[i] = first.b1[i], v.hits.b2[i] = first.b2[i], v.hits.t[i] = first.t[i];
    });
    v.distance = load(v.hits.t);
    const LaneMask hit = paths.live & (load(v.hits.instance) >= 0);
    return hit & !(camera & (v.distance > paths.t_max));
  }

  /// Geometry::surface of those that are met.
  void load_surfaces(const Paths& paths, Vertices& v) const {
    using Face = Geometry::Face;
    static_assert(sizeof(Face) == 24 * sizeof(float) && offsetof(Face, slot) == 21 * sizeof(float));
    const float* rows[kLanes];
    LaneMask elsewhere(false);  // instances that are not kept in world space
    const Face* any_face = nullptr;
    for_each_lane(v.met, [&](int i) {
      const Face* face = p_.geometry.face(v.hits.instance[i], v.hits.triangle[i]);
      rows[i] = reinterpret_cast<const float*>(face);
      if (face) {
        v.material.set(i, p_.geometry.instances()[v.hits.instance[i]].materials[face->slot]);
        any_face = face;
      } else {
        elsewhere.set(i, true);
      }
    });
    if (any_face) {
      for_each_lane((!v.met) | elsewhere,
                    [&](int i) { rows[i] = reinterpret_cast<const float*>(any_face); });
      Lanes f[24];
      for (int block = 0; block < 3; ++block) {
        const float* at[kLanes];
        for (int i = 0; i < kLanes; ++i) at[i] = rows[i] + 8 * block;
        transpose(at, f + 8 * block);
      }
      const Lanes b1 = load(v.hits.b1), b2 = load(v.hits.b2), b0 = Lanes(1) - b1 - b2;
      const auto mix = [&](const Lanes* c) {
        return Vec3<Lanes>{c[0] * b0 + c[3] * b1 + c[6] * b2, c[1] * b0 + c[4] * b1 + c[7] * b2,
                           c[2] * b0 + c[5] * b1 + c[8] * b2};
      };
      v.position = mix(f);
      v.ng = {f[18], f[19], f[20]};
      const Vec3<Lanes> n = mix(f + 9);
      const Lanes size = length(n);
      v.n = select(size > 0, n / size, v.ng);
      v.offset = f[22] * Geometry::kPositionError;
    }
    for_each_lane(elsewhere, [&](int i) {
      const Surface s = p_.geometry.surface(
          {v.hits.instance[i], v.hits.triangle[i], v.hits.b1[i], v.hits.b2[i], v.hits.t[i]});
      set(v.position, i, s.position);
      set(v.ng, i, s.ng);
      set(v.n, i, s.n);
      v.offset.set(i, s.offset);
      v.material.set(i, s.material);
    });
    v.back = dot(v.ng, paths.direction) > 0;
    v.direction = paths.direction;
    v.u[0] = paths.random.uniform(kLobe);
    v.u[1] = paths.random.uniform(kLobe1);
    v.u[2] = paths.random.uniform(kLobe2);
  }

  void scatter_in_medium(const LaneMask& scattered, const LaneFlight& flight, Paths& paths) const {
    const auto& anisotropy = medium_->values.anisotropy;
    const Vec3<Lanes> position = paths.origin + paths.direction * flight.length;
    const float g = value_of(anisotropy);
    const Lanes cosine = sample_henyey_greenstein(g, paths.random.uniform(kLobe1));
    const Lanes density = henyey_greenstein<Lanes>(g, cosine);
    if constexpr (L > 0)
      if (has_slope(anisotropy))
        paths.beta.multiply(scattered, *medium_,
                            Color<X>(henyey_greenstein<X>(anisotropy, cosine) / density));
    const Vec3<Lanes> turned = deflect(paths.direction, cosine, paths.random.uniform(kLobe2));
    paths.density = select(scattered, density, paths.density);
    paths.camera &= !scattered;
    paths.refracted &= !scattered;
    paths.from = select(scattered, position, paths.from);
    paths.origin = select(scattered, position, paths.origin);
    paths.direction = select(scattered, turned, paths.direction);
    paths.t_max = select(scattered, Lanes(kInfinity), paths.t_max);
  }

  /// Takes light and throughput from the surface points and sends the paths on from there.
  void go_on(const Vertices& v, Paths& paths) const {
    LaneMask going = v.scattered;
    if (any(v.met)) {
      shading_.bring(lights_, v, paths);
      shading_.attenuate(v, paths);
      leave(v, paths);
      going |= v.goes;
    }
    going = survive(going, paths);
    if (const LaneMask over = going & v.scattered & (paths.vertex >= kMediumLimit); any(over)) {
      paths.truncated |= over;
      going &= !over;
    }
    paths.live = going;
    paths.vertex = paths.vertex + 1;
  }

  static void leave(const Vertices& v, Paths& paths) {
    const Lanes cosine = dot(v.wo, v.ng);
    const LaneMask into = cosine < 0, goes = v.goes, crosses = goes & v.transmits & v.medium;
    paths.inside = (paths.inside & !crosses) | (crosses & into);
    paths.sealed = (paths.sealed & !goes) | (goes & v.sealed & into);
    paths.refracted = (paths.refracted & !goes) | (goes & v.transmits);
    paths.camera &= !goes;
    paths.density =
        select(goes, select(v.singular, Lanes(Path::kSingular), v.density), paths.density);
    paths.from = select(goes, v.position, paths.from);
    paths.beside = select(goes, v.offset / max(abs(cosine), Lanes(kLeastCosine)), paths.beside);
    paths.origin = select(goes, v.leave(v.wo), paths.origin);
    paths.direction = select(goes, v.wo, paths.direction);
    paths.t_max = select(goes, Lanes(kInfinity), paths.t_max);
  }

  /// Russian roulette; see PathTracer.
  LaneMask survive(const LaneMask& going, Paths& paths) const {
    paths.scatterings = select(going, paths.scatterings + 1, paths.scatterings);
    LaneMask at_risk = going & (paths.scatterings >= kRouletteStart);
    if (!any(at_risk)) return going;
    const Lanes importance = paths.beta.importance(p_.roulette_scales);
    at_risk &= importance < 1;
    if (!any(at_risk)) return going;
    const Lanes root = sqrt(importance), survival = root * sqrt(root);
    const LaneMask lost = at_risk & !(paths.random.uniform(kRoulette) < survival);
    paths.beta.multiply(at_risk & !lost, Lanes(1) / survival);
    return going & !lost;
  }

  const Prepared<L>& p_;
  int depth_;
  LaneLights<L> lights_;
  LaneShading<L> shading_;
  const PreparedMaterial<L>* medium_ = nullptr;  ///< the one material that has one
  std::vector<Paths> packets_;
  std::vector<Vertices> vertices_;
};

}  // namespace selenite
