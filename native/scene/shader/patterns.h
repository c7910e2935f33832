// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "scene/shader/noise.h"

// Textures of a few lines each: Wave, Magic, Gradient, Checker, Brick.
namespace selenite::shading {

/// Keeps whole coordinates, where a pattern changes, off the change.
template <class T>
Vec3<T> off_whole(const Vec3<T>& p) {
  using S = scalar_t<T>;
  const auto moved = [](const T& x) { return (x + S(0.000001)) * S(0.999999); };
  return {moved(p.x), moved(p.y), moved(p.z)};
}

template <class T>
struct WaveNumbers {
  T distortion, detail, detail_scale, detail_roughness, phase;
};

template <class T>
T wave_texture(std::uint8_t mode, const Vec3<T>& at, const WaveNumbers<T>& n) {
  using S = scalar_t<T>;
  const Vec3<T> p = off_whole(at);
  const int direction = wave_direction(mode);
  T x;
  if (wave_rings(mode)) {
    T sum(0);
    if (direction != 0) sum = sum + p.x * p.x;
    if (direction != 1) sum = sum + p.y * p.y;
    if (direction != 2) sum = sum + p.z * p.z;
    x = safe_sqrt(sum) * S(20);
  } else {
    x = direction == 3 ? (p.x + p.y + p.z) * S(10)
                       : (direction == 0 ? p.x : (direction == 1 ? p.y : p.z)) * S(20);
  }
  x = x + n.phase;
  if (value_of(n.distortion) != 0 || has_slope(n.distortion)) {
    const Point<T, 3> place{p.x * n.detail_scale, p.y * n.detail_scale, p.z * n.detail_scale};
    const T noise = fractal_sum(place, NoiseNumbers<T>{clamp(n.detail, S(0), S(15)),
                                                       n.detail_roughness, T(2), T(0), T(0), T(0)});
    x = x + n.distortion * (noise * S(2) - S(1));
  }
  switch (wave_profile(mode)) {
    case WaveProfile::kSine:
      return sine(x - kPi<T> / 2) * S(0.5) + S(0.5);
    case WaveProfile::kSaw:
      return fraction(x / (2 * kPi<T>));
    case WaveProfile::kTriangle: {
      const T turns = x / (2 * kPi<T>);
      return absolute(turns - floor_of(turns + S(0.5))) * S(2);
    }
  }
  return x;
}

template <class T>
Color<T> magic_texture(int depth, const Vec3<T>& at, const T& scale, T distortion) {
  using S = scalar_t<T>;
  const T turn(2 * kPi<T>);
  const T px = modulo(at.x, turn), py = modulo(at.y, turn), pz = modulo(at.z, turn);
  const T five = scale * S(5);
  T x = sine((px + py + pz) * five), y = cosine((py - px - pz) * five);
  T z = -cosine((pz - px - py) * five);
  const T& d = distortion;
  if (depth > 0) {
    x = x * d, y = y * d, z = z * d;
    y = -cosine(x - y + z) * d;
  }
  if (depth > 1) x = cosine(x - y - z) * d;
  if (depth > 2) z = sine(-x - y - z) * d;
  if (depth > 3) x = -cosine(-x + y - z) * d;
  if (depth > 4) y = -sine(-x + y + z) * d;
  if (depth > 5) y = -cosine(-x + y + z) * d;
  if (depth > 6) x = cosine(x + y + z) * d;
  if (depth > 7) z = sine(x + y - z) * d;
  if (depth > 8) x = -cosine(-x - y + z) * d;
  if (depth > 9) y = -sine(x - y + z) * d;
  if (value_of(d) != 0) {
    const T divisor = d * S(2);
    x = x / divisor, y = y / divisor, z = z / divisor;
  }
  return {S(0.5) - x, S(0.5) - y, S(0.5) - z};
}

template <class T>
T gradient_texture(GradientMode mode, const Vec3<T>& p) {
  using S = scalar_t<T>;
  const auto inside = [&] { return max(S(0.999999) - safe_sqrt(dot(p, p)), T(0)); };
  T f(0);
  switch (mode) {
    case GradientMode::kLinear:
      f = p.x;
      break;
    case GradientMode::kQuadratic:
      f = square(max(p.x, T(0)));
      break;
    case GradientMode::kEasing: {
      const T r = saturate(p.x);
      f = r * r * (S(3) - r * S(2));
      break;
    }
    case GradientMode::kDiagonal:
      f = (p.x + p.y) * S(0.5);
      break;
    case GradientMode::kSphere:
      f = inside();
      break;
    case GradientMode::kQuadraticSphere:
      f = square(inside());
      break;
    case GradientMode::kRadial:
      f = arc_tangent2(p.y, p.x) / (2 * kPi<T>)+S(0.5);
      break;
  }
  return saturate(f);
}

/// 1 for the first colour, 0 for the second; `at` is scaled already.
template <class T>
T checker_texture(const Vec3<T>& at) {
  const Vec3<T> p = off_whole(at);
  const auto odd = [](const T& x) { return std::fmod(std::abs(floor_of(x)), scalar_t<T>(2)) != 0; };
  return T((odd(p.x) == odd(p.y)) == odd(p.z) ? 1 : 0);
}

/// An old noise of whole numbers.
inline float brick_noise(std::uint32_t n) {
  n = (n + 1013) & 0x7fffffff;
  n = (n >> 13) ^ n;
  const std::uint32_t m = (n * (n * n * 60493 + 19990303) + 1376312589) & 0x7fffffff;
  return 0.5f * (static_cast<float>(m) / 1073741824.0f);
}

template <class T>
struct BrickNumbers {
  T mortar_size, mortar_smooth, bias, width, row_height, offset, squash;
  int offset_frequency = 2, squash_frequency = 2;
};

template <class T>
T brick_texture(BrickMode mode, const Vec3<T>& p, const BrickNumbers<T>& n) {
  using S = scalar_t<T>;
  const auto whole = [](S x) { return std::isfinite(x) ? static_cast<int>(x) : 0; };
  const int row = whole(floor_of(safe_divide(p.y, n.row_height)));
  T width = n.width, offset(0);
  if (n.offset_frequency && n.squash_frequency) {
    if (row % n.squash_frequency == 0) width = width * n.squash;
    if (row % n.offset_frequency == 0) offset = width * n.offset;
  }
  const int brick = whole(floor_of(safe_divide(p.x + offset, width)));
  if (mode == BrickMode::kTint) {
    const auto key =
        (static_cast<std::uint32_t>(row) << 16) + (static_cast<std::uint32_t>(brick) & 0xffffu);
    return saturate(n.bias + S(brick_noise(key)));
  }
  const T x = p.x + offset - width * S(brick), y = p.y - n.row_height * S(row);
  const T edge = min(min(x, y), min(width - x, n.row_height - y));
  if (value_of(edge) >= value_of(n.mortar_size)) return T(0);
  if (value_of(n.mortar_smooth) == 0) return T(1);
  const T u = saturate((S(1) - edge / n.mortar_size) / n.mortar_smooth);
  return u * u * (S(3) - u * S(2));
}

}  // namespace selenite::shading
