// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <limits>
#include <vector>

#include "math/sampling.h"
#include "render/lanes/lane_paths.h"
#include "render/path/dimension.h"
#include "scene/area_light.h"

namespace selenite {

/// Lamps and the world for eight paths.
template <int L>
class LaneLights {
 public:
  using Paths = LanePaths<L>;

  explicit LaneLights(const Prepared<L>& prepared) : p_(prepared) {
    for (int i = 0; i < p_.lights.world_source(); ++i)
      emitted_.push_back(i < p_.lights.mesh_source() ? p_.emitted.lamp(i, 1) : Factor<L>{});
    emitted_.push_back(p_.emitted.world({1, 1, 1}));
    for (int i = 0; i <= p_.lights.world_source(); ++i)
      if (p_.lights.probability(i) == 1) only_ = i;
    const World& world = p_.scene.appearance.world;
    camera_sees_world_ = (world.visible_to & kCameraRay) && !world.transparent_film;
    backdrop_ = world.backdrop(kCameraRay);
  }
  /// By a lamp (its index) or the world, for a shape of 1.
  const Factor<L>& emitted(int source) const { return emitted_[source]; }

  /// Radiance of lamps that the paths' rays meet on the way to what they hit.
  void add_lamps(const LaneMask& lit, const Lanes& reach, Paths& paths) const {
    const auto& lights = p_.scene.appearance.lights;
    for (const int i : p_.lamps) {
      if (lights[i].is_delta()) continue;
      LaneMask met(false);
      Lanes factor, light;
      if (lights[i].kind == LightKind::kArea) {
        const auto hit = intersect_area(lights[i], paths.from, paths.direction, Lanes(0), reach);
        met = lit & hit.exists & (hit.factor > 0);
        factor = hit.factor;
        light = hit.density * probability(i, paths.refracted);
      } else {
        for_each_lane(lit, [&](int k) {
          const auto hit =
              lights[i].intersect(at(paths.from, k), at(paths.direction, k), 0, reach[k]);
          if (!hit || !(hit->factor > 0)) return;
          met.set(k, true);
          factor.set(k, hit->factor);
          light.set(k, p_.lights.lamp_density(i, *hit, paths.refracted[k]));
        });
      }
      if (any(met)) add(met, i, Color<Lanes>(factor), light, paths);
    }
  }

  /// Radiance of lamps that the camera ray in lane `from`, whose path is in `lane`, meets before
  /// anything else.
  void add_seen_lamps(int lane, const LaneCameraRays& rays, int from, Paths& paths) const {
    const auto& lights = p_.scene.appearance.lights;
    const bool hit = rays.hits.instance[from] >= 0 && rays.hits.t[from] <= rays.t_max[from];
    LaneMask met(false);
    met.set(lane, true);
    for (const int i : p_.lamps) {
      if (!(lights[i].visible_to & kCameraRay)) continue;
      const float end = hit                     ? rays.hits.t[from]
                        : lights[i].has_place() ? rays.t_max[from]
                                                : kInfinity;
      const auto seen = lights[i].intersect(at(rays.origin, from), at(rays.direction, from),
                                            rays.t_min[from], end);
      if (seen && seen->factor > 0) add(met, i, Color<Lanes>(Lanes(seen->factor)), Lanes(0), paths);
    }
  }

  void add_world(LaneMask missed, Paths& paths) const {
    const World& world = p_.scene.appearance.world;
    if (!camera_sees_world_) missed &= !paths.camera;
    if (backdrop_ && world.on) {
      add_backdrop(missed & paths.camera, paths);
      missed &= !paths.camera;
    }
    if (!world.on || !any(missed)) return;
    Color<Lanes> shape(Lanes(1));
    Lanes light(0);
    if (world.map)
      for_each_lane(missed, [&](int k) {
        const Vec3f direction = at(paths.direction, k);
        const Colorf c = world.factor(direction);
        for (int i = 0; i < 3; ++i) shape[i].set(k, c[i]);
        if (!paths.camera[k]) light.set(k, p_.lights.world_density(direction, paths.refracted[k]));
      });
    add(missed, p_.lights.world_source(), shape, light, paths);
  }

  /// A light for each surface point that wants one, as far as it is seen from there.
  void sample(const LaneMask& wanted, const Paths& paths, LaneVertices<L>& v) const {
    LaneLightSamples& s = v.lights;
    if (!any(wanted)) return;
    const Lanes u = paths.random.uniform(kLightChoice);
    if (only_ >= 0)
      s.source = only_;
    else
      for_each_lane(wanted, [&](int i) {
        const auto choice = p_.lights.choose(u[i]);
        if (choice.source != LightSampler::Source::kNone) s.source.set(i, choice.index);
      });
    const Lanes u1 = paths.random.uniform(kLight1), u2 = paths.random.uniform(kLight2);
    for (LaneMask left = wanted & (s.source >= 0); any(left);) {
      const int source = s.source[std::countr_zero(left.bits())];
      const LaneMask lanes = left & (s.source == source);
      left &= !lanes;
      sample_light(source, lanes, v, u1, u2, s);
    }
    if (!any(s.lit)) return;
    const Lanes cosine = dot(s.direction, v.ng);
    const LaneMask into = cosine < 0, inside = (v.medium & into) | (paths.inside & !v.medium);
    s.lit &= !inside & !(v.sealed & into) & !(v.opaque & (into ^ v.back));
    if (!any(s.lit)) return;
    RayPacket rays;
    store(v.leave(s.direction), rays.origin);
    store(s.direction, rays.direction);
    store(Lanes(0), rays.t_min);
    store(s.distance, rays.t_max);
    const unsigned hidden = p_.geometry.occluded(rays, s.lit.bits());
    for_each_lane(s.lit, [&](int i) {
      if (hidden >> i & 1) s.lit.set(i, false);
    });
  }

 private:
  static constexpr float kInfinity = std::numeric_limits<float>::infinity();

  /// What the camera sees in place of the world.
  void add_backdrop(const LaneMask& missed, Paths& paths) const {
    if (!any(missed)) return;
    Color<Lanes> shape(Lanes(0));
    for_each_lane(missed, [&](int k) {
      const Colorf c = backdrop_->factor(at(paths.direction, k));
      for (int i = 0; i < 3; ++i) shape[i].set(k, c[i]);
    });
    const Factor<L> alone{Colorf(1)};
    add(missed, backdrop_->scaled ? emitted_[p_.lights.world_source()] : alone, shape, Lanes(0),
        paths);
  }

  void add(const LaneMask& met, int source, const Color<Lanes>& shape, const Lanes& light,
           Paths& paths) const {
    add(met, emitted_[source], shape, light, paths);
  }
  /// Radiance that a ray has met, which light sampling would have met with density `light`.
  void add(const LaneMask& met, const Factor<L>& emitted, const Color<Lanes>& shape,
           const Lanes& light, Paths& paths) const {
    // Of a direction that cannot be met by chance all of it counts.
    const Lanes weight = select((paths.density == kInfinity) | !(light > 0), Lanes(1),
                                power_heuristic(paths.density, light));
    const Color<Lanes> w = masked(met, shape * weight, 0);
    paths.radiance.add(paths.beta, w * lanes_of(emitted.value));
    paths.radiance.add_slopes(emitted, paths.beta.value * w);
  }

  /// Directions to one lamp or the world.
  void sample_light(int source, const LaneMask& lanes, const LaneVertices<L>& v, const Lanes& u1,
                    const Lanes& u2, LaneLightSamples& s) const {
    const bool is_world = source == p_.lights.world_source();
    const auto through = [&] { return (dot(v.ng, s.direction) < 0) ^ v.back; };
    if (!is_world && p_.scene.appearance.lights[source].kind == LightKind::kArea) {
      const auto lamp = sample_area(p_.scene.appearance.lights[source], v.position, u1, u2);
      s.direction = select(lanes, lamp.direction, s.direction);
      s.distance = select(lanes, lamp.distance, s.distance);
      s.density = select(lanes, lamp.density * p_.lights.probability(source), s.density);
      s.heuristic = select(lanes, lamp.density * probability(source, through()), s.heuristic);
      s.shape = select(lanes, Color<Lanes>(lamp.factor), s.shape);
      s.lit |= lanes & lamp.exists & (s.density > 0) & (s.heuristic > 0);
      return;
    }
    for_each_lane(lanes, [&](int i) {
      LightSample found{{}, kInfinity, 0, 1, false};
      Colorf shape{1, 1, 1};
      if (is_world) {
        const World& world = p_.scene.appearance.world;
        found.direction = world.sample(u1[i], u2[i], found.density);
        shape = world.factor(found.direction);
      } else {
        const Light& lamp = p_.scene.appearance.lights[source];
        const auto sample = lamp.sample(at(v.position, i), u1[i], u2[i]);
        if (!sample) return;
        found = *sample;
        shape = Colorf(found.factor);
      }
      const bool refracted = (dot(at(v.ng, i), found.direction) < 0) != v.back[i];
      const float density = found.density * p_.lights.probability(source);
      const float heuristic = is_world ? p_.lights.world_density(found.direction, refracted)
                                       : found.density * p_.lights.probability(source, refracted);
      if (!(density > 0) || !(heuristic > 0)) return;
      set(s.direction, i, found.direction);
      s.distance.set(i, found.distance);
      s.density.set(i, density);
      s.heuristic.set(i, heuristic);
      s.delta.set(i, found.delta);
      for (int c = 0; c < 3; ++c) s.shape[c].set(i, shape[c]);
      s.lit.set(i, true);
    });
  }

  Lanes probability(int source, const LaneMask& refracted) const {
    return select(refracted, Lanes(p_.lights.probability(source, true)),
                  p_.lights.probability(source));
  }

  const Prepared<L>& p_;
  std::vector<Factor<L>> emitted_;
  bool camera_sees_world_ = true;
  const Backdrop* backdrop_ = nullptr;  ///< null: the camera sees the world that lights
  int only_ = -1;                       ///< the one that is looked for, if there is one
};

}  // namespace selenite
