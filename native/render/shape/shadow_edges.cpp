// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/shape/shadow_edges.h"

#include <algorithm>
#include <cmath>

namespace selenite {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
/// How far rays pass beside an edge, in lengths of it.
constexpr float kBeside = 1e-4f;
/// Relative difference of distances at which two rays meet the same point.
constexpr float kSamePoint = 1e-3f;

/// Whether some point of a sphere may see the edge as an outline.
bool may_be_outline(const MovedMesh& mesh, const MeshEdge& edge, const Vec3f& centre,
                    float radius) {
  if (edge.second < 0) return true;
  const Vec3f& at = mesh.mesh().positions[edge.from];
  const auto height = [&](int triangle) {
    return dot(mesh.geometry.face(mesh.instance, triangle)->ng, centre - at);
  };
  const float a = height(edge.first), b = height(edge.second);
  return !(a > radius && b > radius) && !(a < -radius && b < -radius);
}

}  // namespace

ShadowEdges::ShadowEdges(const Prepared<0>& prepared, const PixelCamera& camera,
                         const RenderSettings& settings, const MovedMesh& mesh,
                         const std::vector<MeshEdge>& edges, const std::vector<Colorf>& weights)
    : p_(prepared),
      camera_(camera),
      settings_(settings),
      mesh_(mesh),
      edges_(edges),
      weights_(weights),
      place_(CameraPlace::of(camera.camera())),
      direct_(prepared, place_) {
  const auto& positions = mesh.mesh().positions;
  const auto size = [&](const MeshEdge& edge) {
    return length(positions[edge.to] - positions[edge.from]);
  };
  for (const int i : p_.lamps) {
    const Light& lamp = p_.scene.appearance.lights[i];
    if (!lamp.casts_shadows) continue;
    OfLamp& of_lamp = lamps_.emplace_back(OfLamp{i, {}});
    Vec3f centre;
    float radius = 0;
    if (lamp.has_place()) {
      const Box box = lamp.bounds();
      centre = (box.low + box.high) * 0.5f;
      radius = length(box.high - box.low) / 2;
    }
    for (std::size_t e = 0; e < edges.size(); ++e) {
      Vec3f seen_from = centre;
      float reach = radius;
      if (!lamp.has_place()) {  // a sphere at distance 1 that the sun's disc fills
        seen_from = positions[edges[e].from] - lamp.axis;
        reach = safe_sqrt(lamp.one_minus_cos_sun * (2 - lamp.one_minus_cos_sun)) + 1e-5f;
      }
      if (may_be_outline(mesh, edges[e], seen_from, reach))
        of_lamp.choice.add(static_cast<int>(e), size(edges[e]));
    }
    if (!(of_lamp.choice.total() > 0)) lamps_.pop_back();
  }
  const World& world = p_.scene.appearance.world;
  if (world.on && world.values.strength > 0)
    for (std::size_t e = 0; e < edges.size(); ++e)
      world_.add(static_cast<int>(e), size(edges[e]) * angle_of(mesh, edges[e]));
}

void ShadowEdges::add(int i, int count, VertexSums& sums) const {
  const Random random(settings_.seed, static_cast<std::uint32_t>(i), 0xfffffffd);
  const double u = (i + static_cast<double>(random.uniform(0))) / count;
  for (std::size_t k = 0; k < lamps_.size(); ++k)
    add_of_lamp(lamps_[k], random.branch(static_cast<std::uint32_t>(k + 1)), u, count, sums);
  if (world_.total() > 0) add_of_world(random.branch(0), u, count, sums);
}

void ShadowEdges::add_of_lamp(const OfLamp& of_lamp, const Random& random, double u, int count,
                              VertexSums& sums) const {
  const auto drawn = of_lamp.choice.draw(u);
  const MeshEdge& edge = edges_[drawn.edge];
  const auto& positions = mesh_.mesh().positions;
  const Vec3f at = positions[edge.from] + (positions[edge.to] - positions[edge.from]) * drawn.along;
  const Light& lamp = p_.scene.appearance.lights[of_lamp.lamp];
  const auto s = lamp.sample(at, random.uniform(1), random.uniform(2));
  if (!s || !(s->density > 0) || !is_outline(mesh_, edge, s->direction)) return;
  const auto share = static_cast<float>(of_lamp.choice.total() / count);
  add({edge, drawn.along, s->direction, s->distance,
       p_.emitted.lamp(of_lamp.lamp, s->factor).value * (share / s->density), lamp.links},
      random, sums);
}

void ShadowEdges::add_of_world(const Random& random, double u, int count, VertexSums& sums) const {
  const auto drawn = world_.draw(u);
  const MeshEdge& edge = edges_[drawn.edge];
  const auto& positions = mesh_.mesh().positions;
  const Vec3f along = normalize(positions[edge.to] - positions[edge.from]);
  // Between the planes of both triangles, evenly by solid angle, on either side of the edge.
  const Vec3f first = mesh_.geometry.face(mesh_.instance, edge.first)->ng;
  const Vec3f start = cross(first, along);
  const float angle = angle_of(mesh_, edge);
  float turn = angle * random.uniform(1);
  if (edge.second >= 0 &&
      dot(cross(first, mesh_.geometry.face(mesh_.instance, edge.second)->ng), along) < 0)
    turn = -turn;
  const Vec3f across = start * std::cos(turn) + cross(along, start) * std::sin(turn);
  const float side = random.uniform(2) < 0.5f ? -1.0f : 1.0f;
  const float cosine = 2 * random.uniform(3) - 1;
  const Vec3f direction = along * cosine + across * (side * safe_sqrt(1 - cosine * cosine));

  Path path;
  path.density = Path::kSingular;
  path.kind = kDiffuseRay;
  path.ray.direction = direction;
  Radiance<0> radiance(0);
  const Throughput<0> through(0);
  direct_.add_world(path, through, radiance);
  // density: 1 / (4 angle) per solid angle, length angle / total per length.
  add({edge, drawn.along, direction, kInfinity,
       radiance.value * static_cast<float>(4 * world_.total() / count), LinkedSets{}},
      random, sums);
}

void ShadowEdges::add(const Grazing& grazing, const Random& random, VertexSums& sums) const {
  if (max_channel(grazing.light) == 0) return;
  const MeshEdge& edge = grazing.edge;
  const auto& positions = mesh_.mesh().positions;
  const Vec3f &from = positions[edge.from], &to = positions[edge.to];
  const float size = length(to - from);
  const Vec3f at = from + (to - from) * grazing.along;
  const Vec3f along = (to - from) / size;
  // Out of the body, across edge and light.
  const Vec3f unnormalised = cross(grazing.direction, along);
  const float sine = length(unnormalised);
  if (!(sine > 1e-4f)) return;
  Vec3f out = unnormalised / sine;
  if (dot(out, positions[edge.across_first] - at) > 0) out = -out;
  if (edge.second >= 0) {
    // A notch: light passes on neither side.
    const auto& t = mesh_.mesh().triangles[edge.second];
    for (const int vertex : t)
      if (vertex != edge.from && vertex != edge.to && dot(out, positions[vertex] - at) > 0) return;
  }
  const Vec3f start = at + out * (kBeside * size);

  const Vec3f away = -grazing.direction;
  const auto lit = p_.geometry.intersect({start, away, 0, kInfinity}, kShadowRay);
  if (!lit) return;
  const Surface lit_surface = p_.geometry.surface(*lit);
  const auto place = camera_.project(Vec3d(lit_surface.position));
  if (!(place.x >= 0 && place.y >= 0 && place.x < settings_.width && place.y < settings_.height))
    return;
  const auto pixel =
      static_cast<std::size_t>(place.y) * settings_.width + static_cast<std::size_t>(place.x);
  const Colorf& weight = weights_[pixel];
  if (!settings_.has(pixel) || (weight.r == 0 && weight.g == 0 && weight.b == 0)) return;

  // What the camera sees there.
  const Ray ray = camera_.ray(static_cast<float>(place.x), static_cast<float>(place.y));
  const auto seen = p_.geometry.intersect(ray, kCameraRay);
  const float distance = length(lit_surface.position - ray.origin);
  if (!seen || seen->instance != lit->instance ||
      std::abs(seen->t - distance) > kSamePoint * distance)
    return;
  const Scattering here(p_, place_, *lit, -ray.direction, {}, false);
  if (here.material().transparent) return;
  const Colorf value = here.value(grazing.direction);
  if (max_channel(value) == 0) return;
  Path path;
  Throughput<0> through(0);
  MediaStack<0> media(p_);
  if (!direct_.visible(path, start, grazing.direction, grazing.distance, grazing.links, random,
                       media, through))
    return;

  // Pixels per area of the surface.
  const Vec3f& ng = lit_surface.ng;
  const auto plane = Frame<float>::from_normal(ng);
  const double step = 1e-4 * distance;
  const auto change = [&](const Vec3f& axis) {
    const Vec3d p(lit_surface.position), d = Vec3d(axis) * step;
    const auto before = camera_.project(p - d), after = camera_.project(p + d);
    return Vec2<double>{(after.x - before.x) / (2 * step), (after.y - before.y) / (2 * step)};
  };
  const auto s = change(plane.s), t = change(plane.t);
  const auto pixels = static_cast<float>(std::abs(s.x * t.y - s.y * t.x));
  const float cosine = std::abs(dot(ng, grazing.direction));
  if (!(cosine > 1e-5f)) return;

  const Colorf product = weight * value * grazing.light * through.value;
  // Light is lost where the edge moves out.
  const float scale = -(product.r + product.g + product.b) * pixels * sine / cosine;
  if (!std::isfinite(scale)) return;
  sums.add_vertex(edge.from, out * (scale * (1 - grazing.along)));
  sums.add_vertex(edge.to, out * (scale * grazing.along));
  if (!mesh_.has(*lit)) return;
  const float share =
      grazing.distance == kInfinity ? 1 : grazing.distance / (grazing.distance + lit->t);
  PointSlopes slopes{out * (-scale * share), {}};
  slopes.spread_of_ray(*lit, lit_surface, ray.direction, sums);
}

}  // namespace selenite
