// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/shape/silhouettes.h"

#include <algorithm>
#include <cmath>

namespace selenite {
namespace {

/// Pixels between the edge and the places where radiance is asked for on both sides.
constexpr double kBeside = 2e-3;
/// By how much nearer than the edge something must be to hide it.
constexpr float kNearer = 1e-3f;
/// Between two faces that are as good as one.
constexpr float kLeastAngle = 1e-4f;

/// How far a vertex moves along `across` in the picture, by its position.
Vec3f slope_of(const PixelCamera& camera, const Vec3d& vertex, const Vec2<double>& across,
               double step) {
  const auto along = [&](const Vec3d& axis) {
    const auto before = camera.project(vertex - axis * step);
    const auto after = camera.project(vertex + axis * step);
    return static_cast<float>(((after.x - before.x) * across.x + (after.y - before.y) * across.y) /
                              (2 * step));
  };
  return {along({1, 0, 0}), along({0, 1, 0}), along({0, 0, 1})};
}

}  // namespace

int edge_samples(const RenderSettings& settings) {
  constexpr int kPerSide = 16;
  const auto count =
      static_cast<std::int64_t>(settings.spp) * kPerSide * (settings.width + settings.height) / 2;
  return static_cast<int>(std::min<std::int64_t>(count, 1 << 30));
}

Silhouettes::Silhouettes(const Prepared<0>& prepared, const PixelCamera& camera,
                         const RenderSettings& settings, const MovedMesh& mesh,
                         const std::vector<MeshEdge>& edges, const std::vector<Colorf>& weights)
    : p_(prepared), camera_(camera), settings_(settings), weights_(weights) {
  const Vec3f eye(camera.camera().to_world.translation());
  const Vec3f ahead(-camera.camera().to_world.column(2));
  const auto& positions = mesh.mesh().positions;
  for (const MeshEdge& edge : edges) {
    const Vec3f towards = camera.camera().orthographic ? -ahead : eye - positions[edge.from];
    if (!is_seen(mesh, edge, towards)) continue;
    const float importance =
        edge.crease || is_outline(mesh, edge, towards) ? 1 : std::min(angle_of(mesh, edge), 1.0f);
    auto found = [&]() -> std::optional<Seen> {
      const Vec3d a(positions[edge.from]), b(positions[edge.to]);
      Seen s{edge.from, edge.to, camera.project(a), camera.project(b), {}, {}, {}};
      const double dx = s.end.x - s.start.x, dy = s.end.y - s.start.y;
      const double size = std::hypot(dx, dy);
      if (!(size > 0) || !std::isfinite(size)) return std::nullopt;  // behind the camera
      const bool outside = std::max(s.start.x, s.end.x) < 0 || std::max(s.start.y, s.end.y) < 0 ||
                           std::min(s.start.x, s.end.x) > settings.width ||
                           std::min(s.start.y, s.end.y) > settings.height;
      if (outside) return std::nullopt;
      s.across = {-dy / size, dx / size};
      const auto depth = [&](const Vec3d& p) {
        return static_cast<float>(camera.camera().orthographic ? dot(p - Vec3d(eye), Vec3d(ahead))
                                                               : selenite::length(p - Vec3d(eye)));
      };
      s.nearest = std::min(depth(a), depth(b));
      const double step = 1e-4 * std::max(1e-30f, s.nearest);
      s.start_slope = slope_of(camera, a, s.across, step);
      s.end_slope = slope_of(camera, b, s.across, step);
      return s;
    }();
    if (!found) continue;
    if (!(importance > kLeastAngle)) continue;
    const double size = std::hypot(found->end.x - found->start.x, found->end.y - found->start.y);
    found->share = 1 / importance;
    choice_.add(static_cast<int>(edges_.size()), size * importance);
    edges_.push_back(*found);
  }
}

Colorf Silhouettes::seen_at(const Seeing& see, const Vec2<double>& place, const Seen& edge,
                            Random& random, bool& hidden) const {
  Ray ray = camera_.ray(static_cast<float>(place.x), static_cast<float>(place.y));
  const float start = ray.t_min;
  if (p_.any_medium)
    ray = {ray.origin + ray.direction * start, ray.direction, 0, ray.t_max - start};
  const auto hit = p_.geometry.intersect(ray, kCameraRay);
  const float reach = hit ? hit->t + (p_.any_medium ? start : 0) : 0;
  hidden = hit && reach < edge.nearest * (1 - kNearer);
  if (hidden) return {};
  return see(ray, hit, random);
}

void Silhouettes::add(const Seeing& see, int i, int count, VertexSums& sums) const {
  if (edges_.empty()) return;
  Random random(settings_.seed, static_cast<std::uint32_t>(i), 0xfffffffe);
  const auto drawn = choice_.draw((i + static_cast<double>(random.uniform(0))) / count);
  const Seen& edge = edges_[drawn.edge];
  const double t = drawn.along;
  const Vec2<double> at{edge.start.x + (edge.end.x - edge.start.x) * t,
                        edge.start.y + (edge.end.y - edge.start.y) * t};
  if (!(at.x >= 0 && at.y >= 0 && at.x < settings_.width && at.y < settings_.height)) return;
  const auto pixel =
      static_cast<std::size_t>(at.y) * settings_.width + static_cast<std::size_t>(at.x);
  const Colorf& weight = weights_[pixel];
  if (!settings_.has(pixel) || (weight.r == 0 && weight.g == 0 && weight.b == 0)) return;

  bool hidden = false;
  Colorf jump;
  for (const double side : {-1.0, 1.0}) {
    Random stream = random;  // equal numbers on both sides leave less noise in the difference
    const Colorf found = seen_at(
        see, {at.x + edge.across.x * (side * kBeside), at.y + edge.across.y * (side * kBeside)},
        edge, stream, hidden);
    if (hidden || !is_finite(found)) return;
    jump += found * static_cast<float>(-side);
  }
  const Colorf product = weight * jump;
  const auto scale = static_cast<float>((product.r + product.g + product.b) * choice_.total() /
                                        count * edge.share);
  const auto share = static_cast<float>(t);
  sums.add_vertex(edge.from, edge.start_slope * (scale * (1 - share)));
  sums.add_vertex(edge.to, edge.end_slope * (scale * share));
}

}  // namespace selenite
