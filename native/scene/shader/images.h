// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "scene/shader/functions.h"
#include "scene/shader/inputs.h"

// Where an Image Texture looks its image up, by projection.
namespace selenite::shading {

/// A lookup whose place carries derivatives: by differences of half a texel to either side, which is
/// the slope between texel centres.
template <class T>
Color<T> at_place(const Texture& texture, const T& u, const T& v) {
  const Vec2f at{static_cast<float>(value_of(u)), static_cast<float>(value_of(v))};
  const Colorf c = texture.at(at);
  Color<T> found = lifted<T>(c);
  if constexpr (!std::is_floating_point_v<T>) {
    if (has_slope(u) || has_slope(v)) {
      const float du = 0.5f / static_cast<float>(texture.width());
      const float dv = 0.5f / static_cast<float>(texture.height());
      const Colorf by_u =
          (texture.at({at.x + du, at.y}) - texture.at({at.x - du, at.y})) / (2 * du);
      const Colorf by_v =
          (texture.at({at.x, at.y + dv}) - texture.at({at.x, at.y - dv})) / (2 * dv);
      using S = scalar_t<T>;
      for (int k = 0; k < 3; ++k) found[k] = of_two(u, v, S(c[k]), S(by_u[k]), S(by_v[k]));
    }
  }
  return found;
}

/// How much each of the three faces of a box counts, by the normal in the object's space.
inline std::array<float, 3> box_weights(const Vec3f& normal, float blend) {
  const float sum = std::abs(normal.x) + std::abs(normal.y) + std::abs(normal.z);
  if (!(sum > 0)) return {1, 0, 0};
  const std::array<float, 3> n{std::abs(normal.x) / sum, std::abs(normal.y) / sum,
                               std::abs(normal.z) / sum};
  const float limit = 0.5f * (1 + blend);
  std::array<float, 3> w{};
  for (int i = 0; i < 3; ++i) {
    const float a = n[(i + 1) % 3], b = n[(i + 2) % 3];
    if (n[i] > limit * (n[i] + a) && n[i] > limit * (n[i] + b)) {
      w[i] = 1;
      return w;
    }
  }
  if (!(blend > 0)) return {1, 0, 0};
  for (int k : {2, 0, 1}) {  // the third face counts for nothing
    const int i = std::min((k + 1) % 3, (k + 2) % 3), j = 3 - i - k;
    if (!(n[k] < (1 - limit) * (n[i] + n[j]))) continue;
    w[i] = clamp((n[i] / (n[i] + n[j]) - 0.5f * (1 - blend)) / blend, 0.0f, 1.0f);
    w[j] = 1 - w[i];
    return w;
  }
  for (int i = 0; i < 3; ++i) w[i] = ((2 - limit) * n[i] + (limit - 1)) / (2 * limit - 1);
  return w;
}

template <class T>
Color<T> box_projected(const Texture& texture, const ShadingPoint& point, const Vec3<T>& p,
                       float blend) {
  using S = scalar_t<T>;
  const Vec3f n = normal_to_object(point, point.normal());
  const auto w = box_weights(n, blend);
  const auto mirrored = [](bool yes, const T& x) { return yes ? S(1) - x : x; };
  Color<T> sum(T(0));
  if (w[0] > 0) sum += at_place(texture, mirrored(n.x < 0, p.y), p.z) * S(w[0]);
  if (w[1] > 0) sum += at_place(texture, mirrored(n.y > 0, p.x), p.z) * S(w[1]);
  if (w[2] > 0) sum += at_place(texture, mirrored(n.z > 0, p.y), p.x) * S(w[2]);
  return sum;
}

template <class T>
Color<T> image_texture(const Texture& texture, const ShadingPoint* point, ImageMode mode,
                       const Vec3<T>& at, float blend) {
  using S = scalar_t<T>;
  if (mode == ImageMode::kFlat) return at_place(texture, at.x, at.y);
  if (mode == ImageMode::kBox) return box_projected(texture, *point, at, blend);
  const auto centred = [](const T& x) { return x * S(2) - S(1); };
  const Vec3<T> p{centred(at.x), centred(at.y), centred(at.z)};
  T u(0), v(0);
  if (value_of(p.x) != 0 || value_of(p.y) != 0) u = S(0.5) - arc_tangent2(p.x, p.y) / (2 * kPi<T>);
  if (mode == ImageMode::kTube) {
    v = (p.z + S(1)) * S(0.5);
  } else {
    const T size = safe_sqrt(dot(p, p));
    if (value_of(size) > 0) v = S(1) - arc_cosine(p.z / size) / kPi<T>;
  }
  return at_place(texture, u, v);
}

}  // namespace selenite::shading
