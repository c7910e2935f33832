// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>

#include "math/sampling.h"
#include "model/bsdf.h"
#include "model/medium.h"

// What the tests ask of eight lanes, in plain numbers: lanes_avx2.cpp answers with lanes, lanes_test.cpp
// with one lane after the other.
namespace selenite::lanes_test {

inline constexpr int kBatch = 8, kSlots = 4;
using Slopes = Dual<float, kSlots>;

/// Points of one material, seen from one side.
struct Batch {
  SurfacePoint<float> point[kBatch];
  Vec3f wo[kBatch];
  float u_lobe[kBatch], u1[kBatch], u2[kBatch];
};

/// What the BSDF says of one of them.
template <class T>
struct Answer {
  Color<T> value{};
  float density = 0, density_alone = 0;
  bool transmits = false, all_singular = false;
  struct {
    bool exists = false, singular = false, transmits = false, diffuse = false;
    Vec3f wo{};
    float density = 0;
    Color<T> weight{};
  } sample;
};

/// Functions of two numbers, over any scalar.
inline constexpr int kFunctions = 27;
template <class T>
void evaluate_functions(const T& a, const T& b, T (&out)[kFunctions]) {
  using std::abs, std::cos, std::exp, std::log, std::sin, std::sqrt;
  using S = scalar_t<T>;
  const T positive = a * a + T(S(0.1));
  const T values[kFunctions] = {
      a + b,
      a - b,
      -a,
      a * b,
      a / b,
      a * S(3),
      S(3) - a,
      a / S(3),
      S(3) / b,
      max(a, b),
      min(a, b),
      clamp(a, S(-0.5), S(0.5)),
      abs(a),
      sqrt(positive),
      safe_sqrt(a),
      exp(a),
      log(positive),
      sin(a),
      cos(a),
      select(a < b, a, T(b * b)),
      select(a >= T(S(0)), T(sqrt(a)), T(S(0))),  // the side not taken is not finite
      clamp01(a),
      capped_root(positive, S(0.01)),
      fresnel_dielectric(T(min(positive, T(S(1)))), T(max(b, T(S(-0.01))))),
      tint_power(number_t<T>(0.3), T(abs(a) + T(S(1)))),
      tint_power(number_t<T>(0), T(abs(a) + T(S(1)))),
      T(power_heuristic(value_of(a), value_of(abs(b)))),
  };
  for (int i = 0; i < kFunctions; ++i) out[i] = values[i];
}

/// The maps from random numbers to directions: 13 numbers.
inline constexpr int kMapped = 13;
template <class S>
void evaluate_maps(const S& u, const S& v, number_t<S> g, S (&out)[kMapped]) {
  const Vec2<S> disc = square_to_disc(u, v);
  const Vec3<S> cosine = square_to_cosine_hemisphere(u, v), cone = square_to_cone(u, v, S(0.3));
  const S turn = sample_henyey_greenstein(g, v);
  const Vec3<S> deflected = deflect(cosine, turn, u);
  const S values[kMapped] = {disc.x,        disc.y,      cosine.x,    cosine.y,
                             cosine.z,      cone.x,      cone.y,      cone.z,
                             deflected.x,   deflected.y, deflected.z, henyey_greenstein(g, turn),
                             exponential(u)};
  for (int i = 0; i < kMapped; ++i) out[i] = values[i];
}

#if defined(SELENITE_LANES)
// With eight lanes (lanes_avx2.cpp): of that library nothing else is seen from outside.
#pragma GCC visibility push(default)
/// Answers for the points of a batch; `active` has a bit for each that counts.
void ask_by_lanes(const Principled<Slopes>& material, const Flavour& flavour, const Batch& batch,
                  unsigned active, Answer<Slopes>* answers);
void ask_by_lanes(const Principled<float>& material, const Flavour& flavour, const Batch& batch,
                  unsigned active, Answer<float>* answers);
/// out: kFunctions times kBatch.
void functions_by_lanes(const float* a, const float* b, float* out);
void functions_by_lanes(const Slopes* a, const Slopes* b, Slopes* out);
/// Sum, difference, product and quotient of one number for all lanes and one of each, both ways round.
inline constexpr int kMixed = 8;
void mixed_by_lanes(const Slopes& uniform, const float* a, Slopes* out);
/// Comparisons <, >, <=, >=, ==, != of a and b: bits of the masks; then any, all of a < b.
void compare_by_lanes(const float* a, const float* b, unsigned (&bits)[8]);
/// out: kMapped times kBatch.
void maps_by_lanes(const float* u, const float* v, float g, float* out);
#pragma GCC visibility pop
#endif

}  // namespace selenite::lanes_test
