// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "scene/shader/functions.h"
#include "scene/shader/inputs.h"

// Nodes that make normals and what depends on the angle to one. All are on the viewer's side.
namespace selenite::shading {

template <class T>
Vec3<T> lifted_vector(const Vec3f& v) {
  return vector_of(lifted<T>(v));
}

/// Of a dielectric without absorption, unpolarised; `eta`: inside over outside.
template <class T>
T fresnel_dielectric(const T& cosine, const T& eta) {
  using S = scalar_t<T>;
  const T c = absolute(cosine), square = eta * eta - S(1) + c * c;
  if (!(value_of(square) > 0)) return T(1);
  const T g = safe_sqrt(square);
  const T a = (g - c) / (g + c), b = (c * (g + c) - S(1)) / (c * (g - c) + S(1));
  return a * a * (S(1) + b * b) * S(0.5);
}

inline constexpr double kLeastEta = 1e-5;

template <class T>
T fresnel(const ShadingPoint& point, const T& ior, const Vec3<T>& n) {
  const T eta = max(ior, T(scalar_t<T>(kLeastEta)));
  return fresnel_dielectric(dot(n, lifted_vector<T>(point.wi)),
                            point.backfacing() ? T(1) / eta : eta);
}

template <class T>
T layer_weight(const ShadingPoint& point, LayerMode mode, const T& blend, const Vec3<T>& n) {
  using S = scalar_t<T>;
  const T cosine = dot(n, lifted_vector<T>(point.wi));
  if (mode == LayerMode::kFresnel) {
    const T eta = max(S(1) - blend, T(S(kLeastEta)));
    return fresnel_dielectric(cosine, point.backfacing() ? eta : T(1) / eta);
  }
  T f = absolute(cosine);
  if (value_of(blend) != S(0.5) || has_slope(blend)) {
    const T b = clamp(blend, S(0), S(1 - kLeastEta));
    f = safe_power(f, value_of(b) < S(0.5) ? b * S(2) : S(0.5) / (S(1) - b));
  }
  return S(1) - f;
}

/// `names`: the first of three vectors at corners, in the object's space: tangent, its sign, normal.
template <class T>
Vec3<T> normal_map(const ShadingPoint& point, NormalMapMode mode, const std::string* names,
                   const T& strength, const Color<T>& color) {
  using S = scalar_t<T>;
  const Vec3<T> s = lifted_vector<T>(point.normal());
  Vec3<T> v{color.r * S(2) - S(1), color.g * S(2) - S(1), color.b * S(2) - S(1)};
  const auto to_world = [&](const Vec3<T>& n) {
    const auto& m = point.geometry->to_object(point.hit.instance).m;
    const auto row = [&](int j) { return n.x * S(m[0][j]) + n.y * S(m[1][j]) + n.z * S(m[2][j]); };
    const Vec3<T> world = safe_normalize(Vec3<T>{row(0), row(1), row(2)});
    return point.backfacing() ? -world : world;
  };
  Vec3<T> n = v;
  if (mode == NormalMapMode::kTangent) {
    const Vec3f t = corner_vector(*point.geometry, point.hit, names[0]);
    const float sign = corner_vector(*point.geometry, point.hit, names[1]).x;
    const Vec3f up = corner_vector(*point.geometry, point.hit, names[2]);
    if (sign == 0) return s;  // no tangents
    v.x = v.x * strength;
    v.y = v.y * strength;
    v.z = lerp(T(1), v.z, saturate(strength));
    const Vec3f b = cross(up, t) * (sign < 0 ? -1.0f : 1.0f);
    n = to_world(safe_normalize(lifted_vector<T>(t) * v.x + lifted_vector<T>(b) * v.y +
                                lifted_vector<T>(up) * v.z));
  } else {
    if (mode == NormalMapMode::kObject)
      n = to_world(safe_normalize(v));
    else
      n = point.backfacing() ? -safe_normalize(v) : safe_normalize(v);
    n = safe_normalize(s + (n - s) * max(strength, T(0)));
  }
  return value_of(dot(n, n)) > 0 ? n : s;
}

template <class T>
struct BumpNumbers {
  T height, along_x, along_y;  ///< the height here, and a width of footprints aside
  T strength, distance;
  float width;
  bool inverted;
};

template <class T>
Vec3<T> bump(const ShadingPoint& point, const Vec3<T>& n, const BumpNumbers<T>& b) {
  using S = scalar_t<T>;
  if (!(point.footprint > 0)) return n;
  const Footprint footprint = Footprint::of(point);
  const Vec3<T> x = lifted_vector<T>(footprint.x), y = lifted_vector<T>(footprint.y);
  const Vec3<T> rx = cross(y, n), ry = cross(n, x);
  const T det = dot(x, rx);
  const Vec3<T> slope = rx * (b.along_x - b.height) + ry * (b.along_y - b.height);
  const bool turned = (value_of(det) < 0) != b.inverted;
  const T distance = turned ? -b.distance : b.distance;
  const Vec3<T> bent = safe_normalize(n * (absolute(det) * S(b.width)) - slope * distance);
  const T strength = max(b.strength, T(0));
  return safe_normalize(bent * strength + n * (T(1) - strength));
}

}  // namespace selenite::shading
