// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/media/lamp_target.h"

namespace selenite {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
/// Relative; farther apart, two points of a lamp are not the same.
constexpr float kSamePoint = 1e-3f;

/// Where a ray from a surface meets a lamp as it stands for `from`, and its normal there.
struct LampPoint {
  Vec3f position, normal;
  float distance;
};
std::optional<LampPoint> meet(const Light& lamp, const Vec3f& from, const Vec3f& surface,
                              const Vec3f& direction) {
  if (lamp.kind != LightKind::kArea && lamp.soft_falloff) {
    // A disc, which faces the point from where it is drawn.
    const Vec3f normal = normalize(lamp.position - from);
    const float distance = dot(lamp.position - surface, normal) / dot(direction, normal);
    if (!(distance > 0)) return std::nullopt;
    return LampPoint{surface + direction * distance, normal, distance};
  }
  const auto hit = lamp.intersect(surface, direction, 0, kInfinity);
  if (!hit) return std::nullopt;
  const Vec3f position = surface + direction * hit->distance;
  return LampPoint{position,
                   lamp.kind == LightKind::kArea ? lamp.axis : normalize(position - lamp.position),
                   hit->distance};
}

}  // namespace

std::optional<LampTarget> draw_target(const Light& lamp, const Vec3f& from, float u1, float u2) {
  const auto s = lamp.sample(from, u1, u2);
  if (!s) return std::nullopt;
  if (!lamp.has_place()) return LampTarget{s->direction, true};
  return LampTarget{from + s->direction * s->distance, false};
}

std::optional<FoundTarget> find_target(const Light& lamp, const Vec3f& from, const Vec3f& surface,
                                       const Vec3f& direction) {
  if (lamp.is_delta()) {
    const auto target = draw_target(lamp, from, 0, 0);
    if (!target) return std::nullopt;
    return FoundTarget{*target, 1};
  }
  if (!lamp.has_place()) {
    const auto hit = lamp.intersect(surface, direction, 0, kInfinity);
    if (!hit) return std::nullopt;
    return FoundTarget{{direction, true}, hit->density};
  }
  const auto point = meet(lamp, from, surface, direction);
  if (!point) return std::nullopt;
  const Vec3f way = point->position - from;
  const float distance = length(way);
  const Vec3f aim = way / distance;
  const auto hit = lamp.intersect(from, aim, 0, kInfinity);
  if (!hit || !(hit->factor > 0)) return std::nullopt;
  if (std::abs(hit->distance - distance) > kSamePoint * distance) return std::nullopt;
  // From solid angle to solid angle, by the lamp's area.
  const float per_area = hit->density * std::abs(dot(aim, point->normal)) / square(distance);
  const float density =
      per_area * square(point->distance) / std::abs(dot(direction, point->normal));
  return FoundTarget{{point->position, false}, density};
}

std::optional<LightHit> lamp_along(const Light& lamp, const Vec3f& from, const Vec3f& direction) {
  if (lamp.is_delta()) {
    const auto s = lamp.sample(from, 0, 0);
    if (!s) return std::nullopt;
    return LightHit{0, s->factor, s->distance};
  }
  const auto hit = lamp.intersect(from, direction, 0, kInfinity);
  return hit && hit->factor > 0 ? hit : std::nullopt;
}

}  // namespace selenite
