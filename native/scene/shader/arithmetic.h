// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "scene/shader/functions.h"
#include "scene/shader/modes.h"

// Math and Vector Math. Source: shader nodes of Cycles 4.5.
namespace selenite::shading {

template <class T>
T smooth_minimum(const T& a, const T& b, const T& distance) {
  const T least = min(a, b);
  if (value_of(distance) == 0) return least;
  const T h = max(distance - absolute(a - b), T(0)) / distance;
  return least - h * h * h * distance * constant<T>(1.0 / 6);
}

template <class T>
T math(MathMode mode, const T& a, const T& b, const T& c) {
  using S = scalar_t<T>;
  using enum MathMode;
  const S x = value_of(a), y = value_of(b);
  switch (mode) {
    case kAdd:
      return a + b;
    case kSubtract:
      return a - b;
    case kMultiply:
      return a * b;
    case kDivide:
      return safe_divide(a, b);
    case kMultiplyAdd:
      return a * b + c;
    case kPower:
      return safe_power(a, b);
    case kLogarithm:
      return x > 0 && y > 0 ? safe_divide(safe_log(a), safe_log(b)) : T(0);
    case kSqrt:
      return safe_sqrt(a);
    case kInverseSqrt:
      return x > 0 ? T(1) / safe_sqrt(a) : T(0);
    case kAbsolute:
      return absolute(a);
    case kExponent:
      return exp_of(a);
    case kMinimum:
      return min(a, b);
    case kMaximum:
      return max(a, b);
    case kLessThan:
      return T(x < y ? 1 : 0);
    case kGreaterThan:
      return T(x > y ? 1 : 0);
    case kSign:
      return T(x > 0 ? 1 : (x < 0 ? -1 : 0));
    case kCompare:
      return T(x == y || std::abs(x - y) <= std::max(value_of(c), S(0x1p-23)) ? 1 : 0);
    case kSmoothMin:
      return smooth_minimum(a, b, c);
    case kSmoothMax:
      return -smooth_minimum(-a, -b, c);
    case kRound:
      return T(std::floor(x + S(0.5)));
    case kFloor:
      return T(std::floor(x));
    case kCeil:
      return T(std::ceil(x));
    case kTrunc:
      return T(std::trunc(x));
    case kFract:
      return fraction(a);
    case kModulo:
      return modulo(a, b);
    case kFlooredModulo:
      return y != 0 ? a - b * std::floor(x / y) : T(0);
    case kWrap:
      return wrap(a, b, c);
    case kSnap:
      return b * floor_of(safe_divide(a, b));
    case kPingPong:
      return y != 0 ? absolute(fraction((a - b) / (b * S(2))) * b * S(2) - b) : T(0);
    case kSine:
      return sine(a);
    case kCosine:
      return cosine(a);
    case kTangent:
      return tangent(a);
    case kArcSine: {
      const S v = std::clamp(x, S(-1), S(1)), root = 1 - v * v;
      return of_one(a, std::asin(v), root > 0 ? 1 / std::sqrt(root) : S(0));
    }
    case kArcCosine:
      return arc_cosine(a);
    case kArcTangent:
      return of_one(a, std::atan(x), 1 / (1 + x * x));
    case kArcTan2:
      return arc_tangent2(a, b);
    case kSinh:
      return of_one(a, std::sinh(x), std::cosh(x));
    case kCosh:
      return of_one(a, std::cosh(x), std::sinh(x));
    case kTanh: {
      const S t = std::tanh(x);
      return of_one(a, t, 1 - t * t);
    }
    case kRadians:
      return a * (kPi<T> / 180);
    case kDegrees:
      return a * (180 / kPi<T>);
  }
  return T(0);
}

template <class T>
Color<T> vector_math(VectorMode mode, const Color<T>& a, const Color<T>& b, const Color<T>& c,
                     const T& number) {
  using S = scalar_t<T>;
  using enum VectorMode;
  const Vec3<T> u = vector_of(a), v = vector_of(b);
  switch (mode) {
    case kAdd:
      return a + b;
    case kSubtract:
      return a - b;
    case kMultiply:
      return a * b;
    case kDivide:
      return each(a, b, safe_divide<T>);
    case kMultiplyAdd:
      return a * b + c;
    case kCross:
      return color_of(cross(u, v));
    case kProject: {
      const T square = dot(v, v);
      return value_of(square) != 0 ? b * (dot(u, v) / square) : Color<T>{};
    }
    case kReflect: {
      const Vec3<T> n = safe_normalize(v);
      return color_of(u - n * (dot(u, n) * S(2)));
    }
    case kRefract: {
      const Vec3<T> n = safe_normalize(v);
      const T along = dot(n, u), k = T(1) - number * number * (T(1) - along * along);
      if (value_of(k) < 0) return {};
      return color_of(u * number - n * (number * along + safe_sqrt(k)));
    }
    case kFaceForward:
      return value_of(dot(vector_of(c), v)) < 0 ? a : Color<T>(T(0)) - a;
    case kDot:
      return Color<T>(dot(u, v));
    case kDistance:
      return Color<T>(safe_sqrt(dot(u - v, u - v)));
    case kLength:
      return Color<T>(safe_sqrt(dot(u, u)));
    case kScale:
      return a * number;
    case kNormalize:
      return color_of(safe_normalize(u));
    case kAbsolute:
      return map(a, absolute<T>);
    case kPower:
      return each(a, b, safe_power<T>);
    case kSign:
      return map(a, [](const T& x) { return math(MathMode::kSign, x, x, x); });
    case kMinimum:
      return each(a, b, [](const T& x, const T& y) { return min(x, y); });
    case kMaximum:
      return each(a, b, [](const T& x, const T& y) { return max(x, y); });
    case kFloor:
      return map(a, [](const T& x) { return T(floor_of(x)); });
    case kCeil:
      return map(a, [](const T& x) { return T(std::ceil(value_of(x))); });
    case kFraction:
      return map(a, fraction<T>);
    case kModulo:
      return each(a, b, modulo<T>);
    case kWrap:
      return each(a, b, c, wrap<T>);
    case kSnap:
      return each(a, b, [](const T& x, const T& y) { return y * floor_of(safe_divide(x, y)); });
    case kSine:
      return map(a, sine<T>);
    case kCosine:
      return map(a, cosine<T>);
    case kTangent:
      return map(a, tangent<T>);
  }
  return {};
}

}  // namespace selenite::shading
