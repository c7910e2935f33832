// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "render/media/refracted_exit.h"
#include "render/path/aim_excess.h"
#include "render/path/direct_light.h"
#include "render/prepared/refraction_spread.h"

namespace selenite {

/// Where a path is to be scattered, at a place inside of a body with a medium.
template <int L, class Scatterer>
struct InnerVertex {
  const Path& path;
  Vec3f place;
  const Scatterer& scatterer;
  const MediaStack<L>& media;
  const Random& random;
};
/// Clang before 17 deduces nothing from the members of an aggregate.
template <int L, class Scatterer>
InnerVertex(const Path&, Vec3f, const Scatterer&, const MediaStack<L>&, const Random&)
    -> InnerVertex<L, Scatterer>;

/// Light of lamps that reaches the inside of a body with a medium by refraction at its surface. A small
/// lamp is hardly ever found by a path that leaves the body where it happens to. So places inside,
/// in the medium and on surfaces, are connected with lamps by the one refraction in between: a point
/// of the lamp and a micronormal are drawn, and the place on the surface that belongs to them is
/// solved for. Both ways of finding such light are weighted against each other (power heuristic).
/// What a smooth surface reflects inside first, or comes through two bodies, paths alone find.
template <int L>
class RefractedLight {
 public:
  RefractedLight(const Prepared<L>& prepared, const CameraPlace& camera)
      : p_(prepared), direct_(prepared, camera) {
    for (const int i : p_.aims) all_ += p_.lights.probability(i);
  }

  /// Whether anything is found in this way.
  bool acts() const { return !p_.boundaries.empty(); }
  /// Notes from now on what it is worth; null: nothing.
  void note_excess(AimExcess<L>* excess) { excess_ = excess; }
  /// Calls `bring(rarity)`, which adds to the radiance.
  template <class Bring>
  void noting(Radiance<L>& radiance, Bring&& bring) const {
    Rarity rarity;
    if (!excess_) return bring(rarity);
    const Radiance<L> before = radiance;
    bring(rarity);
    if (rarity.rarer > 1) excess_->add(before, radiance, rarity.rarer);
  }
  /// Places on surfaces that were looked at so far.
  std::int64_t exits() const { return exits_; }

  template <class Scatterer>
  void add_sample(const InnerVertex<L, Scatterer>& at, const Throughput<L>& beta,
                  Radiance<L>& radiance) const {
    const int lamp = choose(at.random.uniform(kLightChoice));
    const Light& light = p_.scene.appearance.lights[lamp];
    const auto target =
        draw_target(light, at.place, at.random.uniform(kLight1), at.random.uniform(kLight2));
    if (!target) return;
    const RefractedExit exits(p_.geometry, at.media.object(), at.place, *target);
    const float rate = mean_channel(at.media.rates());
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
      if (!(at.random.uniform(kExitRoulette) < survival)) return;
      const auto wanted = draw(boundary.width2, at.random);
      const auto exit = exits.find(*from, boundary.eta, wanted, tolerance(boundary));
      if (!exit || exit->surface.material != from->surface.material) return;
      if (start > 0 && finder(exits, *exit, boundary, wanted, start) < start) return;
      bring(at,
            {.lamp = lamp,
             .target = *target,
             .exit = *exit,
             .rate = rate,
             .chance = chance(start),
             .survival = survival},
            beta, radiance);
    };
    seek(0);
    const int other = 1 + static_cast<int>(at.random.uniform(kExitStart) / chance(1));
    if (other < RefractedExit::kStarts) seek(other);
    exits_ += exits.visited();
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
    exits_ += exits.visited();
    if (start == RefractedExit::kStarts) return 1;
    return power_heuristic(odds->by_path, odds->by_aim * chance(start));
  }

 private:
  /// A lamp that was found through a place on the surface.
  struct Connection {
    int lamp;
    LampTarget target;
    RefractedExit::Place exit;
    float rate;              ///< of the media inside
    float chance, survival;  ///< of the search beginning where it did; of Russian roulette
  };
  /// Densities by which a way from inside to a lamp is found.
  struct Odds {
    float by_aim, by_path;
    LampTarget target;
    RefractedExit::Micronormal micronormal;
  };

  // The pictures' means do not depend on them. Measured: docs/measurements/extremes.md, "A small lamp over a medium".
  static constexpr float kRouletteScale = 3, kLeastSurvival = 0.05f;
  static constexpr float kBesideChance = 0.2f;  ///< of a search on one of the lines beside
  static constexpr float kLeastOdds = 0.03f;    ///< below this nobody aims
  static constexpr float kSamePlace = 1e-2f;

  static double tolerance(const RefractionSpread& boundary) {
    return std::max(1e-3 * std::sqrt(boundary.width2), 3e-6);
  }
  /// Of a search beginning there: always on the straight line, now and then on one of the others.
  static float chance(int start) {
    return start == 0 ? 1 : kBesideChance / (RefractedExit::kStarts - 1);
  }

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
  void bring(const InnerVertex<L, Scatterer>& at, const Connection& found,
             const Throughput<L>& beta, Radiance<L>& radiance) const {
    const PreparedMaterial<L>& material = p_.materials[found.exit.surface.material];
    typename PreparedMaterial<L>::Room room;
    if (material.plain)
      bring_through(at, found, material.plain_values, beta, radiance);
    else
      bring_through(at, found, material.at(p_.geometry, found.exit.hit, room), beta, radiance);
  }
  /// X: see PathTracer::scatter.
  template <class Scatterer, class X>
  void bring_through(const InnerVertex<L, Scatterer>& at, const Connection& found,
                     const Principled<X>& values, const Throughput<L>& beta,
                     Radiance<L>& radiance) const {
    const auto& [hit, surface, direction] = found.exit;
    const Light& light = p_.scene.appearance.lights[found.lamp];
    const Vec3f beyond = found.target.direction_from(surface.position);
    if (!(dot(beyond, surface.ng) > 0) || at.scatterer.refracts(direction)) return;
    const auto lamp = lamp_along(light, surface.position, beyond);
    if (!lamp) return;
    Color<typename Scatterer::Number> scattered;
    Path::Inside inside{true, at.place, 0, found.rate, hit.instance};
    at.scatterer.evaluate(direction, kScatteredRays, scattered, inside.density);
    if (max_channel(value_of(scattered)) == 0 && !has_slope(scattered)) return;

    const PreparedMaterial<L>& material = p_.materials[surface.material];
    const PrincipledBsdf<X> bsdf(values, material.flavour,
                                 DirectLight<L>::point(surface, -direction, at.path.after_diffuse));
    const SurfaceScatterer<L, X> boundary{hit, surface, material, bsdf};
    const auto spread = refraction_spread(bsdf.layers());
    const bool smooth = p_.boundaries[surface.material].width2 == 0;
    if (!spread || (spread->width2 == 0) != smooth) return;
    Color<X> value;
    float density = 0;
    if (smooth)
      value = smooth_refraction(bsdf.layers(), std::abs(dot(surface.n, direction)));
    else
      bsdf.value_and_density(beyond, value, density);
    if (max_channel(value_of(value)) == 0 && !has_slope(value)) return;
    const auto odds = this->odds(inside, hit, surface, found.lamp, beyond,
                                 lamp->density * p_.lights.probability(found.lamp, true), density);
    if (!odds) return;
    const float by_aim = odds->by_aim * found.chance;

    Throughput<L> through = beta.branch();
    at.scatterer.attenuate(p_.geometry, scattered, through);
    at.media.attenuate({at.place, direction, 0, hit.t}, hit.t, at.random, kAlongGrids, through);
    MediaStack<L> outside = at.media;
    boundary.cross(outside, beyond);
    if (light.casts_shadows &&
        !direct_.visible(at.path, boundary.origin(beyond), beyond, lamp->distance, light.links,
                         at.random, outside, through))
      return;
    const float share = power_heuristic(by_aim, odds->by_path);
    noting(radiance, [&](Rarity& rarity) {
      if (share > 0) rarity.rarer = by_aim * found.survival / (share * odds->by_path);
      boundary.bring(p_.geometry, value, p_.emitted.lamp(found.lamp, lamp->factor),
                     share / (by_aim * found.survival), through, radiance);
    });
  }
  int choose(float u) const {
    float left = u * all_;
    for (std::size_t i = 0; i + 1 < p_.aims.size(); ++i) {
      left -= p_.lights.probability(p_.aims[i]);
      if (left < 0) return p_.aims[i];
    }
    return p_.aims.back();
  }
  /// By the distribution of normals, in the plane across the mean one.
  static RefractedExit::Micronormal draw(float width2, const Random& random) {
    const double u = random.uniform(kExit1), phi = 2 * kPi<double> * random.uniform(kExit2);
    const double sine = std::sqrt(width2 * u / (1 - u + width2 * u));
    return {sine * std::cos(phi), sine * std::sin(phi)};
  }
  /// Empty for ways along which nobody aims.
  std::optional<Odds> odds(const Path::Inside& inside, const Hit& hit, const Surface& surface,
                           int lamp, const Vec3f& beyond, float light, float bsdf) const {
    const RefractionSpread& boundary = p_.boundaries[surface.material];
    if (!(boundary.eta > 0) || std::ranges::find(p_.aims, lamp) == p_.aims.end())
      return std::nullopt;
    const Light& from = p_.scene.appearance.lights[lamp];
    const auto aimed = find_target(from, inside.place, surface.position, beyond);
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

  const Prepared<L>& p_;
  DirectLight<L> direct_;
  float all_ = 0;  ///< probabilities of the lamps that are aimed at
  mutable std::int64_t exits_ = 0;
  AimExcess<L>* excess_ = nullptr;
};

}  // namespace selenite
