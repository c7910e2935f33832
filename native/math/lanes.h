// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <bit>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>

#if defined(__AVX2__)
#include <immintrin.h>
#endif

#include "math/scalar.h"

// Eight numbers side by side, one for each of eight paths that are traced in lockstep, behind the names
// that a single number answers to. A branch on them is a mask: `select` takes from both sides, `any`
// is whether a side is needed at all. For a plain number a mask is a bool, so that code in these
// words is compiled for one path and for eight.
namespace selenite {

#if defined(__GNUC__)

inline constexpr int kLanes = 8;

/// A bool for each lane.
struct LaneMask {
  using Raw = std::int32_t __attribute__((vector_size(32)));  // each 0 or -1
  Raw m{};

  LaneMask() = default;
  // NOLINTNEXTLINE(google-explicit-constructor): a constant is the same in all lanes
  LaneMask(bool all) : m(Raw{} - static_cast<std::int32_t>(all)) {}
  explicit LaneMask(const Raw& m) : m(m) {}

  bool operator[](int lane) const { return m[lane] != 0; }
  void set(int lane, bool on) { m[lane] = on ? -1 : 0; }
  LaneMask& operator&=(const LaneMask& o) { return m &= o.m, *this; }
  LaneMask& operator|=(const LaneMask& o) { return m |= o.m, *this; }
  friend LaneMask operator&(const LaneMask& a, const LaneMask& b) { return LaneMask(a.m & b.m); }
  friend LaneMask operator|(const LaneMask& a, const LaneMask& b) { return LaneMask(a.m | b.m); }
  friend LaneMask operator^(const LaneMask& a, const LaneMask& b) { return LaneMask(a.m ^ b.m); }
  friend LaneMask operator!(const LaneMask& a) { return LaneMask(~a.m); }

  /// Bit i for lane i.
  unsigned bits() const {
#if defined(__AVX2__)
    return static_cast<unsigned>(_mm256_movemask_ps(std::bit_cast<__m256>(m)));
#else
    unsigned bits = 0;
    for (int i = 0; i < kLanes; ++i) bits |= static_cast<unsigned>(m[i] != 0) << i;
    return bits;
#endif
  }
};
inline bool any(const LaneMask& mask) { return mask.bits() != 0; }
inline bool all(const LaneMask& mask) { return mask.bits() == (1u << kLanes) - 1; }

/// Calls `f(lane)` for each lane of the mask.
template <class F>
void for_each_lane(const LaneMask& mask, F&& f) {
  for (unsigned left = mask.bits(); left != 0; left &= left - 1) f(std::countr_zero(left));
}

/// An integer for each lane.
struct LaneInts {
  using Raw = LaneMask::Raw;
  Raw v{};

  LaneInts() = default;
  LaneInts(int x) : v(Raw{} + x) {}  // NOLINT(google-explicit-constructor): likewise
  explicit LaneInts(const Raw& v) : v(v) {}

  int operator[](int lane) const { return v[lane]; }
  void set(int lane, int x) { v[lane] = x; }
  friend LaneInts operator+(const LaneInts& a, const LaneInts& b) { return LaneInts(a.v + b.v); }
  friend LaneInts operator-(const LaneInts& a, const LaneInts& b) { return LaneInts(a.v - b.v); }
  friend LaneInts operator*(const LaneInts& a, const LaneInts& b) { return LaneInts(a.v * b.v); }
  friend LaneMask operator==(const LaneInts& a, const LaneInts& b) { return LaneMask(a.v == b.v); }
  friend LaneMask operator<(const LaneInts& a, const LaneInts& b) { return LaneMask(a.v < b.v); }
  friend LaneMask operator>=(const LaneInts& a, const LaneInts& b) { return LaneMask(a.v >= b.v); }
};
inline LaneInts select(const LaneMask& mask, const LaneInts& a, const LaneInts& b) {
  return LaneInts((mask.m & a.v) | (~mask.m & b.v));
}
inline LaneMask select(const LaneMask& mask, const LaneMask& a, const LaneMask& b) {
  return LaneMask((mask.m & a.m) | (~mask.m & b.m));
}
inline LaneInts min(const LaneInts& a, const LaneInts& b) { return select(a < b, a, b); }
inline LaneInts max(const LaneInts& a, const LaneInts& b) { return select(a < b, b, a); }

/// A float for each lane.
struct Lanes {
  using Raw = float __attribute__((vector_size(32)));
  Raw v{};

  Lanes() = default;
  template <std::floating_point X>
  Lanes(X x) : v(Raw{} + static_cast<float>(x)) {}  // NOLINT(google-explicit-constructor)
  template <std::integral X>
  Lanes(X x) : v(Raw{} + static_cast<float>(x)) {}  // NOLINT(google-explicit-constructor)
  explicit Lanes(const Raw& v) : v(v) {}

  float operator[](int lane) const { return v[lane]; }
  void set(int lane, float x) { v[lane] = x; }

  Lanes& operator+=(const Lanes& o) { return v += o.v, *this; }
  Lanes& operator-=(const Lanes& o) { return v -= o.v, *this; }
  Lanes& operator*=(const Lanes& o) { return v *= o.v, *this; }
  Lanes& operator/=(const Lanes& o) { return v /= o.v, *this; }
  friend Lanes operator-(const Lanes& a) { return Lanes(-a.v); }
  friend Lanes operator+(const Lanes& a, const Lanes& b) { return Lanes(a.v + b.v); }
  friend Lanes operator-(const Lanes& a, const Lanes& b) { return Lanes(a.v - b.v); }
  friend Lanes operator*(const Lanes& a, const Lanes& b) { return Lanes(a.v * b.v); }
  friend Lanes operator/(const Lanes& a, const Lanes& b) { return Lanes(a.v / b.v); }
  friend LaneMask operator<(const Lanes& a, const Lanes& b) { return LaneMask(a.v < b.v); }
  friend LaneMask operator>(const Lanes& a, const Lanes& b) { return LaneMask(a.v > b.v); }
  friend LaneMask operator<=(const Lanes& a, const Lanes& b) { return LaneMask(a.v <= b.v); }
  friend LaneMask operator>=(const Lanes& a, const Lanes& b) { return LaneMask(a.v >= b.v); }
  friend LaneMask operator==(const Lanes& a, const Lanes& b) { return LaneMask(a.v == b.v); }
  friend LaneMask operator!=(const Lanes& a, const Lanes& b) { return LaneMask(a.v != b.v); }
};
template <>
struct MaskOf<Lanes> {
  using type = LaneMask;
};
template <>
struct UniformOf<Lanes> {
  using type = float;
};
template <>
struct IndexOf<Lanes> {
  using type = LaneInts;
};

inline Lanes value_of(const Lanes& x) { return x; }
inline bool has_slope(const Lanes&) { return false; }

inline Lanes select(const LaneMask& mask, const Lanes& a, const Lanes& b) {
#if defined(__AVX2__)
  return Lanes(std::bit_cast<Lanes::Raw>(_mm256_blendv_ps(
      std::bit_cast<__m256>(b.v), std::bit_cast<__m256>(a.v), std::bit_cast<__m256>(mask.m))));
#else
  return Lanes(std::bit_cast<Lanes::Raw>(select(mask, LaneInts(std::bit_cast<LaneInts::Raw>(a.v)),
                                                LaneInts(std::bit_cast<LaneInts::Raw>(b.v)))
                                             .v));
#endif
}
inline Lanes max(const Lanes& a, const Lanes& b) { return select(a < b, b, a); }
inline Lanes min(const Lanes& a, const Lanes& b) { return select(b < a, b, a); }
inline Lanes clamp(const Lanes& x, const Lanes& lo, const Lanes& hi) {
  return select(x < lo, lo, select(x > hi, hi, x));
}

namespace lanes_detail {
template <class F>
Lanes each(const Lanes& a, F&& f) {
  Lanes r;
  for (int i = 0; i < kLanes; ++i) r.v[i] = f(a.v[i]);
  return r;
}
}  // namespace lanes_detail

inline Lanes sqrt(const Lanes& x) {
#if defined(__AVX2__)
  return Lanes(std::bit_cast<Lanes::Raw>(_mm256_sqrt_ps(std::bit_cast<__m256>(x.v))));
#else
  return lanes_detail::each(x, [](float a) { return std::sqrt(a); });
#endif
}
inline Lanes safe_sqrt(const Lanes& x) { return sqrt(max(x, Lanes(0))); }
inline Lanes abs(const Lanes& x) {
  return Lanes(std::bit_cast<Lanes::Raw>(std::bit_cast<LaneInts::Raw>(x.v) & 0x7fffffff));
}
inline Lanes copysign(const Lanes& size, const Lanes& sign) {
  constexpr std::int32_t kSign = std::numeric_limits<std::int32_t>::min();
  return Lanes(std::bit_cast<Lanes::Raw>((std::bit_cast<LaneInts::Raw>(size.v) & ~kSign) |
                                         (std::bit_cast<LaneInts::Raw>(sign.v) & kSign)));
}
inline Lanes floor(const Lanes& x) {
#if defined(__AVX2__)
  return Lanes(std::bit_cast<Lanes::Raw>(_mm256_floor_ps(std::bit_cast<__m256>(x.v))));
#else
  return lanes_detail::each(x, [](float a) { return std::floor(a); });
#endif
}
/// Towards zero.
inline LaneInts truncate(const Lanes& x) {
  return LaneInts(__builtin_convertvector(x.v, LaneInts::Raw));
}
inline Lanes to_lanes(const LaneInts& x) { return Lanes(__builtin_convertvector(x.v, Lanes::Raw)); }
/// table[index] lane by lane.
inline Lanes gather(const float* table, const LaneInts& index) {
#if defined(__AVX2__)
  return Lanes(std::bit_cast<Lanes::Raw>(
      _mm256_i32gather_ps(table, std::bit_cast<__m256i>(index.v), sizeof(float))));
#else
  Lanes r;
  for (int i = 0; i < kLanes; ++i) r.v[i] = table[index.v[i]];
  return r;
#endif
}

#if defined(__AVX2__) && defined(__x86_64__) && defined(__GLIBC__)
// Of the C library's vector functions, which are good to 4 units in the last place.
extern "C" Lanes::Raw _ZGVdN8v_expf(Lanes::Raw);  // NOLINT(bugprone-reserved-identifier)
extern "C" Lanes::Raw _ZGVdN8v_logf(Lanes::Raw);  // NOLINT(bugprone-reserved-identifier)
extern "C" Lanes::Raw _ZGVdN8v_sinf(Lanes::Raw);  // NOLINT(bugprone-reserved-identifier)
extern "C" Lanes::Raw _ZGVdN8v_cosf(Lanes::Raw);  // NOLINT(bugprone-reserved-identifier)
inline Lanes exp(const Lanes& x) { return Lanes(_ZGVdN8v_expf(x.v)); }
inline Lanes log(const Lanes& x) { return Lanes(_ZGVdN8v_logf(x.v)); }
inline Lanes sin(const Lanes& x) { return Lanes(_ZGVdN8v_sinf(x.v)); }
inline Lanes cos(const Lanes& x) { return Lanes(_ZGVdN8v_cosf(x.v)); }
#else
inline Lanes exp(const Lanes& x) {
  return lanes_detail::each(x, [](float a) { return std::exp(a); });
}
inline Lanes log(const Lanes& x) {
  return lanes_detail::each(x, [](float a) { return std::log(a); });
}
inline Lanes sin(const Lanes& x) {
  return lanes_detail::each(x, [](float a) { return std::sin(a); });
}
inline Lanes cos(const Lanes& x) {
  return lanes_detail::each(x, [](float a) { return std::cos(a); });
}
#endif
inline Lanes acos(const Lanes& x) {
  return lanes_detail::each(x, [](float a) { return std::acos(a); });
}
inline Lanes pow(const Lanes& x, const Lanes& y) {
  Lanes r;
  for (int i = 0; i < kLanes; ++i) r.v[i] = std::pow(x.v[i], y.v[i]);
  return r;
}
/// One base >= 0 for all lanes.
inline Lanes pow(float x, const Lanes& y) {
  return x > 0 ? exp(y * std::log(x)) : select(y == 0, Lanes(1), Lanes(0));
}

/// A double for each lane.
struct LaneDoubles {
  using Raw = double __attribute__((vector_size(64)));
  Raw v{};

  LaneDoubles() = default;
  LaneDoubles(double x) : v(Raw{} + x) {}  // NOLINT(google-explicit-constructor): likewise
  explicit LaneDoubles(const Raw& v) : v(v) {}
  explicit LaneDoubles(const Lanes& x) : v(__builtin_convertvector(x.v, Raw)) {}
  explicit operator Lanes() const { return Lanes(__builtin_convertvector(v, Lanes::Raw)); }

  friend LaneDoubles operator-(const LaneDoubles& a) { return LaneDoubles(-a.v); }
  friend LaneDoubles operator+(const LaneDoubles& a, const LaneDoubles& b) {
    return LaneDoubles(a.v + b.v);
  }
  friend LaneDoubles operator-(const LaneDoubles& a, const LaneDoubles& b) {
    return LaneDoubles(a.v - b.v);
  }
  friend LaneDoubles operator*(const LaneDoubles& a, const LaneDoubles& b) {
    return LaneDoubles(a.v * b.v);
  }
  friend LaneDoubles operator/(const LaneDoubles& a, const LaneDoubles& b) {
    return LaneDoubles(a.v / b.v);
  }
};
inline LaneDoubles sqrt(const LaneDoubles& x) {
  LaneDoubles r;
#if defined(__AVX2__)
  const double* from = reinterpret_cast<const double*>(&x.v);
  double* to = reinterpret_cast<double*>(&r.v);
  for (int half = 0; half < kLanes; half += 4)
    _mm256_storeu_pd(to + half, _mm256_sqrt_pd(_mm256_loadu_pd(from + half)));
#else
  for (int i = 0; i < kLanes; ++i) r.v[i] = std::sqrt(x.v[i]);
#endif
  return r;
}

/// Eight rows of eight floats as eight columns: lane i of columns[k] is rows[i][k].
inline void transpose(const float* const* rows, Lanes* columns) {
#if defined(__AVX2__)
  __m256 a[8], b[8];
  for (int i = 0; i < 8; ++i) a[i] = _mm256_loadu_ps(rows[i]);
  for (int i = 0; i < 8; i += 2) {
    b[i] = _mm256_unpacklo_ps(a[i], a[i + 1]);
    b[i + 1] = _mm256_unpackhi_ps(a[i], a[i + 1]);
  }
  for (int i = 0; i < 8; i += 4) {
    a[i] = _mm256_shuffle_ps(b[i], b[i + 2], 0x44);
    a[i + 1] = _mm256_shuffle_ps(b[i], b[i + 2], 0xee);
    a[i + 2] = _mm256_shuffle_ps(b[i + 1], b[i + 3], 0x44);
    a[i + 3] = _mm256_shuffle_ps(b[i + 1], b[i + 3], 0xee);
  }
  for (int i = 0; i < 4; ++i) {
    columns[i].v = std::bit_cast<Lanes::Raw>(_mm256_permute2f128_ps(a[i], a[i + 4], 0x20));
    columns[i + 4].v = std::bit_cast<Lanes::Raw>(_mm256_permute2f128_ps(a[i], a[i + 4], 0x31));
  }
#else
  for (int i = 0; i < kLanes; ++i)
    for (int k = 0; k < kLanes; ++k) columns[k].v[i] = rows[i][k];
#endif
}

#endif  // defined(__GNUC__)

}  // namespace selenite
