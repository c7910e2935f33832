// SPDX-License-Identifier: GPL-3.0-or-later
#include <limits>

#include "math/fault.h"
#include "math/sampling.h"
#include "scene/area_light.h"

// Radiometry of Blender's lamps: docs/method/rendering.md, "Lamps" (measured on 3.4 and 4.5).
namespace selenite {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
/// Blender's own pi is a float, a little more than pi.
constexpr double kHalfTurn = kPi<float>;

void require(bool good, const Light& light, const char* what, double value, const char* range) {
  if (!good)
    throw Refused("Light '" + light.name + "'",
                  std::string(what) + " = " + std::to_string(value) + " is not permitted",
                  std::string("set it to ") + range);
}

float luminance(const Color<double>& c) {
  return static_cast<float>(0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b);
}

float smoothstep(float x) {
  x = clamp(x, 0.0f, 1.0f);
  return x * x * (3 - 2 * x);
}

/// By direction from the light; 1 for all but spots.
float spot_factor(const Light& light, const Vec3f& from_light) {
  if (light.kind != LightKind::kSpot) return 1;
  const Vec3f local{dot(from_light, light.u), dot(from_light, light.v),
                    dot(from_light, light.axis)};
  const float c = local.z / length(local);
  if (!(c > light.cos_outer)) return 0;
  const float width = (1 - light.cos_outer) * static_cast<float>(light.spot_blend);
  float factor = width > 0 ? smoothstep((c - light.cos_outer) / width) : 1;
  if (light.units == LightUnits::kBlender3) factor *= c;
  return factor;
}

}  // namespace

void Light::prepare(const Vec3d& origin) {
  require(values.power >= 0 && std::isfinite(values.power), *this, "power", values.power,
          "a finite number, at least 0");
  for (int c = 0; c < 3; ++c)
    require(values.color[c] >= 0 && std::isfinite(values.color[c]), *this, "colour",
            values.color[c], "finite numbers, at least 0");
  require(radius >= 0 && std::isfinite(radius), *this, "radius", radius, "at least 0");
  require(radiance_scale >= 0 && std::isfinite(radiance_scale), *this, "radiance scale",
          radiance_scale, "at least 0");

  for (const auto& row : to_world.m)
    require(std::isfinite(row[3]), *this, "location", row[3], "a finite number");
  const bool blender3 = units == LightUnits::kBlender3;
  position = Vec3f(to_world.translation() - origin);
  const Vec3d x = to_world.column(0), y = to_world.column(1), z = to_world.column(2);
  require(length(z) > 0, *this, "scale", length(z), "more than 0");
  axis = Vec3f(-normalize(z));
  const double pi = kPi<double>;
  double scale_exact = 0;
  switch (kind) {
    case LightKind::kPoint:
    case LightKind::kSpot: {
      // Delta: intensity per watt. Sphere or disc: radiance per watt.
      scale_exact = radius > 0 ? 1 / (4 * pi * pi * radius * radius) : 1 / (4 * pi);
      area = static_cast<float>(pi * radius * radius);
      if (kind == LightKind::kSpot) {
        require(spot_size > 0 && spot_size <= kHalfTurn, *this, "spot size", spot_size, "(0, pi]");
        require(spot_blend >= 0 && spot_blend <= 1, *this, "spot blend", spot_blend, "[0, 1]");
        cos_outer = static_cast<float>(std::cos(spot_size / 2));
        if (blender3) {  // the cone is round whatever the object's scale
          const auto frame = Frame<float>::from_normal(axis);
          u = frame.s;
          v = frame.t;
          break;
        }
        // Scale and shear of the object stretch the cone: angles are measured in the lamp's own frame,
        // by the rows of the inverse matrix.
        const double determinant = to_world.determinant();
        require(determinant != 0, *this, "scale", determinant, "more than 0 in every direction");
        u = Vec3f(cross(y, z) / determinant);
        v = Vec3f(cross(z, x) / determinant);
        axis = Vec3f(-(cross(x, y) / determinant));
      }
      break;
    }
    case LightKind::kSun: {
      require(angle >= 0 && angle <= kHalfTurn, *this, "angle", angle, "[0, pi]");
      const double half = angle / 2, sine = std::sin(half);
      one_minus_cos_sun = static_cast<float>(2 * square(std::sin(half / 2)));
      const double projected = blender3 ? square(std::tan(half)) : square(sine);
      scale_exact = angle > 0 ? 1 / (pi * projected) : 1;
      break;
    }
    case LightKind::kArea: {
      require(size_x > 0 && std::isfinite(size_x), *this, "size x", size_x, "more than 0");
      require(size_y > 0 && std::isfinite(size_y), *this, "size y", size_y, "more than 0");
      require(spread >= 0 && spread <= kHalfTurn, *this, "spread", spread, "[0, pi]");
      u = Vec3f(x * (size_x / 2));
      v = Vec3f(y * (size_y / 2));
      const Vec3d normal = cross(x, y);
      axis = Vec3f(-normalize(dot(normal, z) < 0 ? -normal : normal));
      const double rectangle = length(x) * size_x * length(y) * size_y;
      const double exact_area = ellipse ? rectangle * pi / 4 : rectangle;
      require(exact_area > 0, *this, "area", exact_area, "more than 0");
      area = static_cast<float>(exact_area);
      scale_exact = blender3 ? 1 / (4 * exact_area) : 1 / (pi * exact_area);
      tan_spread = kInfinity;
      if (spread < kHalfTurn) {
        const double half = std::max(spread / 2, 1e-3);  // Blender's slider stops at 1 degree
        tan_spread = static_cast<float>(std::tan(half));
        spread_norm = static_cast<float>(std::tan(half) / (std::tan(half) - half));
      }
      break;
    }
  }
  scale = static_cast<float>(scale_exact * radiance_scale);
}

Box Light::bounds() const {
  const auto r = static_cast<float>(radius);
  const Vec3f reach = kind == LightKind::kArea
                          ? Vec3f{std::abs(u.x) + std::abs(v.x), std::abs(u.y) + std::abs(v.y),
                                  std::abs(u.z) + std::abs(v.z)}
                          : Vec3f{r, r, r};
  Box box;
  box.include(position - reach);
  box.include(position + reach);
  return box;
}

bool Light::is_delta() const {
  switch (kind) {
    case LightKind::kSun:
      return one_minus_cos_sun == 0;
    case LightKind::kArea:
      return false;
    case LightKind::kPoint:
    case LightKind::kSpot:
      break;
  }
  return radius == 0;
}

float Light::flux(float scene_radius) const {
  const float weight = luminance(values.color) * static_cast<float>(values.power * radiance_scale);
  return kind == LightKind::kSun ? weight * kPi<float> * square(scene_radius) : weight;
}

std::optional<LightSample> Light::sample(const Vec3f& point, float u1, float u2) const {
  if (kind == LightKind::kSun) {
    if (is_delta()) return LightSample{-axis, kInfinity, 1, scale, true};
    const Frame<float> frame = Frame<float>::from_normal(-axis);
    const Vec3f local = square_to_cone(u1, u2, one_minus_cos_sun);
    return LightSample{frame.to_world(local), kInfinity, 1 / (2 * kPi<float> * one_minus_cos_sun),
                       scale, false};
  }

  if (kind == LightKind::kArea) {
    const auto s = sample_area(*this, point, u1, u2);
    if (!s.exists) return std::nullopt;
    return LightSample{s.direction, s.distance, s.density, s.factor, false};
  }

  const Vec3f to_center = position - point;
  const float center_distance2 = dot(to_center, to_center);
  if (!(center_distance2 > 0)) return std::nullopt;
  const float center_distance = std::sqrt(center_distance2);
  const Vec3f towards = to_center / center_distance;
  if (is_delta()) {
    const float factor = scale * spot_factor(*this, -towards) / center_distance2;
    if (!(factor > 0)) return std::nullopt;
    return LightSample{towards, center_distance, 1, factor, true};
  }
  const Frame<float> frame = Frame<float>::from_normal(towards);
  const auto r = static_cast<float>(radius);
  if (soft_falloff) {
    const Vec2f s = square_to_disc(u1, u2);
    const Vec3f d = to_center + (frame.s * s.x + frame.t * s.y) * r;
    const float distance2 = dot(d, d), distance = std::sqrt(distance2);
    const Vec3f direction = d / distance;
    const float factor = scale * spot_factor(*this, -direction);
    if (!(factor > 0)) return std::nullopt;
    return LightSample{direction, distance, distance2 / (dot(direction, towards) * area), factor,
                       false};
  }
  // Sphere: the cone it fills, or all directions from inside it.
  const bool inside = center_distance <= r;
  const float one_minus_cos =
      inside ? 2 : square(r) / center_distance2 / (1 + safe_sqrt(1 - square(r) / center_distance2));
  const Vec3f direction = frame.to_world(square_to_cone(u1, u2, one_minus_cos));
  const float along = dot(direction, to_center);
  const Vec3f perpendicular = to_center - direction * along;
  const float half_chord = safe_sqrt(square(r) - dot(perpendicular, perpendicular));
  const float factor = scale * spot_factor(*this, -direction);
  if (!(factor > 0)) return std::nullopt;
  return LightSample{direction, inside ? along + half_chord : along - half_chord,
                     1 / (2 * kPi<float> * one_minus_cos), factor, false};
}

std::optional<LightHit> Light::intersect(const Vec3f& origin, const Vec3f& direction, float t_min,
                                         float t_max) const {
  if (is_delta()) return std::nullopt;
  if (kind == LightKind::kSun) {
    if (t_max != kInfinity) return std::nullopt;
    const Vec3f difference = direction + axis;  // |difference|^2 / 2 = 1 - cos
    if (dot(difference, difference) > 2 * one_minus_cos_sun) return std::nullopt;
    return LightHit{1 / (2 * kPi<float> * one_minus_cos_sun), scale, kInfinity};
  }
  if (kind == LightKind::kArea) {
    const auto hit = intersect_area(*this, origin, direction, t_min, t_max);
    if (!hit.exists) return std::nullopt;
    return LightHit{hit.density, hit.factor, hit.distance};
  }
  const Vec3f to_center = position - origin;
  const float distance2 = dot(to_center, to_center);
  const auto r = static_cast<float>(radius);
  const float along = dot(direction, to_center);
  const float factor = scale * spot_factor(*this, -direction);
  if (soft_falloff) {
    if (!(along > 0)) return std::nullopt;
    const float t = distance2 / along;  // plane through the centre, facing the origin
    const Vec3f d = direction * t - to_center;
    if (!(t > t_min && t < t_max) || dot(d, d) > r * r) return std::nullopt;
    const float cos_light = along / std::sqrt(distance2);
    return LightHit{t * t / (cos_light * area), factor, t};
  }
  const Vec3f perpendicular = to_center - direction * along;
  const float half_chord2 = r * r - dot(perpendicular, perpendicular);
  if (!(half_chord2 > 0)) return std::nullopt;
  const bool inside = distance2 <= r * r;
  const float t = inside ? along + std::sqrt(half_chord2) : along - std::sqrt(half_chord2);
  if (!(t > t_min && t < t_max)) return std::nullopt;
  const float ratio = r * r / distance2;
  const float one_minus_cos = inside ? 2 : ratio / (1 + safe_sqrt(1 - ratio));
  return LightHit{1 / (2 * kPi<float> * one_minus_cos), factor, t};
}

}  // namespace selenite
