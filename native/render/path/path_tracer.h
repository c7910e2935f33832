// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <limits>

#include "math/rng.h"
#include "math/sampling.h"
#include "render/media/random_walk.h"
#include "render/path/refracted_light.h"

namespace selenite {

/// Unidirectional path tracer with next-event estimation, multiple importance sampling (power
/// heuristic) and Russian roulette. Values and derivatives in one pass: every factor of the path is
/// evaluated once with dual numbers; directions, densities and probabilities are plain numbers
/// ("detached" sampling), so f and df share a denominator and both estimates are unbiased.
template <int L>
class PathTracer {
 public:
  PathTracer(const Prepared<L>& prepared, int depth, const PixelCamera& camera)
      : p_(prepared),
        depth_(depth),
        camera_(camera),
        place_(CameraPlace::of(camera.camera())),
        direct_(prepared, place_),
        refracted_(prepared, place_) {}
  PathTracer(const PathTracer&) = delete;  // members refer to `place_`
  PathTracer& operator=(const PathTracer&) = delete;

  /// One sample of the radiance that arrives along a camera ray, which meets `first`.
  Radiance<L> trace(const Ray& ray, const std::optional<Hit>& first, Random& random) {
    Radiance<L> radiance(p_.slot_room);
    Throughput<L> beta(p_.slot_room);
    Path path;
    path.ray = ray;
    path.from = ray.origin;
    path.near = ray.t_min;
    if (p_.any_bump) measure_pixel(path);
    MediaStack<L> media(p_);
    if (p_.any_medium) media.locate(path.ray.origin);
    truncated = false;
    if constexpr (is_taped(L)) {
      tape.clear();
      beta.tape = &tape;
    }

    std::uint32_t surfaces = 0;
    for (std::uint32_t vertex = 0;; ++vertex) {
      vertices = vertex + 1;
      random.start_bounce(vertex + 1);
      float drawn = kInfinity;
      const bool sealed = path.sealed || media.sealed();
      if (!media.empty())
        drawn = media.draw(random.uniform(kFreeChannel), random.uniform(kFreePath), beta);
      // Nothing but the boundary is met in there: no need to look beyond the end of the flight.
      if (sealed) path.ray.t_max = std::min(path.ray.t_max, drawn);
      auto hit = vertex == 0 ? first : p_.geometry.intersect(path.ray, path.kind);
      if (vertex == 0 && hit && hit->t > path.ray.t_max) hit.reset();
      const float reach = hit ? path.travelled + hit->t : kInfinity;
      if ((!path.from_camera() || p_.visibility.seen_lamps) && !sealed)
        refracted_.noting(radiance, [&](Rarity& rarity) {
          direct_.add_lamps(path, reach, media, random, beta, radiance,
                            [&](int lamp, const LightHit& found) {
                              return rarity.of_share(weight_of_way_out(path, lamp, found));
                            });
        });
      if (!media.empty()) {
        const float distance = hit ? hit->t : kInfinity;
        const bool scatters_once_more = depth_ == 0 || path.scatterings < depth_;
        const bool lit = scatters_once_more && !sealed;
        if (lit) direct_.add_lamp_along(path, distance, media, random, beta, radiance);
        const auto flight =
            media.fly(path.ray, drawn, distance, random.uniform(kMedium), random, kFlight, beta);
        if (flight.scatterer) {
          if (!scatters_once_more) return radiance;
          const PreparedMaterial<L>& medium = *flight.scatterer;
          path.from = path.ray.origin + path.ray.direction * flight.length;
          path.receiver = media.object();
          const PhaseScatterer<L> here{medium, path.ray.direction, path.from, &path.ray, distance,
                                       flight, path.receiver};
          if (lit) direct_.add_sample(path, path.from, here, media, random, beta, radiance);
          path.left.through = false;
          const bool sought = seeks_lamps(path, media);
          if (sought)
            refracted_.add_sample(InnerVertex{path, path.from, here, media, random}, beta,
                                  radiance);
          const float g = value_of(medium.values.anisotropy);
          const float cosine = sample_henyey_greenstein(g, random.uniform(kLobe1));
          path.density = henyey_greenstein(g, cosine);
          beta.multiply(medium.factor(
              Color<Scalar>(henyey_greenstein(medium.values.anisotropy, cosine) / path.density)));
          path.inside = {sought, path.from, path.density, mean_channel(media.rates()),
                         media.object()};
          if (!survives(++path.scatterings, random, beta)) return radiance;
          if (vertex >= kMediumLimit) break;
          path.kind = kScatterRay;
          path.facts.kinds = kScatterRay;
          path.facts.singular = false;
          path.length += path.travelled + flight.length;
          path.refracted = path.on_film = false;
          path.travelled = path.near = 0;
          path.ray = {path.from, deflect(path.ray.direction, cosine, random.uniform(kLobe2)), 0,
                      kInfinity};
          continue;
        }
      }
      if (!hit) {
        direct_.add_world(path, beta, radiance);
        return radiance;
      }
      if (++surfaces > kHardLimit) break;
      const Surface surface = p_.geometry.surface(*hit);
      const PreparedMaterial<L>& material = p_.materials[surface.material];
      const bool held_out = p_.visibility.holdouts && is_held_out(path, *hit);
      if (held_out && !material.transparent) return radiance;
      if (material.plain) {
        const PrincipledBsdf<float> bsdf(material.plain_values, material.flavour,
                                         point(surface, -path.ray.direction, path.after_diffuse));
        if (!scatter(*hit, surface, material, material.plain_values, bsdf, random, vertex, media,
                     beta, radiance, path))
          return radiance;
        continue;
      }
      const auto meet = [&](const auto& values, const auto& bsdf) {
        if (material.emissive && !held_out)
          add_emission(path, *hit, surface, material.factor(bsdf.emission()), beta, radiance);

        if (material.transparent && pass_through(material, *hit, bsdf, random, beta)) {
          media.cross(*hit, surface, path.ray.direction);
          media.leave(surface, path.ray.direction);
          // The ray goes on as if nothing had been there; its density stays that of its origin.
          path.ray = {surface.leave(path.ray.direction), path.ray.direction, 0, kInfinity};
          path.travelled = reach;
          ++path.facts.transparent_depth;
          return true;
        }
        return !held_out && scatter(*hit, surface, material, values, bsdf, random, vertex, media,
                                    beta, radiance, path);
      };
      if (material.shader) {
        const SurfaceBsdf<Scalar> bsdf =
            material.shader->bsdf(seen(path, *hit, surface), path.after_diffuse, room_);
        if (!meet(material.shader, bsdf)) return radiance;
        continue;
      }
      typename PreparedMaterial<L>::Room room;
      const Principled<Scalar>& values = material.at(p_.geometry, *hit, room);
      const PrincipledBsdf<Scalar> bsdf(values, material.flavour,
                                        point(surface, -path.ray.direction, path.after_diffuse));
      if (!meet(values, bsdf)) return radiance;
    }
    truncated = true;
    return radiance;
  }

  bool truncated = false;      ///< the last path ran into the hard limit on its length
  std::uint32_t vertices = 0;  ///< of the last path
  /// Places on surfaces that all paths looked at on their way to lamps; see RefractedLight.
  std::int64_t exits() const { return refracted_.exits(); }
  void note_excess(AimExcess<L>* excess) { refracted_.note_excess(excess); }
  Tape tape;  ///< of the last path, in the kernel that keeps one

 private:
  using Scalar = PathScalar<L>;
  using ShaderOf = std::shared_ptr<const PreparedShader<Scalar>>;

  static constexpr float kInfinity = std::numeric_limits<float>::infinity();
  static constexpr float kSingular = Path::kSingular;
  static constexpr int kRouletteStart = 4;
  static constexpr std::uint32_t kHardLimit = 1 << 17;    // light caught inside smooth glass
  static constexpr std::uint32_t kMediumLimit = 1 << 24;  // a dense white medium needs millions

  /// Lights a surface point and sends the path on from there; false if it ends. X: float where the
  /// material has no parameter that is differentiated.
  template <class Values, class Bsdf>
  bool scatter(const Hit& hit, Surface surface, const PreparedMaterial<L>& material,
               const Values& values, const Bsdf& bsdf, Random& random, std::uint32_t& vertex,
               MediaStack<L>& media, Throughput<L>& beta, Radiance<L>& radiance, Path& path) const {
    if (depth_ > 0 && path.scatterings >= depth_) return false;

    using X = std::decay_t<decltype(bsdf.emission().r)>;
    const SurfaceScatterer<L, X, Bsdf> here{hit, surface, material, bsdf};
    const bool sought = !bsdf.all_singular() && seeks_lamps(path, media);
    Path::Inside inside{sought, surface.leave(-path.ray.direction), 0, mean_channel(media.rates()),
                        media.object()};
    if (sought)
      refracted_.add_sample(InnerVertex{path, inside.place, here, media, random}, beta, radiance);
    if (!bsdf.all_singular())
      refracted_.noting(radiance, [&](Rarity& rarity) {
        direct_.add_sample(path, surface.position, here, media, random, beta, radiance,
                           [&](int lamp, const Vec3f& direction, float light, float density) {
                             if (!path.inside.sought) return 1.0f;
                             return rarity.of_share(refracted_.path_weight(
                                 path.inside, hit, surface, lamp, direction, light, density));
                           });
      });

    const auto drawn = draw(bsdf, random);
    if (!drawn) return false;
    const BsdfSample<X>* sample = &*drawn;
    std::optional<BsdfSample<X>> drawn_below;
    material.attenuate(p_.geometry, hit, sample->weight, beta);
    path.length += path.travelled + hit.t;
    if constexpr (std::is_same_v<X, Scalar>) {
      if (sample->enters) {
        const SubsurfaceMedium<X> medium = this->medium(values, material, bsdf, *drawn);
        const auto exit = RandomWalk<X>(medium).run(p_.geometry, hit.instance, surface, sample->wo,
                                                    random, kWalk);
        if (!exit) return false;
        material.attenuate(p_.geometry, hit, exit->weight, beta);
        // Lit and left as if a ray from outside had met it.
        random.start_bounce(++vertex + 1);
        surface = p_.geometry.surface(exit->hit);
        const PrincipledBsdf<Scalar> out(p_.exit.values, p_.exit.flavour,
                                         point(surface, exit->direction));
        direct_.add_sample(path, surface.position,
                           SurfaceScatterer<L, X>{exit->hit, surface, p_.exit, out}, media, random,
                           beta, radiance);
        drawn_below = draw(out, random);
        if (!drawn_below) return false;
        sample = &*drawn_below;
        beta.multiply(p_.exit.factor(sample->weight));
        path.pixel = path.pixel_growth = 0;  // as in Cycles
      }
    }
    if (sample->transmits) media.cross(hit, surface, sample->wo);
    path.after_diffuse = path.after_diffuse || sample->diffuse;
    path.count(sample->transmits, sample->diffuse, sample->singular);
    if (!survives(++path.scatterings, random, beta)) return false;
    path.density = sample->singular ? kSingular : sample->density;
    path.refracted = sample->transmits;
    path.left = {path.inside.sought && sample->transmits, path.inside, hit};
    inside.sought = sought && !sample->transmits && !sample->singular;
    inside.density = path.density;
    path.inside = inside;
    path.kind = sample->kind();
    path.receiver = hit.instance;
    path.on_film = path.on_film && sample->transmits && is_film_glass(values, bsdf, *drawn);
    path.from = surface.position;
    path.travelled = path.near = 0;
    path.sealed = material.sealed && dot(sample->wo, surface.ng) < 0;
    media.leave(surface, sample->wo);
    path.ray = {surface.leave(sample->wo), sample->wo, 0, kInfinity};
    if (p_.visibility.shadow_links)
      direct_.add_shadow_linked_lamps(path, media, random, beta, radiance);
    return true;
  }

  static SurfacePoint<float> point(const Surface& s, const Vec3f& wi, bool after_diffuse = false) {
    return DirectLight<L>::point(s, wi, after_diffuse);
  }
  bool is_held_out(const Path& path, const Hit& hit) const {
    return path.on_film && p_.geometry.instances()[hit.instance].holdout;
  }
  /// Whether what refraction shows of the world is left out of the film.
  template <class X>
  bool is_film_glass(const Principled<X>& values, const PrincipledBsdf<X>&,
                     const BsdfSample<X>&) const {
    return p_.visibility.film_through_glass &&
           clamp01(value_of(values.roughness)) <= p_.scene.appearance.world.film_roughness;
  }
  bool is_film_glass(const ShaderOf&, const SurfaceBsdf<Scalar>& bsdf,
                     const SurfaceSample<Scalar>& sample) const {
    return p_.visibility.film_through_glass &&
           bsdf.roughness(sample) <= p_.scene.appearance.world.film_roughness;
  }
  /// What light that has entered a surface walks through.
  template <class X>
  static SubsurfaceMedium<X> medium(const Principled<X>& values,
                                    const PreparedMaterial<L>& material,
                                    const PrincipledBsdf<X>& bsdf, const BsdfSample<X>&) {
    return {values, material.flavour, bsdf.layers().entry_eta};
  }
  static SubsurfaceMedium<Scalar> medium(const ShaderOf&, const PreparedMaterial<L>&,
                                         const SurfaceBsdf<Scalar>& bsdf,
                                         const SurfaceSample<Scalar>& sample) {
    return bsdf.medium(sample);
  }
  /// A point that a path has met, as its shader sees it.
  ShadingPoint seen(const Path& path, const Hit& hit, const Surface& surface) const {
    ShadingPoint point;
    point.geometry = &p_.geometry;
    point.mesh_colors = &p_.scene.appearance.mesh_colors;
    point.hit = hit;
    point.surface = surface;
    point.wi = -path.ray.direction;
    point.camera = &place_;
    point.path = path.facts;
    const float travelled = path.travelled + hit.t;
    point.path.length = travelled - path.near;
    point.path.depth = path.scatterings;
    point.footprint = path.pixel + path.pixel_growth * (path.length + travelled);
    return point;
  }
  /// How large the pixel is that a camera ray belongs to.
  void measure_pixel(Path& path) const {
    const Vec3f ahead = path.ray.origin + path.ray.direction;
    const Vec2<double> p = camera_.project(Vec3d(ahead));
    const auto at = [&](double x, double y) {
      return camera_.ray(static_cast<float>(x), static_cast<float>(y));
    };
    const Ray here = at(p.x, p.y), right = at(p.x + 1, p.y), down = at(p.x, p.y + 1);
    path.pixel = (length(right.origin - here.origin) + length(down.origin - here.origin)) / 2;
    path.pixel_growth =
        (length(right.direction - here.direction) + length(down.direction - here.direction)) / 2;
  }
  /// Whether lamps are sought through the surface of the body around the path.
  bool seeks_lamps(const Path& path, const MediaStack<L>& media) const {
    return refracted_.acts() && !media.empty() && (depth_ == 0 || path.scatterings + 1 < depth_);
  }
  /// Of a lamp that the path has met beyond the surface of a medium.
  float weight_of_way_out(const Path& path, int lamp, const LightHit& found) const {
    if (!path.left.through) return 1;
    return refracted_.path_weight(path.left.from, path.left.hit, p_.geometry.surface(path.left.hit),
                                  lamp, path.ray.direction,
                                  p_.lights.lamp_density(lamp, found, true), path.density);
  }
  /// Light of an emissive surface that the path has met.
  void add_emission(const Path& path, const Hit& hit, const Surface& surface,
                    const Factor<L>& emitted, const Throughput<L>& beta,
                    Radiance<L>& radiance) const {
    if (p_.visibility.uneven && !path.from_camera() &&
        !direct_.lit(p_.geometry.instances()[hit.instance].links, path.receiver))
      return;
    const Vec3f d = surface.position - path.from;
    const float light = path.from_camera()
                            ? 0
                            : p_.lights.mesh_density(surface, d, direct_.as_cycles(path.refracted));
    const float weight = DirectLight<L>::bsdf_weight(path.density, light);
    radiance.add(beta, emitted, weight);
    if constexpr (is_taped(L)) {
      const PreparedMaterial<L>& material = p_.materials[surface.material];
      if (material.is_recorded())
        material.record_emission(p_.geometry, hit, emitted, beta.value * weight, beta, radiance);
    }
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
  template <class Bsdf>
  static auto draw(const Bsdf& bsdf, const Random& random) {
    return bsdf.sample(random.uniform(kLobe), random.uniform(kLobe1), random.uniform(kLobe2));
  }

  /// Decides whether the ray passes straight through; either way `beta` takes the factor.
  template <class Bsdf>
  bool pass_through(const PreparedMaterial<L>& material, const Hit& hit, const Bsdf& bsdf,
                    const Random& random, Throughput<L>& beta) const {
    const auto transparency = bsdf.transparency();
    float probability = 0;
    if constexpr (std::is_same_v<Bsdf, SurfaceBsdf<Scalar>>) {
      probability = bsdf.pass_probability();
    } else {
      probability = mean_channel(value_of(transparency));
      // A derivative with respect to alpha needs both events at either end of its range.
      if (has_slope(transparency)) probability = clamp(probability, 0.1f, 0.9f);
    }
    if (!(probability > 0)) return false;
    if (random.uniform(kPass) < probability) {
      material.pass(p_.geometry, hit, transparency, beta);
      beta.multiply(1 / probability);
      return true;
    }
    beta.multiply(1 / (1 - probability));
    return false;
  }

  const Prepared<L>& p_;
  int depth_;
  const PixelCamera& camera_;
  CameraPlace place_;
  ShaderRoom<Scalar> room_;
  DirectLight<L> direct_;
  RefractedLight<L> refracted_;
};

}  // namespace selenite
