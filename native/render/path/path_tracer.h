// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <limits>

#include "math/rng.h"
#include "math/sampling.h"
#include "render/media/random_walk.h"
#include "render/media/scatterer.h"
#include "render/path/dimension.h"
#include "render/path/path.h"
#include "render/prepared/prepared.h"

namespace selenite {

/// Unidirectional path tracer with next-event estimation, multiple importance sampling (power
/// heuristic) and Russian roulette. Values and derivatives in one pass: every factor of the path is
/// evaluated once with dual numbers; directions, densities and probabilities are plain numbers
/// ("detached" sampling), so f and df share a denominator and both estimates are unbiased.
template <int L>
class PathTracer {
 public:
  PathTracer(const Prepared<L>& prepared, int depth) : p_(prepared), depth_(depth) {}

  /// One sample of the radiance that arrives along a camera ray, which meets `first`.
  Radiance<L> trace(const Ray& ray, const std::optional<Hit>& first, Random& random) {
    Radiance<L> radiance(p_.slot_room);
    Throughput<L> beta(p_.slot_room);
    Path path{.ray = ray};
    MediaStack<L> media(p_);
    if (p_.any_medium) media.locate(path.ray.origin);
    truncated = false;
    if constexpr (L == kTaped) {
      tape.clear();
      beta.tape = &tape;
    }

    std::uint32_t surfaces = 0;
    for (std::uint32_t vertex = 0;; ++vertex) {
      random.start_bounce(vertex + 1);
      float drawn = kInfinity;
      const bool sealed = path.sealed || media.sealed();
      if (!media.empty())
        drawn = media.draw(random.uniform(kFreeChannel), random.uniform(kFreePath), beta);
      // Nothing but the boundary is met in there: no need to look beyond the end of the flight.
      if (sealed) path.ray.t_max = std::min(path.ray.t_max, drawn);
      auto hit = vertex == 0 ? first : p_.geometry.intersect(path.ray, path.camera_ray);
      if (vertex == 0 && hit && hit->t > path.ray.t_max) hit.reset();
      const float reach = hit ? path.travelled + hit->t : kInfinity;
      if (!path.camera_ray && !sealed)
        add_lamps(path.from, path.ray.direction, path.travelled, reach, path.density,
                  path.refracted, media, random, beta, radiance);
      if (!media.empty()) {
        const float distance = hit ? hit->t : kInfinity;
        const bool scatters_once_more = depth_ == 0 || path.scatterings < depth_;
        const bool lit = scatters_once_more && !sealed;
        if (lit) add_lamp_along(path.ray, distance, media, random, beta, radiance);
        const auto flight =
            media.fly(path.ray, drawn, distance, random.uniform(kMedium), random, kFlight, beta);
        if (flight.scatterer) {
          if (!scatters_once_more) return radiance;
          const PreparedMaterial<L>& medium = *flight.scatterer;
          path.from = path.ray.origin + path.ray.direction * flight.length;
          if (lit) {
            const PhaseScatterer<L> here{medium,    path.ray.direction, path.from,
                                         &path.ray, distance,           flight};
            add_light_sample(path.from, here, media, random, beta, radiance);
          }
          const float g = value_of(medium.values.anisotropy);
          const float cosine = sample_henyey_greenstein(g, random.uniform(kLobe1));
          path.density = henyey_greenstein(g, cosine);
          beta.multiply(medium.factor(
              Color<Scalar>(henyey_greenstein(medium.values.anisotropy, cosine) / path.density)));
          if (!survives(++path.scatterings, random, beta)) return radiance;
          if (vertex >= kMediumLimit) break;
          path.camera_ray = path.refracted = false;
          path.travelled = 0;
          path.ray = {path.from, deflect(path.ray.direction, cosine, random.uniform(kLobe2)), 0,
                      kInfinity};
          continue;
        }
      }
      if (!hit) {
        add_world(path.ray, path.camera_ray, path.density, path.refracted, beta, radiance);
        return radiance;
      }
      if (++surfaces > kHardLimit) break;
      const Surface surface = p_.geometry.surface(*hit);
      const PreparedMaterial<L>& material = p_.materials[surface.material];
      if (material.plain) {
        const PrincipledBsdf<float> bsdf(material.plain_values, material.flavour,
                                         point(surface, -path.ray.direction, path.after_diffuse));
        if (!scatter(*hit, surface, material, material.plain_values, bsdf, random, vertex, media,
                     beta, radiance, path))
          return radiance;
        continue;
      }
      typename PreparedMaterial<L>::Room room;
      const Principled<Scalar>& values = material.at(p_.geometry, *hit, room);
      const PrincipledBsdf<Scalar> bsdf(values, material.flavour,
                                        point(surface, -path.ray.direction, path.after_diffuse));

      if (material.emissive) {
        const Vec3f d = surface.position - path.from;
        const float light =
            path.camera_ray ? 0 : p_.lights.mesh_density(surface, d, path.refracted);
        radiance.add(beta, material.factor(bsdf.emission()), bsdf_weight(path.density, light));
      }

      if (material.transparent && pass_through(material, bsdf, random, beta)) {
        media.cross(*hit, surface, path.ray.direction);
        media.leave(surface, path.ray.direction);
        // The ray goes on as if nothing had been there; its density stays that of its origin.
        path.ray = {surface.leave(path.ray.direction), path.ray.direction, 0, kInfinity};
        path.travelled = reach;
        continue;
      }
      if (!scatter(*hit, surface, material, values, bsdf, random, vertex, media, beta, radiance,
                   path))
        return radiance;
    }
    truncated = true;
    return radiance;
  }

  bool truncated = false;  ///< the last path ran into the hard limit on its length
  Tape tape;               ///< of the last path, in the kernel that keeps one

 private:
  using Scalar = PathScalar<L>;
  using Source = LightSampler::Source;

  static constexpr float kInfinity = std::numeric_limits<float>::infinity();
  static constexpr float kSingular = Path::kSingular;
  static constexpr int kRouletteStart = 4;
  static constexpr std::uint32_t kHardLimit = 1 << 17;    // light caught inside smooth glass
  static constexpr std::uint32_t kMediumLimit = 1 << 24;  // a dense white medium needs millions

  /// Lights a surface point and sends the path on from there; false if it ends. X: float where the
  /// material has no parameter that is differentiated.
  template <class X>
  bool scatter(const Hit& hit, Surface surface, const PreparedMaterial<L>& material,
               const Principled<X>& values, const PrincipledBsdf<X>& bsdf, Random& random,
               std::uint32_t& vertex, MediaStack<L>& media, Throughput<L>& beta,
               Radiance<L>& radiance, Path& path) const {
    if (depth_ > 0 && path.scatterings >= depth_) return false;

    if (!bsdf.all_singular())
      add_light_sample(surface.position, SurfaceScatterer<L, X>{hit, surface, material, bsdf},
                       media, random, beta, radiance);

    auto sample = draw(bsdf, random);
    if (!sample) return false;
    material.attenuate(p_.geometry, hit, sample->weight, beta);
    if constexpr (std::is_same_v<X, Scalar>) {
      if (sample->enters) {
        const SubsurfaceMedium<X> medium(values, material.flavour, bsdf.entry_eta());
        const auto exit = RandomWalk<X>(medium).run(p_.geometry, hit.instance, surface, sample->wo,
                                                    random, kWalk);
        if (!exit) return false;
        beta.multiply(material.factor(exit->weight));
        // Lit and left as if a path.ray path.from outside had met it.
        random.start_bounce(++vertex + 1);
        surface = p_.geometry.surface(exit->hit);
        const PrincipledBsdf<Scalar> out(p_.exit.values, p_.exit.flavour,
                                         point(surface, exit->direction));
        add_light_sample(surface.position, SurfaceScatterer<L, X>{exit->hit, surface, p_.exit, out},
                         media, random, beta, radiance);
        sample = draw(out, random);
        if (!sample) return false;
        beta.multiply(p_.exit.factor(sample->weight));
      }
    }
    if (sample->transmits) media.cross(hit, surface, sample->wo);
    path.after_diffuse = path.after_diffuse || sample->diffuse;
    if (!survives(++path.scatterings, random, beta)) return false;
    path.density = sample->singular ? kSingular : sample->density;
    path.refracted = sample->transmits;
    path.camera_ray = false;
    path.from = surface.position;
    path.travelled = 0;
    path.sealed = material.sealed && dot(sample->wo, surface.ng) < 0;
    media.leave(surface, sample->wo);
    path.ray = {surface.leave(sample->wo), sample->wo, 0, kInfinity};
    return true;
  }

  static SurfacePoint<float> point(const Surface& s, const Vec3f& wi, bool after_diffuse = false) {
    const bool back = dot(s.ng, wi) < 0;
    return {back ? -s.ng : s.ng, back ? -s.n : s.n, wi, back, after_diffuse};
  }
  /// Russian roulette. A power below 1 keeps more of the dim paths than their share.
  bool survives(int scatterings, const Random& random, Throughput<L>& beta) const {
    if (scatterings < kRouletteStart) return true;
    const float importance = beta.importance(p_.roulette_scales);
    if (importance >= 1) return true;
    const float root = std::sqrt(importance), survival = root * std::sqrt(root);
    if (!(random.uniform(kRoulette) < survival)) return false;
    beta.multiply(1 / survival);
    return true;
  }
  template <class X>
  static auto draw(const PrincipledBsdf<X>& bsdf, const Random& random) {
    return bsdf.sample(random.uniform(kLobe), random.uniform(kLobe1), random.uniform(kLobe2));
  }

  /// MIS weight of a direction that the bsdf chose, where light sampling has density `light`.
  static float bsdf_weight(float density, float light) {
    return density == kSingular || !(light > 0) ? 1 : power_heuristic(density, light);
  }

  void add_lamps(const Vec3f& from, const Vec3f& direction, float t_min, float t_max, float density,
                 bool refracted, const MediaStack<L>& media, const Random& random,
                 const Throughput<L>& beta, Radiance<L>& radiance) const {
    const auto& lights = p_.scene.appearance.lights;
    for (int i = 0; i < static_cast<int>(lights.size()); ++i) {
      const auto hit = lights[i].intersect(from, direction, t_min, t_max);
      if (!hit || !(hit->factor > 0)) continue;
      const float weight = bsdf_weight(density, p_.lights.lamp_density(i, *hit, refracted));
      if (media.empty()) {
        radiance.add(beta, p_.emitted.lamp(i, hit->factor), weight);
      } else {
        Throughput<L> through = beta.branch();
        const Ray start{from + direction * t_min, direction, 0, kInfinity};
        media.attenuate(start, hit->distance - t_min, random, kToLamp + i, through);
        radiance.add(through, p_.emitted.lamp(i, hit->factor), weight);
      }
    }
  }

  void add_world(const Ray& ray, bool camera_ray, float density, bool refracted,
                 const Throughput<L>& beta, Radiance<L>& radiance) const {
    const World& world = p_.scene.appearance.world;
    const float light = camera_ray ? 0 : p_.lights.world_density(ray.direction, refracted);
    radiance.add(beta, p_.emitted.world(world.factor(ray.direction)), bsdf_weight(density, light));
  }

  /// Decides whether the ray passes straight through; either way `beta` takes the factor.
  bool pass_through(const PreparedMaterial<L>& material, const PrincipledBsdf<Scalar>& bsdf,
                    const Random& random, Throughput<L>& beta) const {
    const auto transparency = bsdf.transparency();
    float probability = mean_channel(value_of(transparency));
    // A derivative with respect to alpha needs both events at either end of its range.
    if (has_slope(transparency)) probability = clamp(probability, 0.1f, 0.9f);
    if (!(probability > 0)) return false;
    if (random.uniform(kPass) < probability) {
      beta.multiply(material.factor(transparency));
      beta.multiply(1 / probability);
      return true;
    }
    beta.multiply(1 / (1 - probability));
    return false;
  }

  /// Unoccluded part of the way to a light: the throughput after all transparent surfaces and media.
  bool visible(const Vec3f& origin, const Vec3f& direction, float distance, const Random& random,
               MediaStack<L>& media, Throughput<L>& beta) const {
    Ray ray{origin, direction, 0, distance};
    if (!p_.any_transparent) {
      if (p_.geometry.occluded(ray)) return false;
      media.attenuate(ray, distance, random, kShadow, beta);
      return beta.importance() > 0;
    }
    for (std::uint32_t i = 0; i < kHardLimit; ++i) {
      const auto hit = p_.geometry.intersect(ray, false);
      if (!hit) {
        media.attenuate(ray, ray.t_max, random, kShadow + i, beta);
        return beta.importance() > 0;
      }
      const Surface s = p_.geometry.surface(*hit);
      const PreparedMaterial<L>& material = p_.materials[s.material];
      if (!material.transparent) return false;
      media.attenuate(ray, hit->t, random, kShadow + i, beta);
      media.cross(*hit, s, direction);
      typename PreparedMaterial<L>::Room room;
      const PrincipledBsdf<Scalar> bsdf(material.at(p_.geometry, *hit, room), material.flavour,
                                        point(s, -direction));
      beta.multiply(material.factor(bsdf.transparency()));
      if (!(beta.importance() > 0)) return false;
      const Vec3f next = s.leave(direction);
      const float left =
          distance == kInfinity ? kInfinity : ray.t_max - dot(next - ray.origin, direction);
      ray = {next, direction, 0, left};
      if (!(left > 0)) return true;
    }
    return false;
  }

  /// Light of a lamp that a medium scatters towards the ray's origin, from a place drawn for that
  /// lamp: free flights seldom end where a lamp is close.
  void add_lamp_along(const Ray& ray, float distance, const MediaStack<L>& media,
                      const Random& random, const Throughput<L>& beta,
                      Radiance<L>& radiance) const {
    const auto choice = p_.lights.choose(random.uniform(kAlongChoice));
    if (choice.source != Source::kLamp) return;
    const Light& lamp = p_.scene.appearance.lights[choice.index];
    if (!lamp.has_place()) return;
    const Equiangular along(ray.origin, ray.direction, distance, lamp.position);
    if (!along) return;
    const float t = along.sample(random.uniform(kAlong));
    const float density = along.density(t);
    const Vec3f position = ray.origin + ray.direction * t;
    const auto s = lamp.sample(position, random.uniform(kAlong1), random.uniform(kAlong2));
    if (!s || !(s->density > 0) || !(density > 0)) return;
    const float share = power_heuristic(density, media.density(t, beta));
    Throughput<L> through = beta.branch();
    media.attenuate_from_surface(ray, t, random, kAlongGrids, through);
    const PreparedMaterial<L>& medium =
        media.scatter(position, random.uniform(kAlongMedium), through);
    const Scalar phase =
        henyey_greenstein(medium.values.anisotropy, dot(ray.direction, s->direction));
    MediaStack<L> beyond = media;
    if (!visible(position, s->direction, s->distance, random, beyond, through)) return;
    const float light = s->density * choice.probability;
    const float weight = s->delta ? 1 : power_heuristic(light, value_of(phase));
    radiance.add(through, medium.factor(Color<Scalar>(phase)),
                 p_.emitted.lamp(choice.index, s->factor), share * weight / (light * density));
  }

  template <class Scatterer>
  void add_light_sample(const Vec3f& position, const Scatterer& scatterer,
                        const MediaStack<L>& media, const Random& random, const Throughput<L>& beta,
                        Radiance<L>& radiance) const {
    const auto choice = p_.lights.choose(random.uniform(kLightChoice));
    if (choice.source == Source::kNone) return;
    const float u1 = random.uniform(kLight1), u2 = random.uniform(kLight2);
    Vec3f direction;
    float distance = kInfinity, density = 0;
    float heuristic = 0;  // the density that enters the weight
    float share = 1;      // of this way to draw the position
    bool delta = false;
    Factor<L> emitted;
    switch (choice.source) {
      case Source::kLamp: {
        const Light& lamp = p_.scene.appearance.lights[choice.index];
        const auto s = lamp.sample(position, u1, u2);
        if (!s) return;
        share = scatterer.share(lamp);
        direction = s->direction;
        distance = s->distance;
        delta = s->delta;
        density = s->density * choice.probability;
        heuristic = s->density * p_.lights.probability(choice.index, scatterer.refracts(direction));
        emitted = p_.emitted.lamp(choice.index, s->factor);
        break;
      }
      case Source::kWorld: {
        const World& world = p_.scene.appearance.world;
        direction = world.sample(u1, u2, density);
        density *= choice.probability;
        heuristic = p_.lights.world_density(direction, scatterer.refracts(direction));
        emitted = p_.emitted.world(world.factor(direction));
        break;
      }
      case Source::kMesh: {
        const auto& t = p_.lights.choose_triangle(random.uniform(kTriangle));
        const float root = std::sqrt(u1);
        const Hit on{t.instance, t.triangle, root * (1 - u2), root * u2, 0};
        const Surface target = p_.geometry.surface(on);
        const Vec3f d = target.position - position;
        const float distance2 = dot(d, d);
        if (!(distance2 > 0)) return;
        direction = d / std::sqrt(distance2);
        // Stop short of the emitter itself.
        distance = std::sqrt(distance2) * (1 - 1e-4f);
        const PreparedMaterial<L>& source = p_.materials[t.material];
        density = p_.lights.mesh_density(target, d, false);
        heuristic = p_.lights.mesh_density(target, d, scatterer.refracts(direction));
        typename PreparedMaterial<L>::Room room;
        const PrincipledBsdf<Scalar> there(source.at(p_.geometry, on, room), source.flavour,
                                           point(target, -direction));
        emitted = source.factor(there.emission());
        break;
      }
      case Source::kNone:
        return;
    }
    if (!(density > 0) || !(heuristic > 0)) return;
    MediaStack<L> beyond = media;
    scatterer.cross(beyond, direction);
    if (scatterer.seals(direction) || beyond.sealed()) return;

    Color<typename Scatterer::Number> value;
    float bsdf_density = 0;
    scatterer.evaluate(direction, value, bsdf_density);
    if (max_channel(value_of(value)) == 0 && !has_slope(value)) return;
    Throughput<L> through = beta.branch();
    if (!visible(scatterer.origin(direction), direction, distance, random, beyond, through)) return;
    const float weight = delta ? 1 : power_heuristic(heuristic, bsdf_density);
    scatterer.bring(p_.geometry, value, emitted, share * weight / density, through, radiance);
  }

  const Prepared<L>& p_;
  int depth_;
};

}  // namespace selenite
