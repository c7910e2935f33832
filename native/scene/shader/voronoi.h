// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <limits>

#include "scene/shader/noise.h"

// Voronoi Texture in one to four dimensions.
// Source: Worley 1996, "A Cellular Texture Basis Function"; Quilez 2012, "Voronoi: distances".
namespace selenite::shading {

template <class T>
struct VoronoiNumbers {
  T detail, roughness, lacunarity, smoothness, exponent, randomness;
  VoronoiMetric metric = VoronoiMetric::kEuclidean;
  bool normalized = false;
  bool whole_keys = false;  ///< cells are numbered in whole numbers, as in Blender 5
};

template <class T, std::size_t N>
struct VoronoiResult {
  T distance{0};
  Color<T> color{T(0)};
  Point<T, N> position{};
};

template <class T, std::size_t N>
T voronoi_distance(const Point<T, N>& d, VoronoiMetric metric, const T& exponent) {
  if constexpr (N == 1) return absolute(d[0]);
  T sum(0);
  switch (metric) {
    case VoronoiMetric::kEuclidean:
      for (const T& x : d) sum = sum + x * x;
      return safe_sqrt(sum);
    case VoronoiMetric::kManhattan:
      for (const T& x : d) sum = sum + absolute(x);
      return sum;
    case VoronoiMetric::kChebychev:
      for (const T& x : d) sum = max(sum, absolute(x));
      return sum;
    case VoronoiMetric::kMinkowski:
      for (const T& x : d) sum = sum + safe_power(absolute(x), exponent);
      return safe_power(sum, T(1) / exponent);
  }
  return sum;
}

/// The cells around a place, and the point in each.
template <class T, std::size_t N>
class VoronoiCells {
 public:
  using S = scalar_t<T>;
  using Offset = std::array<int, N>;

  VoronoiCells(const Point<T, N>& at, const VoronoiNumbers<T>& n)
      : randomness_(n.randomness), whole_keys_(n.whole_keys) {
    for (std::size_t i = 0; i < N; ++i) {
      cell_[i] = floor_of(at[i]);
      local_[i] = at[i] - cell_[i];
    }
  }

  /// In units of cells from the corner of this one.
  Point<T, N> point(const Offset& offset) const {
    const auto random = random_at(offset);
    Point<T, N> p;
    for (std::size_t i = 0; i < N; ++i)
      p[i] = randomness_ * static_cast<S>(random[i]) + static_cast<S>(offset[i]);
    return p;
  }
  Color<T> color(const Offset& offset) const {
    const auto c = color_at(offset);
    return lifted<T>(Colorf{c[0], c[1], c[2]});
  }
  const Point<T, N>& local() const { return local_; }
  Point<T, N> placed(Point<T, N> p) const {
    for (std::size_t i = 0; i < N; ++i) p[i] = p[i] + cell_[i];
    return p;
  }

  /// Calls `action(offset)` for the cells up to `reach` away from `center`, the first axis fastest.
  template <class Action>
  static void around(const Offset& center, int reach, Action&& action) {
    Offset offset;
    const int side = 2 * reach + 1;
    int count = 1;
    for (std::size_t i = 0; i < N; ++i) count *= side;
    for (int k = 0; k < count; ++k) {
      int rest = k;
      for (std::size_t i = 0; i < N; ++i) {
        offset[i] = center[i] + rest % side - reach;
        rest /= side;
      }
      action(offset);
    }
  }

 private:
  std::array<float, N> key(const Offset& offset) const {
    std::array<float, N> k;
    for (std::size_t i = 0; i < N; ++i)
      k[i] = static_cast<float>(cell_[i]) + static_cast<float>(offset[i]);
    return k;
  }

  std::array<std::int32_t, N> whole_key(const Offset& offset) const {
    constexpr S kFarthest = S(2e9);  // that a whole number holds
    std::array<std::int32_t, N> k;
    for (std::size_t i = 0; i < N; ++i)
      k[i] = static_cast<std::int32_t>(clamp(cell_[i], -kFarthest, kFarthest)) + offset[i];
    return k;
  }
  std::array<float, N> random_at(const Offset& offset) const {
    if constexpr (N > 1)
      if (whole_keys_) return random_cell(whole_key(offset));
    return random_point(key(offset));
  }
  std::array<float, 3> color_at(const Offset& offset) const {
    if constexpr (N > 1) {
      if (whole_keys_) {
        const auto k = whole_key(offset);
        if constexpr (N == 2) return random_cell(std::array<std::int32_t, 3>{k[0], k[1], 0});
        const auto random = random_cell(k);
        return {random[0], random[1], random[N > 2 ? 2 : 0]};
      }
    }
    return random_color(key(offset));
  }

  T randomness_;
  bool whole_keys_;
  std::array<S, N> cell_;
  Point<T, N> local_;
};

template <class T, std::size_t N>
Point<T, N> difference(const Point<T, N>& a, const Point<T, N>& b) {
  Point<T, N> d;
  for (std::size_t i = 0; i < N; ++i) d[i] = a[i] - b[i];
  return d;
}

/// The nearest point, or the one after it.
template <class T, std::size_t N>
VoronoiResult<T, N> voronoi_nearest(const Point<T, N>& at, const VoronoiNumbers<T>& n,
                                    bool second) {
  using Cells = VoronoiCells<T, N>;
  const Cells cells(at, n);
  typename Cells::Offset first_offset{}, second_offset{};
  T nearest(std::numeric_limits<scalar_t<T>>::max()), next = nearest;
  Cells::around({}, 1, [&](const typename Cells::Offset& offset) {
    const T d =
        voronoi_distance(difference(cells.point(offset), cells.local()), n.metric, n.exponent);
    if (d < nearest) {
      next = nearest, second_offset = first_offset;
      nearest = d, first_offset = offset;
    } else if (d < next) {
      next = d, second_offset = offset;
    }
  });
  const auto& chosen = second ? second_offset : first_offset;
  return {second ? next : nearest, cells.color(chosen), cells.placed(cells.point(chosen))};
}

template <class T, std::size_t N>
VoronoiResult<T, N> voronoi_smooth(const Point<T, N>& at, const VoronoiNumbers<T>& n) {
  using S = scalar_t<T>;
  using Cells = VoronoiCells<T, N>;
  const Cells cells(at, n);
  const T& s = n.smoothness;
  VoronoiResult<T, N> r;
  bool first = true;
  Cells::around({}, 2, [&](const typename Cells::Offset& offset) {
    const Point<T, N> point = cells.point(offset);
    const T d = voronoi_distance(difference(point, cells.local()), n.metric, n.exponent);
    T h(1);
    if (!first) {
      const T u = saturate((r.distance - d) / s * S(0.5) + S(0.5));
      h = u * u * (S(3) - u * S(2));
    }
    first = false;
    const T correction = s * h * (S(1) - h);
    r.distance = lerp(r.distance, d, h) - correction;
    const T less = correction / (S(1) + s * S(3));
    r.color = each(r.color, cells.color(offset),
                   [&](const T& a, const T& b) { return lerp(a, b, h) - less; });
    for (std::size_t i = 0; i < N; ++i) r.position[i] = lerp(r.position[i], point[i], h) - less;
  });
  r.position = cells.placed(r.position);
  return r;
}

/// Squares of distances below this are the same point.
inline constexpr double kSamePoint = 1e-4;

template <class T, std::size_t N>
T voronoi_edge(const Point<T, N>& at, const VoronoiNumbers<T>& n) {
  using S = scalar_t<T>;
  using Cells = VoronoiCells<T, N>;
  const Cells cells(at, n);
  const auto square_of = [](const Point<T, N>& d) {
    T sum(0);
    for (const T& x : d) sum = sum + x * x;
    return sum;
  };
  if constexpr (N == 1) {
    const T middle = cells.point({0})[0], x = cells.local()[0];
    const T left = (middle + cells.point({-1})[0]) * S(0.5);
    const T right = (middle + cells.point({1})[0]) * S(0.5);
    return min(absolute(left - x), absolute(right - x));
  }
  Point<T, N> closest{};
  T nearest(std::numeric_limits<S>::max());
  Cells::around({}, 1, [&](const typename Cells::Offset& offset) {
    const Point<T, N> d = difference(cells.point(offset), cells.local());
    const T square = square_of(d);
    if (square < nearest) nearest = square, closest = d;
  });
  T edge(std::numeric_limits<S>::max());
  Cells::around({}, 1, [&](const typename Cells::Offset& offset) {
    const Point<T, N> d = difference(cells.point(offset), cells.local());
    const Point<T, N> across = difference(d, closest);
    const T square = square_of(across);
    if (!(value_of(square) > S(kSamePoint))) return;
    T along(0);
    for (std::size_t i = 0; i < N; ++i) along = along + (closest[i] + d[i]) * across[i];
    edge = min(edge, along * S(0.5) / safe_sqrt(square));
  });
  return edge;
}

/// Half the way from the nearest point to the one nearest to that.
template <class T, std::size_t N>
T voronoi_radius(const Point<T, N>& at, const VoronoiNumbers<T>& n) {
  using S = scalar_t<T>;
  using Cells = VoronoiCells<T, N>;
  const Cells cells(at, n);
  const auto distance = [](const Point<T, N>& d) {
    return voronoi_distance(d, VoronoiMetric::kEuclidean, T(1));
  };
  typename Cells::Offset closest{};
  T nearest(std::numeric_limits<S>::max());
  Cells::around({}, 1, [&](const typename Cells::Offset& offset) {
    const T d = distance(difference(cells.point(offset), cells.local()));
    if (d < nearest) nearest = d, closest = offset;
  });
  const Point<T, N> from = cells.point(closest);
  T least(std::numeric_limits<S>::max());
  Cells::around(closest, 1, [&](const typename Cells::Offset& offset) {
    if (offset != closest) least = min(least, distance(difference(cells.point(offset), from)));
  });
  return least * S(0.5);
}

/// The largest distance that there can be, about.
template <class T, std::size_t N>
T voronoi_reach(VoronoiMode mode, const VoronoiNumbers<T>& n) {
  using S = scalar_t<T>;
  const T half = n.randomness * S(0.5) + S(0.5);
  if (mode == VoronoiMode::kEdge) return half;
  Point<T, N> corner;
  corner.fill(half);
  return voronoi_distance(corner, n.metric, n.exponent) * S(mode == VoronoiMode::kF2 ? 2 : 1);
}

template <class T, std::size_t N>
VoronoiResult<T, N> voronoi_octave(VoronoiMode mode, const Point<T, N>& at,
                                   const VoronoiNumbers<T>& n) {
  if (mode == VoronoiMode::kEdge) return {voronoi_edge(at, n), {}, {}};
  if (mode == VoronoiMode::kSmoothF1 && value_of(n.smoothness) != 0) return voronoi_smooth(at, n);
  return voronoi_nearest(at, n, mode == VoronoiMode::kF2);
}

/// Of edges the nearest in any octave counts, of points the sum.
template <class T, std::size_t N>
VoronoiResult<T, N> voronoi_octaves(VoronoiMode mode, const Point<T, N>& at,
                                    const VoronoiNumbers<T>& n) {
  using S = scalar_t<T>;
  const bool edge = mode == VoronoiMode::kEdge;
  const T reach = voronoi_reach<T, N>(mode, n);
  const auto finish = [&](VoronoiResult<T, N> r, const T& most) {
    if (!n.normalized) return r;
    r.distance = r.distance / (edge ? most : most * reach);
    r.color = r.color / most;
    return r;
  };
  if (value_of(n.detail) == 0 || value_of(n.roughness) == 0)
    return finish(voronoi_octave(mode, at, n), edge ? reach : T(1));
  VoronoiResult<T, N> sum;
  if (edge) sum.distance = T(8);
  T amplitude(1), scale(1), most = edge ? reach : T(0);
  const auto added = [&](VoronoiResult<T, N> r, const VoronoiResult<T, N>& octave, T& m) {
    if (edge) {
      m = lerp(m, reach / scale, amplitude);
      r.distance = lerp(r.distance, min(r.distance, octave.distance / scale), amplitude);
      return r;
    }
    m = m + amplitude;
    r.distance = r.distance + octave.distance * amplitude;
    r.color = r.color + octave.color * amplitude;
    for (std::size_t i = 0; i < N; ++i)
      r.position[i] = lerp(r.position[i], octave.position[i] / scale, amplitude);
    return r;
  };
  const S whole = floor_of(n.detail);
  for (int i = 0; i <= static_cast<int>(whole); ++i) {
    sum = added(sum, voronoi_octave(mode, at * scale, n), most);
    scale = scale * n.lacunarity;
    amplitude = amplitude * n.roughness;
  }
  const T rest = n.detail - whole;
  if (value_of(rest) != 0) {
    T more = most;
    const VoronoiResult<T, N> last = added(sum, voronoi_octave(mode, at * scale, n), more);
    most = lerp(most, more, rest);
    const T distance = edge ? min(sum.distance, last.distance) : last.distance;
    sum.distance = lerp(sum.distance, distance, rest);
    sum.color =
        each(sum.color, last.color, [&](const T& a, const T& b) { return lerp(a, b, rest); });
    for (std::size_t i = 0; i < N; ++i)
      sum.position[i] = lerp(sum.position[i], last.position[i], rest);
  }
  return finish(sum, most);
}

/// Voronoi Texture; `at` is scaled already, and positions are divided by `scale` again.
template <class T, std::size_t N>
Color<T> voronoi_texture(VoronoiMode mode, VoronoiOutput output, const Point<T, N>& at,
                         VoronoiNumbers<T> n, const T& scale) {
  using S = scalar_t<T>;
  n.detail = clamp(n.detail, S(0), S(15));
  n.roughness = saturate(n.roughness);
  n.randomness = saturate(n.randomness);
  n.smoothness = clamp(n.smoothness * S(0.5), S(0), S(0.5));
  if (mode == VoronoiMode::kSphereRadius) return Color<T>(voronoi_radius(at, n));
  const VoronoiResult<T, N> r = voronoi_octaves(mode, at, n);
  if (output == VoronoiOutput::kDistance) return Color<T>(r.distance);
  if (output == VoronoiOutput::kColor) return r.color;
  const auto place = [&](std::size_t i) { return safe_divide(r.position[i], scale); };
  if constexpr (N == 1)
    return Color<T>(output == VoronoiOutput::kW ? place(0) : T(0));
  else if (output == VoronoiOutput::kW)
    return Color<T>(N == 4 ? place(N - 1) : T(0));
  else
    return {place(0), place(1), N > 2 ? place(N > 2 ? 2 : 0) : T(0)};
}

}  // namespace selenite::shading
