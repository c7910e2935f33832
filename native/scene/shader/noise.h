// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

#include "scene/shader/functions.h"
#include "scene/shader/hash.h"
#include "scene/shader/modes.h"

// Gradient noise and its sums over octaves, in one to four dimensions.
// Source: Perlin 2002, "Improving Noise"; Musgrave in Ebert et al., "Texturing and Modeling".
namespace selenite::shading {

template <class T, std::size_t N>
using Point = std::array<T, N>;

template <class T, std::size_t N>
Point<T, N> operator*(const Point<T, N>& p, const T& s) {
  Point<T, N> r;
  for (std::size_t i = 0; i < N; ++i) r[i] = p[i] * s;
  return r;
}

/// The slope of a lattice point's hash along a way from it.
template <class T, std::size_t N>
T lattice_slope(std::uint32_t hash, const Point<T, N>& d) {
  const auto turned = [hash](const T& x, std::uint32_t bit) { return (hash & bit) ? -x : x; };
  if constexpr (N == 1) {
    const auto size = static_cast<scalar_t<T>>(1 + (hash & 7));
    return turned(d[0] * size, 8);
  } else if constexpr (N == 2) {
    const bool low = (hash & 7) < 4;
    return turned(low ? d[0] : d[1], 1) + turned((low ? d[1] : d[0]) * scalar_t<T>(2), 2);
  } else if constexpr (N == 3) {
    const std::uint32_t h = hash & 15;
    const T& u = h < 8 ? d[0] : d[1];
    const T& v = h < 4 ? d[1] : (h == 12 || h == 14 ? d[0] : d[2]);
    return turned(u, 1) + turned(v, 2);
  } else {
    const std::uint32_t h = hash & 31;
    const T& u = h < 24 ? d[0] : d[1];
    const T& v = h < 16 ? d[1] : d[2];
    const T& s = h < 8 ? d[2] : d[3];
    return turned(u, 1) + turned(v, 2) + turned(s, 4);
  }
}

/// About in [-1, 1].
template <class T, std::size_t N>
T signed_noise(Point<T, N> p) {
  using S = scalar_t<T>;
  constexpr double kScale[] = {0.25, 0.6616, 0.982, 0.8344};
  std::array<int, N> cell;
  Point<T, N> low, blend;
  for (std::size_t i = 0; i < N; ++i) {
    // Repeats every 100000; far away half a cell's shift keeps floats off the lattice, where all is 0.
    const S x = value_of(p[i]);
    const S inside = std::fmod(x, S(100000)) + (std::abs(x) >= 1000000 ? S(0.5) : S(0));
    p[i] = p[i] + (inside - x);
    const S floor = std::floor(inside);
    cell[i] = std::isfinite(floor) ? static_cast<int>(floor) : 0;
    low[i] = p[i] - floor;
    const T& t = low[i];
    blend[i] = t * t * t * (t * (t * S(6) - S(15)) + S(10));
  }
  constexpr std::size_t kCorners = std::size_t{1} << N;
  std::array<T, kCorners> value;
  for (std::size_t corner = 0; corner < kCorners; ++corner) {
    std::array<std::uint32_t, N> key;
    Point<T, N> way;
    for (std::size_t i = 0; i < N; ++i) {
      const int high = static_cast<int>((corner >> i) & 1);
      key[i] = static_cast<std::uint32_t>(cell[i] + high);
      way[i] = low[i] - static_cast<S>(high);
    }
    value[corner] = lattice_slope(hash_of(key), way);
  }
  for (std::size_t i = 0; i < N; ++i)
    for (std::size_t k = 0; k < (kCorners >> (i + 1)); ++k)
      value[k] = lerp(value[2 * k], value[2 * k + 1], blend[i]);
  if (!std::isfinite(value_of(value[0]))) return T(0);
  return value[0] * static_cast<S>(kScale[N - 1]);
}

template <class T>
struct NoiseNumbers {
  T detail, roughness, lacunarity, offset, gain, distortion;
  bool normalized = true;
};

/// Sum of octaves; of the last, `detail` gives the share.
template <class T, std::size_t N>
T fractal_sum(Point<T, N> p, const NoiseNumbers<T>& n) {
  using S = scalar_t<T>;
  const S whole = floor_of(n.detail);
  T amplitude(1), most(0), sum(0);
  for (int i = 0; i <= static_cast<int>(whole); ++i) {
    sum = sum + signed_noise(p) * amplitude;
    most = most + amplitude;
    amplitude = amplitude * n.roughness;
    p = p * n.lacunarity;
  }
  const T rest = n.detail - whole;
  const auto result = [&](const T& s, const T& m) {
    return n.normalized ? s / m * S(0.5) + S(0.5) : s;
  };
  if (value_of(rest) == 0) return result(sum, most);
  const T more = sum + signed_noise(p) * amplitude;
  return lerp(result(sum, most), result(more, most + amplitude), rest);
}

template <class T, std::size_t N>
T multifractal(Point<T, N> p, const NoiseNumbers<T>& n) {
  using S = scalar_t<T>;
  const S whole = floor_of(n.detail);
  T value(1), power(1);
  for (int i = 0; i <= static_cast<int>(whole); ++i) {
    value = value * (power * signed_noise(p) + S(1));
    power = power * n.roughness;
    p = p * n.lacunarity;
  }
  const T rest = n.detail - whole;
  return value_of(rest) == 0 ? value : value * (rest * power * signed_noise(p) + S(1));
}

template <class T, std::size_t N>
T hetero_terrain(Point<T, N> p, const NoiseNumbers<T>& n) {
  const auto whole = floor_of(n.detail);
  T value = n.offset + signed_noise(p), power = n.roughness;
  p = p * n.lacunarity;
  for (int i = 1; i <= static_cast<int>(whole); ++i) {
    value = value + (signed_noise(p) + n.offset) * power * value;
    power = power * n.roughness;
    p = p * n.lacunarity;
  }
  const T rest = n.detail - whole;
  if (value_of(rest) == 0) return value;
  return value + rest * (signed_noise(p) + n.offset) * power * value;
}

/// Later octaves count where earlier ones were high; below this share they are left out.
inline constexpr double kLeastShare = 0.001;

template <class T, std::size_t N>
T hybrid_multifractal(Point<T, N> p, const NoiseNumbers<T>& n) {
  using S = scalar_t<T>;
  const S whole = floor_of(n.detail);
  T power(1), value(0), weight(1);
  for (int i = 0; i <= static_cast<int>(whole) && value_of(weight) > S(kLeastShare); ++i) {
    weight = min(weight, T(1));
    const T signal = (signed_noise(p) + n.offset) * power;
    power = power * n.roughness;
    value = value + weight * signal;
    weight = weight * n.gain * signal;
    p = p * n.lacunarity;
  }
  const T rest = n.detail - whole;
  if (value_of(rest) == 0 || !(value_of(weight) > S(kLeastShare))) return value;
  return value + rest * min(weight, T(1)) * (signed_noise(p) + n.offset) * power;
}

template <class T, std::size_t N>
T ridged_multifractal(Point<T, N> p, const NoiseNumbers<T>& n) {
  T power = n.roughness;
  T signal = square(n.offset - absolute(signed_noise(p)));
  T value = signal;
  for (int i = 1; i <= static_cast<int>(floor_of(n.detail)); ++i) {
    p = p * n.lacunarity;
    const T weight = saturate(signal * n.gain);
    signal = square(n.offset - absolute(signed_noise(p))) * weight;
    value = value + signal * power;
    power = power * n.roughness;
  }
  return value;
}

template <class T, std::size_t N>
T octaves(NoiseMode mode, const Point<T, N>& p, const NoiseNumbers<T>& n) {
  switch (mode) {
    case NoiseMode::kFbm:
      return fractal_sum(p, n);
    case NoiseMode::kMultifractal:
      return multifractal(p, n);
    case NoiseMode::kHetero:
      return hetero_terrain(p, n);
    case NoiseMode::kHybrid:
      return hybrid_multifractal(p, n);
    case NoiseMode::kRidged:
      return ridged_multifractal(p, n);
  }
  return T(0);
}

/// Another part of the noise, far from the origin.
template <class T, std::size_t N>
Point<T, N> elsewhere(Point<T, N> p, float seed) {
  for (std::size_t i = 0; i < N; ++i) {
    float r;
    if constexpr (N == 1)
      r = random_of(std::array{seed});
    else
      r = random_of(std::array{seed, static_cast<float>(i)});
    p[i] = p[i] + static_cast<scalar_t<T>>(100.0f + r * 100.0f);
  }
  return p;
}

/// Noise Texture: its number in all channels, or its colour.
template <class T, std::size_t N>
Color<T> noise_texture(NoiseMode mode, const Point<T, N>& at, NoiseNumbers<T> n, bool colored) {
  using S = scalar_t<T>;
  n.detail = clamp(n.detail, S(0), S(15));
  n.roughness = max(n.roughness, T(0));
  Point<T, N> p = at;
  if (value_of(n.distortion) != 0 || has_slope(n.distortion))
    for (std::size_t i = 0; i < N; ++i)
      p[i] = p[i] + signed_noise(elsewhere(at, static_cast<float>(i))) * n.distortion;
  const T value = octaves(mode, p, n);
  if (!colored) return Color<T>(value);
  return {value, octaves(mode, elsewhere(p, static_cast<float>(N)), n),
          octaves(mode, elsewhere(p, static_cast<float>(N + 1)), n)};
}

}  // namespace selenite::shading
