// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <limits>

#include "math/rng.h"
#include "math/sampling.h"
#include "render/media/scatterer.h"
#include "render/path/dimension.h"
#include "render/path/path.h"
#include "render/prepared/prepared.h"

namespace selenite {

/// Light of lamps and the world: what the ray of a path meets of it, and what light sampling finds from
/// a point. Both are weighted against each other (power heuristic).
template <int L>
class DirectLight {
 public:
  using Scalar = PathScalar<L>;

  /// `camera`: for what shaders ask of it.
  DirectLight(const Prepared<L>& prepared, const CameraPlace& camera)
      : p_(prepared), camera_(camera) {}

  /// MIS weight of a direction that the bsdf chose, where light sampling has density `light`.
  static float bsdf_weight(float density, float light) {
    return density == Path::kSingular || !(light > 0) ? 1 : power_heuristic(density, light);
  }
  /// By which light sampling is weighted: as Cycles samples where what is rendered depends on it.
  bool as_cycles(bool refracted) const { return refracted || p_.visibility.uneven; }
  /// Whether an object may receive light that is linked so; -1: no object.
  bool lit(const LinkedSets& links, int object) const {
    return links.lights(object < 0 ? 0 : p_.geometry.instances()[object].lit_set);
  }

  /// Lamps on the path's ray, nearer to where it was scattered than `reach`. `share(lamp, hit)`: of
  /// what is found so, where there are other ways.
  template <class Share>
  void add_lamps(const Path& path, float reach, const MediaStack<L>& media, const Random& random,
                 const Throughput<L>& beta, Radiance<L>& radiance, const Share& share) const {
    const auto& lights = p_.scene.appearance.lights;
    const Vec3f& direction = path.ray.direction;
    const float t_min = path.travelled + path.ray.t_min;
    for (std::uint32_t lamp = 0; lamp < p_.lamps.size(); ++lamp) {
      const int i = p_.lamps[lamp];
      if (!meets(path, lights[i])) continue;
      const float end = path.from_camera() && lights[i].has_place()
                            ? std::min(reach, path.travelled + path.ray.t_max)
                            : reach;
      const auto hit = lights[i].intersect(path.from, direction, t_min, end);
      if (!hit || !(hit->factor > 0)) continue;
      const float weight = lamp_weight(path, i, *hit) * share(i, *hit);
      if (media.empty()) {
        radiance.add(beta, p_.emitted.lamp(i, hit->factor), weight);
      } else {
        Throughput<L> through = beta.branch();
        const Ray start{path.from + direction * t_min, direction, 0, kInfinity};
        media.attenuate(start, hit->distance - t_min, random, kToLamp + lamp, through);
        radiance.add(through, p_.emitted.lamp(i, hit->factor), weight);
      }
    }
  }

  /// The same for lamps with shadow linking: what hides them is not what the path's ray meets. Only for
  /// rays that have just left a surface, as in Cycles; there an object of no set hides them as well.
  void add_shadow_linked_lamps(const Path& path, const MediaStack<L>& media, const Random& random,
                               const Throughput<L>& beta, Radiance<L>& radiance) const {
    const auto& lights = p_.scene.appearance.lights;
    for (const int i : p_.lamps) {
      LinkedSets links = lights[i].links;
      if (links.shading == LinkedSets::kAll || !shines_on(path, lights[i])) continue;
      const auto hit = lights[i].intersect(path.from, path.ray.direction, 0, kInfinity);
      if (!hit || !(hit->factor > 0)) continue;
      links.shading |= 1;
      Throughput<L> through = beta.branch();
      MediaStack<L> beyond = media;
      if (visible(path, path.ray.origin, path.ray.direction, hit->distance, links, random, beyond,
                  through))
        radiance.add(through, p_.emitted.lamp(i, hit->factor), lamp_weight(path, i, *hit));
    }
  }

  void add_world(const Path& path, const Throughput<L>& beta, Radiance<L>& radiance) const {
    const World& world = p_.scene.appearance.world;
    if (!world.on || !(world.visible_to & path.kind)) return;
    if (path.on_film && world.transparent_film) return;
    const Vec3f& direction = path.ray.direction;
    const float light =
        path.from_camera() ? 0 : p_.lights.world_density(direction, as_cycles(path.refracted));
    const float weight = bsdf_weight(path.density, light);
    if (const Backdrop* seen = world.backdrop(path.facts.kinds)) {
      radiance.add(beta, p_.emitted.backdrop(*seen, direction), weight);
      return;
    }
    radiance.add(beta, p_.emitted.world_along(direction), weight);
    record_world(direction, beta.value * weight, beta);
  }

  /// Light of a lamp that a medium scatters towards the ray's origin, from a place drawn for that
  /// lamp: free flights seldom end where a lamp is close.
  void add_lamp_along(const Path& path, float distance, const MediaStack<L>& media,
                      const Random& random, const Throughput<L>& beta,
                      Radiance<L>& radiance) const {
    const auto choice = p_.lights.choose(random.uniform(kAlongChoice));
    if (choice.source != Source::kLamp) return;
    const Ray& ray = path.ray;
    const Light& lamp = p_.scene.appearance.lights[choice.index];
    if (!lamp.has_place()) return;
    if (!is_sampled(path, lamp, media.object()) || !(lamp.visible_to & kScatterRay)) return;
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
    if (lamp.casts_shadows &&
        !visible(path, position, s->direction, s->distance, lamp.links, random, beyond, through))
      return;
    const float light = s->density * choice.probability;
    const float weight =
        s->delta || !lamp.met_by_rays ? 1 : power_heuristic(light, value_of(phase));
    radiance.add(through, medium.factor(Color<Scalar>(phase)),
                 p_.emitted.lamp(choice.index, s->factor), share * weight / (light * density));
  }

  static float whole(int, const Vec3f&, float, float) { return 1; }
  /// Light of one light that is scattered towards where the path has come from. `way_share(lamp,
  /// direction, light, bsdf)`: of what is found of a lamp so, by the densities of the direction.
  template <class Scatterer, class Share = decltype(&whole)>
  void add_sample(const Path& path, const Vec3f& position, const Scatterer& scatterer,
                  const MediaStack<L>& media, const Random& random, const Throughput<L>& beta,
                  Radiance<L>& radiance, const Share& way_share = &whole) const {
    const auto choice = p_.lights.choose(random.uniform(kLightChoice));
    if (choice.source == Source::kNone) return;
    const float u1 = random.uniform(kLight1), u2 = random.uniform(kLight2);
    Vec3f direction;
    float distance = kInfinity, density = 0;
    float heuristic = 0;  // the density that enters the weight
    float share = 1;      // of this way to draw the position
    bool alone = false;   // no other way finds the light
    bool casts_shadows = true;
    const PreparedMaterial<L>* glowing = nullptr;  // with maps that are unknown
    Hit on{};                                      // it
    RayKinds visible_to = kScatteredRays;
    LinkedSets links;
    Factor<L> emitted;
    switch (choice.source) {
      case Source::kLamp: {
        const Light& lamp = p_.scene.appearance.lights[choice.index];
        if (!is_sampled(path, lamp, scatterer.object())) return;
        const auto s = lamp.sample(position, u1, u2);
        if (!s) return;
        share = scatterer.share(lamp);
        direction = s->direction;
        distance = s->distance;
        alone = s->delta || !lamp.met_by_rays;
        casts_shadows = lamp.casts_shadows;
        visible_to = lamp.visible_to;
        links = lamp.links;
        density = s->density * choice.probability;
        heuristic = s->density *
                    p_.lights.probability(choice.index, as_cycles(scatterer.refracts(direction)));
        emitted = p_.emitted.lamp(choice.index, s->factor);
        break;
      }
      case Source::kWorld: {
        const World& world = p_.scene.appearance.world;
        if (path.scatterings > world.max_bounces) return;
        visible_to = world.visible_to;
        direction = world.sample(u1, u2, density);
        density *= choice.probability;
        heuristic = p_.lights.world_density(direction, as_cycles(scatterer.refracts(direction)));
        emitted = p_.emitted.world_along(direction);
        break;
      }
      case Source::kMesh: {
        const auto& t = p_.lights.choose_triangle(random.uniform(kTriangle));
        const Instance& emitter = p_.geometry.instances()[t.instance];
        if (p_.visibility.uneven && !lit(emitter.links, scatterer.object())) return;
        visible_to = emitter.visible_to;
        const float root = std::sqrt(u1);
        on = {t.instance, t.triangle, root * (1 - u2), root * u2, 0};
        const Surface target = p_.geometry.surface(on);
        const Vec3f d = target.position - position;
        const float distance2 = dot(d, d);
        if (!(distance2 > 0)) return;
        direction = d / std::sqrt(distance2);
        // Stop short of the emitter itself.
        distance = std::sqrt(distance2) * (1 - 1e-4f);
        const PreparedMaterial<L>& source = p_.materials[t.material];
        if (source.is_recorded()) glowing = &source;
        density = p_.lights.mesh_density(target, d, false);
        heuristic = p_.lights.mesh_density(target, d, as_cycles(scatterer.refracts(direction)));
        if (source.shader) {
          PathFacts facts = path.facts;
          facts.kinds = 0;
          facts.singular = false;
          facts.depth = path.scatterings + 1;
          const ShadingPoint there = shading_point(on, target, direction, facts);
          emitted = source.factor(source.shader->emission(there, room_));
          break;
        }
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
    scatterer.evaluate(direction, visible_to, value, bsdf_density);
    if (max_channel(value_of(value)) == 0 && !has_slope(value)) return;
    Throughput<L> through = beta.branch();
    if (casts_shadows && !visible(path, scatterer.origin(direction), direction, distance, links,
                                  random, beyond, through))
      return;
    float weight = alone ? 1 : power_heuristic(heuristic, bsdf_density);
    if (choice.source == Source::kLamp)
      weight *= way_share(choice.index, direction, heuristic, bsdf_density);
    const float found = share * weight / density;
    if constexpr (is_taped(L))
      if (glowing)
        glowing->record_emission(p_.geometry, on, emitted, through.value * value_of(value) * found,
                                 through, radiance);
    if (choice.source == Source::kWorld)
      record_world(direction, through.value * value_of(value) * found, through);
    scatterer.bring(p_.geometry, value, emitted, found, through, radiance);
  }

  static SurfacePoint<float> point(const Surface& s, const Vec3f& wi, bool after_diffuse = false) {
    const bool back = dot(s.ng, wi) < 0;
    return {back ? -s.ng : s.ng, back ? -s.n : s.n, wi, back, after_diffuse};
  }

  /// Unoccluded part of the way to a light: the throughput after all transparent surfaces and media.
  bool visible(const Path& path, const Vec3f& origin, const Vec3f& direction, float distance,
               const LinkedSets& links, const Random& random, MediaStack<L>& media,
               Throughput<L>& beta) const {
    Ray ray{origin, direction, 0, distance};
    if (p_.visibility.hidden_media) media.hide_from_shadow_rays();
    const bool linked = links.shading != LinkedSets::kAll;
    if (!p_.any_transparent && !linked) {
      if (p_.geometry.occluded(ray)) return false;
      media.attenuate(ray, distance, random, kShadow, beta);
      return beta.importance() > 0;
    }
    PathFacts facts = path.facts;
    facts.kinds = kShadowRay;
    facts.singular = false;
    facts.depth = path.scatterings + 1;
    for (std::uint32_t i = 0; i < kHardLimit; ++i) {
      const auto hit = p_.geometry.intersect(ray, kShadowRay);
      if (!hit) {
        media.attenuate(ray, ray.t_max, random, kShadow + i, beta);
        return beta.importance() > 0;
      }
      const Surface s = p_.geometry.surface(*hit);
      const PreparedMaterial<L>& material = p_.materials[s.material];
      const bool unlinked =
          linked && !links.is_shaded_by(p_.geometry.instances()[hit->instance].shadow_set);
      if (!unlinked && !(material.transparent && has_transparent_shadows(s.material))) return false;
      media.attenuate(ray, hit->t, random, kShadow + i, beta);
      if (!unlinked) {
        media.cross(*hit, s, direction);
        facts.length = dot(s.position - origin, direction);
        material.pass(p_.geometry, *hit, transparency(material, *hit, s, direction, facts), beta);
        ++facts.transparent_depth;
      }
      if (!(beta.importance() > 0)) return false;
      const Vec3f next = s.leave(direction);
      const float left =
          distance == kInfinity ? kInfinity : ray.t_max - dot(next - ray.origin, direction);
      ray = {next, direction, 0, left};
      if (!(left > 0)) return true;
    }
    return false;
  }

 private:
  using Source = LightSampler::Source;

  static constexpr float kInfinity = std::numeric_limits<float>::infinity();
  static constexpr std::uint32_t kHardLimit = 1 << 17;  // surfaces on the way to a light

  /// Whether the rays of a path that it has scattered show a lamp, if nothing hides it.
  bool shines_on(const Path& path, const Light& lamp) const {
    return lamp.visible_to & path.kind && lamp.met_by_rays && lit(lamp.links, path.receiver);
  }
  bool meets(const Path& path, const Light& lamp) const {
    if (path.from_camera() || !p_.visibility.uneven) return lamp.visible_to & path.kind;
    return lamp.links.shading == LinkedSets::kAll && shines_on(path, lamp);
  }
  /// Whether light sampling may find a lamp from a point of an object.
  bool is_sampled(const Path& path, const Light& lamp, int object) const {
    return !p_.visibility.uneven ||
           (path.scatterings <= lamp.max_bounces && lit(lamp.links, object));
  }
  /// A point of a surface that light leaves or passes, as its shader sees it.
  ShadingPoint shading_point(const Hit& hit, const Surface& surface, const Vec3f& direction,
                             const PathFacts& facts) const {
    ShadingPoint point;
    point.geometry = &p_.geometry;
    point.mesh_colors = &p_.scene.appearance.mesh_colors;
    point.hit = hit;
    point.surface = surface;
    point.wi = -direction;
    point.path = facts;
    point.camera = &camera_;
    return point;
  }
  Color<Scalar> transparency(const PreparedMaterial<L>& material, const Hit& hit,
                             const Surface& surface, const Vec3f& direction,
                             const PathFacts& facts) const {
    if (material.shader)
      return material.shader->transparency(shading_point(hit, surface, direction, facts), room_);
    typename PreparedMaterial<L>::Room room;
    return PrincipledBsdf<Scalar>(material.at(p_.geometry, hit, room), material.flavour,
                                  point(surface, -direction))
        .transparency();
  }
  bool has_transparent_shadows(int material) const {
    return p_.scene.appearance.materials[material].transparent_shadows;
  }
  float lamp_weight(const Path& path, int lamp, const LightHit& hit) const {
    return bsdf_weight(path.density, p_.lights.lamp_density(lamp, hit, as_cycles(path.refracted)));
  }

  /// Puts the light of a direction on the tape where the world's image is unknown; `throughput`: from
  /// the camera to the world.
  void record_world(const Vec3f& direction, const Colorf& throughput,
                    const Throughput<L>& beta) const {
    if constexpr (is_taped(L)) {
      if (p_.environment_field < 0) return;
      const World& world = p_.scene.appearance.world;
      beta.tape->add_leaf(throughput * p_.emitted.world(Colorf(1)).value,
                          {world.to_map_frame(direction), p_.environment_field});
    }
  }
  const Prepared<L>& p_;
  const CameraPlace& camera_;
  mutable ShaderRoom<Scalar> room_;  // memory only: nothing stays in it
};

}  // namespace selenite
