// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/shape/moved_paths.h"

#include <algorithm>
#include <cmath>

namespace selenite {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kMost = 64;  ///< points of a path whose derivatives are followed
constexpr int kRouletteStart = 4;
constexpr float kFlat = 1e-6f;        ///< of the cosine between both normals: nothing is cut off
constexpr float kBesideEdge = 1e-4f;  ///< radians, on both sides of a horizon
/// Random numbers of a path's point that no path tracer uses.
constexpr std::uint32_t kHorizonWorld = 1 << 12, kHorizonLamp = kHorizonWorld + 1,
                        kHorizonAngle = kHorizonWorld + 2;

float sum(const Colorf& c) { return c.r + c.g + c.b; }
bool is_zero(const Colorf& c) { return c.r == 0 && c.g == 0 && c.b == 0; }

/// 1 / value where there is one: a channel that is black stays so.
Colorf inverse(const Colorf& value) {
  return map(value, [](float v) { return v > 0 ? 1 / v : 0.0f; });
}

/// Where a path goes on from a point.
struct Drawn {
  Vec3f wo;
  float density;
  Colorf weight;
  bool diffuse;
};

/// Of `draw`, by that of the bsdf.
float density_of(const Scattering& here, const Vec3f& wo, float bsdf) {
  const bool before = dot(here.surface.ng, wo) * here.side() > 0;
  return bsdf / 2 + (before ? 1 / (4 * kPi<float>) : 0);
}

/// By the bsdf or evenly over the hemisphere: towards the horizon a bsdf falls to 0, but not its
/// derivative.
std::optional<Drawn> draw(const Scattering& here, const Random& random) {
  const float u = random.uniform(kLobe), u1 = random.uniform(kLobe1), u2 = random.uniform(kLobe2);
  return here.with_bsdf([&](const auto& bsdf) -> std::optional<Drawn> {
    Drawn drawn{{}, 0, {}, true};
    if (u < 0.5f) {
      const auto s = bsdf.sample(2 * u, u1, u2);
      if (!s || s->singular || s->transmits || s->enters) return std::nullopt;
      drawn.wo = s->wo;
      drawn.diffuse = s->diffuse;
    } else {
      const auto frame = Frame<float>::from_normal(here.surface.ng * here.side());
      drawn.wo = frame.to_world(square_to_cone(u1, u2, 1.0f));
    }
    Colorf value;
    float density = 0;
    bsdf.value_and_density(drawn.wo, value, density);
    drawn.density = density_of(here, drawn.wo, density);
    if (is_zero(value) || !(drawn.density > 0)) return std::nullopt;
    drawn.weight = value / drawn.density;
    return drawn;
  });
}

/// How the sample of a lamp changes with the point that it lights, at equal random numbers.
struct LampSlopes {
  std::array<Vec3f, 3> direction;  ///< by each coordinate
  Vec3f flow;                      ///< by factor / density

  LampSlopes(const Light& lamp, const Vec3f& point, float distance, float u1, float u2)
      : direction{} {
    if (distance == kInfinity) return;
    const float h = 1e-3f * distance;
    for (int k = 0; k < 3; ++k) {
      const Vec3f step{k == 0 ? h : 0, k == 1 ? h : 0, k == 2 ? h : 0};
      const auto before = lamp.sample(point - step, u1, u2);
      const auto after = lamp.sample(point + step, u1, u2);
      if (!before || !after) continue;
      direction[k] = (after->direction - before->direction) / (2 * h);
      const float change =
          (after->factor / after->density - before->factor / before->density) / (2 * h);
      (k == 0 ? flow.x : k == 1 ? flow.y : flow.z) = change;
    }
  }
};

}  // namespace

MovedPaths::MovedPaths(const Prepared<0>& prepared, const PixelCamera& camera, int depth,
                       const MovedMesh& mesh)
    : p_(prepared),
      depth_(depth),
      mesh_(mesh),
      place_(CameraPlace::of(camera.camera())),
      direct_(prepared, place_) {}

void MovedPaths::add(CameraSamples::Sample& sample, const Colorf& weight, VertexSums& sums) {
  if (!sample.hit) return;
  Random& random = sample.random;
  Path path;
  path.ray = sample.ray;
  path.from = sample.ray.origin;
  std::optional<Hit> hit = sample.hit;
  Colorf beta(1), total;
  vertices_.clear();

  for (int i = 0;; ++i) {
    random.start_bounce(static_cast<std::uint32_t>(i) + 1);
    const Vec3f wi = -path.ray.direction;
    Vertex& vertex = vertices_.emplace_back();
    vertex.here.emplace(p_, place_, *hit, wi, path.facts, path.after_diffuse);
    vertex.distance = hit->t;
    const Scattering& here = *vertex.here;
    if (here.material().transparent || here.material().has_medium) break;
    if (here.material().emissive)
      total += beta * here.with_bsdf([](const auto& bsdf) { return bsdf.emission(); });
    if (depth_ > 0 && path.scatterings >= depth_) break;
    if (moves(i)) add_horizon(i, path, random, weight * beta, sums);
    add_light_sample(i, path, random, weight, beta, total);

    const auto drawn = draw(here, random);
    if (!drawn || i + 1 == kMost) break;
    vertex.before = total;
    vertex.wo = drawn->wo;
    beta = beta * drawn->weight;
    if (++path.scatterings >= kRouletteStart) {
      const float survival = std::min(max_channel(beta), 1.0f);
      if (!(random.uniform(kRoulette) < survival)) break;
      beta = beta / survival;
    }
    path.after_diffuse = path.after_diffuse || drawn->diffuse;
    path.count(false, drawn->diffuse, false);
    path.density = drawn->density;
    path.kind = drawn->diffuse ? kDiffuseRay : kGlossyRay;
    path.receiver = hit->instance;
    path.from = here.surface.position;
    path.ray = {here.surface.leave(drawn->wo), drawn->wo, 0, kInfinity};
    hit = p_.geometry.intersect(path.ray, path.kind);
    const bool next_moves = hit && mesh_.has(*hit);
    if (matters(i, next_moves)) vertex.onwards = here.slopes(drawn->wo);
    if (!hit) {
      Radiance<0> radiance(0);
      Throughput<0> through(0);
      direct_.add_world(path, through, radiance);
      total += beta * radiance.value;
      break;
    }
  }
  finish(static_cast<int>(vertices_.size()), weight, total, sample.ray.direction, sums);
}

void MovedPaths::add_light_sample(int i, const Path& path, const Random& random,
                                  const Colorf& weight, const Colorf& beta, Colorf& total) {
  const auto choice = p_.lights.choose(random.uniform(kLightChoice));
  const bool lamp_chosen = choice.source == LightSampler::Source::kLamp;
  if (!lamp_chosen && choice.source != LightSampler::Source::kWorld) return;
  const float u1 = random.uniform(kLight1), u2 = random.uniform(kLight2);
  Vertex& vertex = vertices_[i];
  const Scattering& here = *vertex.here;
  const Vec3f& position = here.surface.position;

  Vec3f wo;
  float distance = kInfinity, density = 0, share = 1;
  Colorf emitted;
  LinkedSets links;
  bool casts_shadows = true;
  if (lamp_chosen) {
    const Light& lamp = p_.scene.appearance.lights[choice.index];
    if (!(lamp.visible_to & kDiffuseRay) || !direct_.lit(lamp.links, here.hit.instance)) return;
    const auto s = lamp.sample(position, u1, u2);
    if (!s) return;
    wo = s->direction;
    distance = s->distance;
    density = s->density * choice.probability;
    links = lamp.links;
    casts_shadows = lamp.casts_shadows;
    emitted = p_.emitted.lamp(choice.index, s->factor).value;
  } else {
    const World& world = p_.scene.appearance.world;
    if (!(world.visible_to & kDiffuseRay)) return;
    wo = world.sample(u1, u2, density);
    density *= choice.probability;
    emitted = p_.emitted.world_along(wo).value;
  }
  if (!(density > 0)) return;
  Colorf value;
  float chance = 0;
  here.with_bsdf([&](const auto& bsdf) { bsdf.value_and_density(wo, value, chance); });
  if (is_zero(value) || is_zero(emitted)) return;
  if (!lamp_chosen)
    share = power_heuristic(p_.lights.world_density(wo, direct_.as_cycles(false)),
                            density_of(here, wo, chance));
  Throughput<0> through(0);
  MediaStack<0> media(p_);
  if (casts_shadows &&
      !direct_.visible(path, here.surface.leave(wo), wo, distance, links, random, media, through))
    return;
  const Colorf light = through.value * emitted * (share / density);
  total += beta * value * light;
  if (!matters(i, false)) return;

  const ScatteringSlopes slopes = here.slopes(wo);
  const Colorf by_value = weight * beta * light;
  const DirectionSlopes found(slopes, by_value);
  spread_directions(i, found, wo, nullptr);
  if (!lamp_chosen || !moves(i)) return;
  const Light& lamp = p_.scene.appearance.lights[choice.index];
  const LampSlopes by_point(lamp, position, distance, u1, u2);
  // The light is proportional to factor / density.
  const auto drawn = lamp.sample(position, u1, u2);
  const float by_flow = sum(by_value * value) * drawn->density / drawn->factor;
  vertex.slopes.position +=
      Vec3f{dot(found.by_wo, by_point.direction[0]), dot(found.by_wo, by_point.direction[1]),
            dot(found.by_wo, by_point.direction[2])} +
      by_point.flow * by_flow;
}

void MovedPaths::add_horizon(int i, const Path& path, const Random& random, const Colorf& weight,
                             VertexSums& sums) {
  const Scattering& here = *vertices_[i].here;
  const Vec3f &ng = here.surface.ng, &position = here.surface.position;
  if (dot(ng, here.surface.n) > 1 - kFlat) return;
  const auto plane = Frame<float>::from_normal(ng);
  const auto at = [&](float angle) {
    return plane.s * std::cos(angle) + plane.t * std::sin(angle);
  };
  const World& world = p_.scene.appearance.world;
  if (world.on && world.values.strength > 0) {
    Path away = path;
    away.density = Path::kSingular;
    away.kind = kDiffuseRay;
    away.ray.direction = at(2 * kPi<float> * random.uniform(kHorizonWorld));
    Radiance<0> radiance(0);
    Throughput<0> through(0);
    direct_.add_world(away, through, radiance);
    add_at_horizon(i, path, random, away.ray.direction, kInfinity,
                   weight * radiance.value * (2 * kPi<float>), sums);
  }

  const auto choice = p_.lights.choose(random.uniform(kHorizonLamp));
  if (choice.source != LightSampler::Source::kLamp) return;
  const Light& lamp = p_.scene.appearance.lights[choice.index];
  // Of a lamp without size no part goes down before the rest.
  if (lamp.is_delta() || !lamp.casts_shadows || !direct_.lit(lamp.links, here.hit.instance)) return;
  // The angles within a sphere around the lamp.
  Vec3f centre = -lamp.axis;
  float radius = safe_sqrt(lamp.one_minus_cos_sun * (2 - lamp.one_minus_cos_sun));
  if (lamp.has_place()) {
    const Box box = lamp.bounds();
    centre = lamp.position - position;
    radius = length(box.high - box.low) / 2;
  }
  const Vec3f local = plane.to_local(centre);
  if (std::abs(local.z) > radius) return;
  const float across = std::hypot(local.x, local.y);
  const float half = across > radius ? std::asin(radius / across) : kPi<float>;
  const float middle = std::atan2(local.y, local.x);
  const Vec3f direction = at(middle + half * (2 * random.uniform(kHorizonAngle) - 1));
  const auto found = lamp.intersect(position, direction, 0, kInfinity);
  if (!found || !(found->factor > 0)) return;
  add_at_horizon(
      i, path, random, direction, found->distance,
      weight * p_.emitted.lamp(choice.index, found->factor).value * (2 * half / choice.probability),
      sums);
}

void MovedPaths::add_at_horizon(int i, const Path& path, const Random& random,
                                const Vec3f& direction, float distance, const Colorf& light,
                                VertexSums& sums) {
  if (is_zero(light)) return;
  Vertex& vertex = vertices_[i];
  const Scattering& here = *vertex.here;
  const Vec3f& ng = here.surface.ng;
  Colorf jump;
  for (const float side : {1.0f, -1.0f}) {
    const Vec3f wo = normalize(direction + ng * (side * kBesideEdge));
    const Colorf value = here.value(wo);
    if (is_zero(value)) continue;
    Throughput<0> through(0);
    MediaStack<0> media(p_);
    if (direct_.visible(path, here.surface.leave(wo), wo, distance, {}, random, media, through))
      jump += through.value * value * side;
  }
  const float w = sum(jump * light);
  if (w == 0) return;
  // The lamp's point is above the plane where ng (y - x) is above 0.
  const auto corners = p_.geometry.corners(here.hit.instance, here.hit.triangle);
  const Vec3f e1 = corners[1] - corners[0], e2 = corners[2] - corners[0];
  const float size = length(cross(e1, e2));
  const Vec3f by_e1 = cross(e2, direction) * (w / size), by_e2 = cross(direction, e1) * (w / size);
  sums.add_position(here.hit.triangle, 0, -(by_e1 + by_e2));
  sums.add_position(here.hit.triangle, 1, by_e1);
  sums.add_position(here.hit.triangle, 2, by_e2);
  vertex.slopes.position += ng * (-w / distance);
}

void MovedPaths::spread_directions(int i, const DirectionSlopes& slopes, const Vec3f& wo,
                                   Vertex* next) {
  Vertex& vertex = vertices_[i];
  const Scattering& here = *vertex.here;
  const float side = here.side();
  vertex.slopes.normal += slopes.by_normal(here.wi, wo, here.surface.n * side) * side;
  vertex.slopes.b1 += slopes.by_b1;
  vertex.slopes.b2 += slopes.by_b2;
  if (i > 0) {  // the camera's ray stays as it is
    const Vec3f turned = slopes.by_wi / vertex.distance;
    vertices_[i - 1].slopes.position += turned;
    vertex.slopes.position += -turned;
  }
  if (next) {
    const Vec3f turned = slopes.by_wo / next->distance;
    next->slopes.position += turned;
    vertex.slopes.position += -turned;
  }
}

void MovedPaths::finish(int count, const Colorf& weight, const Colorf& total,
                        const Vec3f& direction, VertexSums& sums) {
  for (int i = 0; i < count; ++i) {
    Vertex& vertex = vertices_[i];
    if (!vertex.onwards) continue;
    const Colorf brought = weight * (total - vertex.before);
    if (is_zero(brought)) continue;
    const DirectionSlopes slopes(*vertex.onwards, brought * inverse(vertex.onwards->value));
    Vertex* const next = i + 1 < count ? &vertices_[i + 1] : nullptr;
    spread_directions(i, slopes, vertex.wo, next);
    if (!next) continue;
    // The solid angle of the next point's surroundings: |D (e1 x e2)| / |D|^3.
    const Geometry& geometry = p_.geometry;
    const Hit& hit = next->here->hit;
    const auto corners = geometry.corners(hit.instance, hit.triangle);
    const Vec3f d = next->here->surface.position - vertex.here->surface.position;
    const Vec3f e1 = corners[1] - corners[0], e2 = corners[2] - corners[0];
    const Vec3f doubled = cross(e1, e2);
    const float volume = dot(d, doubled), w = sum(brought);
    if (volume == 0) continue;
    const Vec3f by_way = (doubled / volume - d * (3 / dot(d, d))) * w;
    next->slopes.position += by_way;
    vertex.slopes.position += -by_way;
    if (!mesh_.has(hit)) continue;
    const Vec3f by_e1 = cross(e2, d) * (w / volume), by_e2 = cross(d, e1) * (w / volume);
    sums.add_position(hit.triangle, 0, -(by_e1 + by_e2));
    sums.add_position(hit.triangle, 1, by_e1);
    sums.add_position(hit.triangle, 2, by_e2);
  }
  for (int i = 0; i < count; ++i) {
    if (!moves(i)) continue;
    const Vertex& vertex = vertices_[i];
    if (i == 0)
      vertex.slopes.spread_of_ray(vertex.here->hit, vertex.here->surface, direction, sums);
    else
      vertex.slopes.spread_of_surface(vertex.here->hit, vertex.here->surface, sums);
  }
}

}  // namespace selenite
