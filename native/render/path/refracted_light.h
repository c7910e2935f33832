// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "render/media/refracted_exit.h"
#include "render/path/direct_light.h"
#include "render/prepared/refraction_spread.h"

namespace selenite {

/// Light of lamps that reaches the inside of a body with a medium by refraction at its surface. A small
/// lamp is hardly ever found by a path that leaves the body where it happens to. So places inside,
/// in the medium and on surfaces, are connected with lamps by the one refraction in between: a point
/// of the lamp and a micronormal are drawn, and the place on the surface that belongs to them is
/// solved for. Both ways of finding such light are weighted against each other (power heuristic).
/// What a smooth surface reflects inside first, or comes through two bodies, paths alone find.
template <int L>
class RefractedLight {
 public:
  RefractedLight(const Prepared<L>& prepared, const DirectLight<L>& direct)
      : p_(prepared), direct_(direct) {
    if (!acts()) return;
    for (const int i : p_.lamps)
      if (p_.lights.probability(i) > 0) lamps_.push_back(i), all_ += p_.lights.probability(i);
  }

  /// Whether anything is found in this way.
  bool acts() const { return !p_.boundaries.empty(); }

  /// At a place inside of a body with a medium, where a path is to be scattered.
  template <class Scatterer>
  void add_sample(const Path& path, const Vec3f& place, const Scatterer& scatterer,
                  const MediaStack<L>& media, const Random& random, const Throughput<L>& beta,
                  Radiance<L>& radiance) const {
    const int lamp = choose(random.uniform(kLightChoice));
    const Light& light = p_.scene.appearance.lights[lamp];
    const auto aim = light.sample(place, random.uniform(kLight1), random.uniform(kLight2));
    if (!aim) return;
    const bool infinite = !light.has_place();
    const RefractedExit exits(
        p_.geometry, media.object(), place,
        {infinite ? aim->direction : place + aim->direction * aim->distance, infinite});
    const float rate = mean_channel(media.rates());
    const auto seek = [&](int start) {
      const auto from = exits.start(start);
      if (!from) return;
      const RefractionSpread& boundary = p_.boundaries[from->surface.material];
      if (!(boundary.eta > 0)) return;
      // As in Cycles, a lamp without size does not shine through a smooth surface.
      if (boundary.width2 == 0 && light.is_delta()) return;
      // Deep inside hardly anything arrives: few of the places seek it.
      const float reach = std::exp(-rate * from->hit.t);
      const float survival = clamp(kRouletteScale * reach, kLeastSurvival, 1.0f);
      if (!(random.uniform(kExitRoulette) < survival)) return;
      const auto wanted = draw(boundary.width2, random);
      const auto exit = exits.find(*from, boundary.eta, wanted, tolerance(boundary));
      if (!exit || exit->surface.material != from->surface.material) return;
      if (start > 0 && finder(exits, *exit, boundary, wanted, start) < start) return;
      bring(path, place, scatterer, media, exits.target(), *exit, lamp,
            {.chance = chance(start), .survival = survival, .rate = rate}, random, beta, radiance);
    };
    seek(0);
    const int other = 1 + static_cast<int>(random.uniform(kExitStart) / chance(1));
    if (other < RefractedExit::kStarts) seek(other);
  }

  /// Weight of a path that has gone from `inside` to `hit`, and from there to a lamp. `light` and
  /// `bsdf`: densities of the direction `beyond` at the surface.
  float path_weight(const Path::Inside& inside, const Hit& hit, const Surface& surface, int lamp,
                    const Vec3f& beyond, float light, float bsdf) const {
    if (hit.instance != inside.body || !(dot(beyond, surface.ng) > 0)) return 1;
    const auto odds = this->odds(inside, hit, surface, lamp, beyond, light, bsdf);
    if (!odds) return 1;
    const RefractedExit exits(p_.geometry, hit.instance, inside.place, odds->target);
    const RefractedExit::Place here{hit, surface, {}};
    const int start = finder(exits, here, p_.boundaries[surface.material], odds->micronormal,
                             RefractedExit::kStarts);
    if (start == RefractedExit::kStarts) return 1;
    return power_heuristic(odds->by_path, odds->by_aim * chance(start));
  }

 private:
  /// How a place on the surface was come by.
  struct Search {
    float chance, survival;  ///< of beginning where it did; of Russian roulette
    float rate;              ///< of the media inside
  };
  struct Seen {
    float density, factor, distance;
  };
  /// Densities by which a way from inside to a lamp is found.
  struct Odds {
    float by_aim, by_path;
    ExitTarget target;
    RefractedExit::Micronormal micronormal;
  };

  static constexpr float kRouletteScale = 8, kLeastSurvival = 0.05f;
  static constexpr float kLeastOdds = 0.03f;  ///< below this nobody aims
  static constexpr float kSamePlace = 1e-2f;

  static double tolerance(const RefractionSpread& boundary) {
    return std::max(1e-3 * std::sqrt(boundary.width2), 3e-6);
  }
  /// Of a search beginning there: always on the straight line, every second time on one of the others.
  static float chance(int start) { return start == 0 ? 1 : 0.5f / (RefractedExit::kStarts - 1); }

  /// The first start below `most` from which a place is found; `most`: from none.
  int finder(const RefractedExit& exits, const RefractedExit::Place& place,
             const RefractionSpread& boundary, const RefractedExit::Micronormal& wanted,
             int most) const {
    for (int i = 0; i < most; ++i) {
      const auto start = exits.start(i);
      if (!start || start->surface.material != place.surface.material) continue;
      const auto found = exits.find(*start, boundary.eta, wanted, tolerance(boundary));
      if (!found) continue;
      const Vec3f apart = found->surface.position - place.surface.position;
      if (length(apart) < kSamePlace * start->hit.t) return i;
    }
    return most;
  }

  /// The radiance takes the light of a lamp that comes through a place on the surface.
  template <class Scatterer>
  void bring(const Path& path, const Vec3f& place, const Scatterer& scatterer,
             const MediaStack<L>& media, const ExitTarget& target, const RefractedExit::Place& exit,
             int lamp, const Search& search, const Random& random, const Throughput<L>& beta,
             Radiance<L>& radiance) const {
    const Surface& surface = exit.surface;
    const PreparedMaterial<L>& material = p_.materials[surface.material];
    const Light& light = p_.scene.appearance.lights[lamp];
    const Vec3f beyond = target.direction_from(surface.position);
    if (!(dot(beyond, surface.ng) > 0) || scatterer.refracts(exit.direction)) return;
    const auto found = seen(light, surface.position, beyond);
    if (!found) return;
    Color<typename Scatterer::Number> scattered;
    Path::Inside inside{true, place, 0, search.rate, exit.hit.instance};
    scatterer.evaluate(exit.direction, kScatteredRays, scattered, inside.density);
    if (max_channel(value_of(scattered)) == 0 && !has_slope(scattered)) return;

    const auto through_surface = [&](const auto& values) {
      using X = std::decay_t<decltype(values.roughness)>;
      const PrincipledBsdf<X> bsdf(
          values, material.flavour,
          DirectLight<L>::point(surface, -exit.direction, path.after_diffuse));
      const SurfaceScatterer<L, X> boundary{exit.hit, surface, material, bsdf};
      const auto spread = refraction_spread(bsdf.layers());
      const bool smooth = p_.boundaries[surface.material].width2 == 0;
      if (!spread || (spread->width2 == 0) != smooth) return;
      Color<X> value;
      float density = 0;
      if (smooth)
        value = smooth_refraction(bsdf.layers(), std::abs(dot(surface.n, exit.direction)));
      else
        bsdf.value_and_density(beyond, value, density);
      if (max_channel(value_of(value)) == 0 && !has_slope(value)) return;
      const auto odds = this->odds(inside, exit.hit, surface, lamp, beyond,
                                   found->density * p_.lights.probability(lamp, true), density);
      if (!odds) return;
      const float by_aim = odds->by_aim * search.chance;

      Throughput<L> through = beta.branch();
      scatterer.attenuate(p_.geometry, scattered, through);
      media.attenuate({place, exit.direction, 0, exit.hit.t}, exit.hit.t, random, kAlongGrids,
                      through);
      MediaStack<L> outside = media;
      boundary.cross(outside, beyond);
      if (light.casts_shadows && !direct_.visible(boundary.origin(beyond), beyond, found->distance,
                                                  light.links, random, outside, through))
        return;
      boundary.bring(p_.geometry, value, p_.emitted.lamp(lamp, found->factor),
                     power_heuristic(by_aim, odds->by_path) / (by_aim * search.survival), through,
                     radiance);
    };
    typename PreparedMaterial<L>::Room room;
    if (material.plain)
      through_surface(material.plain_values);
    else
      through_surface(material.at(p_.geometry, exit.hit, room));
  }
  int choose(float u) const {
    float left = u * all_;
    for (std::size_t i = 0; i + 1 < lamps_.size(); ++i) {
      left -= p_.lights.probability(lamps_[i]);
      if (left < 0) return lamps_[i];
    }
    return lamps_.back();
  }
  /// By the distribution of normals, in the plane across the mean one.
  static RefractedExit::Micronormal draw(float width2, const Random& random) {
    const double u = random.uniform(kExit1), phi = 2 * kPi<double> * random.uniform(kExit2);
    const double sine = std::sqrt(width2 * u / (1 - u + width2 * u));
    return {sine * std::cos(phi), sine * std::sin(phi)};
  }
  /// The lamp in a direction from a place outside.
  static std::optional<Seen> seen(const Light& light, const Vec3f& from, const Vec3f& direction) {
    if (light.is_delta()) {
      const auto s = light.sample(from, 0, 0);
      if (!s) return std::nullopt;
      return Seen{0, s->factor, s->distance};
    }
    const auto hit = light.intersect(from, direction, 0, std::numeric_limits<float>::infinity());
    if (!hit || !(hit->factor > 0)) return std::nullopt;
    return Seen{hit->density, hit->factor, hit->distance};
  }

  /// Empty for ways along which nobody aims.
  std::optional<Odds> odds(const Path::Inside& inside, const Hit& hit, const Surface& surface,
                           int lamp, const Vec3f& beyond, float light, float bsdf) const {
    const RefractionSpread& boundary = p_.boundaries[surface.material];
    if (!(boundary.eta > 0) || !p_.lights.probability(lamp)) return std::nullopt;
    const Light& from = p_.scene.appearance.lights[lamp];
    const auto aimed = aimed_at(from, inside.place, surface.position, beyond);
    if (!aimed) return std::nullopt;
    const Vec3f way = surface.position - inside.place;
    const float distance = length(way);
    const RefractedExit exits(p_.geometry, hit.instance, inside.place, aimed->target);
    const auto refraction = exits.refraction({hit, surface, way / distance}, boundary.eta);
    if (!refraction) return std::nullopt;
    const auto& m = refraction->micronormal;
    const bool smooth = boundary.width2 == 0;
    const double normals =
        smooth ? 1 / refraction->change_beyond
               : ggx_normals(m.x * m.x + m.y * m.y, m.z2(), static_cast<double>(boundary.width2));
    const float share = p_.lights.probability(lamp);
    const float at_surface = smooth ? 1 : from.is_delta() ? share : light + bsdf;
    Odds odds{
        .by_aim = static_cast<float>(normals * refraction->change) * aimed->density * share / all_,
        .by_path = inside.density * std::exp(-inside.rate * distance) * at_surface,
        .target = aimed->target,
        .micronormal = smooth ? RefractedExit::Micronormal{} : m};
    if (!std::isfinite(odds.by_aim) || !(odds.by_aim > kLeastOdds * odds.by_path))
      return std::nullopt;
    return odds;
  }

  struct Aimed {
    ExitTarget target;
    float density;  ///< of the direction from the surface, per solid angle
  };
  /// By which target from inside a direction at the surface would have been found.
  static std::optional<Aimed> aimed_at(const Light& light, const Vec3f& inside,
                                       const Vec3f& surface, const Vec3f& direction) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    if (light.is_delta()) {
      const auto s = light.sample(inside, 0, 0);
      if (!s) return std::nullopt;
      if (!light.has_place()) return Aimed{{s->direction, true}, 1};
      return Aimed{{light.position, false}, 1};
    }
    if (!light.has_place()) {
      const auto hit = light.intersect(surface, direction, 0, kInfinity);
      if (!hit) return std::nullopt;
      return Aimed{{direction, true}, hit->density};
    }
    const bool disc = light.kind != LightKind::kArea && light.soft_falloff;
    Vec3f target, normal;
    float distance;
    if (disc) {
      // It faces the place inside, from where it was drawn.
      normal = normalize(light.position - inside);
      distance = dot(light.position - surface, normal) / dot(direction, normal);
      if (!(distance > 0)) return std::nullopt;
      target = surface + direction * distance;
    } else {
      const auto hit = light.intersect(surface, direction, 0, kInfinity);
      if (!hit) return std::nullopt;
      distance = hit->distance;
      target = surface + direction * distance;
      normal = light.kind == LightKind::kArea ? light.axis : normalize(target - light.position);
    }
    const Vec3f way = target - inside;
    const float from_inside = length(way);
    const Vec3f aim = way / from_inside;
    const auto hit = light.intersect(inside, aim, 0, kInfinity);
    if (!hit || !(hit->factor > 0)) return std::nullopt;
    if (std::abs(hit->distance - from_inside) > 1e-3f * from_inside) return std::nullopt;
    const float density = hit->density * std::abs(dot(aim, normal)) * square(distance) /
                          (std::abs(dot(direction, normal)) * square(from_inside));
    return Aimed{{target, false}, density};
  }

  const Prepared<L>& p_;
  const DirectLight<L>& direct_;
  std::vector<int> lamps_;  ///< those that are aimed at
  float all_ = 0;           ///< their probabilities
};

}  // namespace selenite
