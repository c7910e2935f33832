// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "scene/shader/functions.h"
#include "scene/shader/modes.h"
#include "scene/shader/shader.h"

// Colours: blending, other coordinates of colour, tables, ranges.
namespace selenite::shading {

template <class T>
Color<T> to_hsv(const Color<T>& c) {
  const T high = max_channel(c), low = min(min(c.r, c.g), c.b), range = high - low;
  if (value_of(high) == 0 || value_of(range) == 0) return {T(0), T(0), high};
  T hue;
  if (value_of(c.r) == value_of(high))
    hue = (c.g - c.b) / range;
  else if (value_of(c.g) == value_of(high))
    hue = (c.b - c.r) / range + scalar_t<T>(2);
  else
    hue = (c.r - c.g) / range + scalar_t<T>(4);
  hue = hue / scalar_t<T>(6);
  if (value_of(hue) < 0) hue = hue + scalar_t<T>(1);
  return {hue, range / high, high};
}

template <class T>
Color<T> from_hsv(const Color<T>& c) {
  using S = scalar_t<T>;
  const T& v = c.b;
  if (value_of(c.g) == 0) return Color<T>(v);
  const T hue = (value_of(c.r) == 1 ? T(0) : c.r) * S(6);
  const S sector = floor_of(hue);
  const T f = hue - sector;
  const T p = v * (S(1) - c.g), q = v * (S(1) - c.g * f), t = v * (S(1) - c.g * (S(1) - f));
  if (sector == 0) return {v, t, p};
  if (sector == 1) return {q, v, p};
  if (sector == 2) return {p, v, t};
  if (sector == 3) return {p, q, v};
  if (sector == 4) return {t, p, v};
  return {v, p, q};
}

template <class T>
Color<T> to_hsl(const Color<T>& c) {
  using S = scalar_t<T>;
  const T high = max_channel(c), low = min(min(c.r, c.g), c.b), range = high - low;
  const T light = min(T(1), (high + low) * S(0.5));
  if (value_of(range) == 0) return {T(0), T(0), light};
  const T saturation =
      value_of(light) > S(0.5) ? range / (S(2) - high - low) : range / (high + low);
  T hue;
  if (value_of(c.r) == value_of(high))
    hue = (c.g - c.b) / range + S(value_of(c.g) < value_of(c.b) ? 6 : 0);
  else if (value_of(c.g) == value_of(high))
    hue = (c.b - c.r) / range + S(2);
  else
    hue = (c.r - c.g) / range + S(4);
  return {hue / S(6), saturation, light};
}

template <class T>
Color<T> from_hsl(const Color<T>& c) {
  using S = scalar_t<T>;
  const T h = c.r * S(6), chroma = (S(1) - absolute(c.b * S(2) - S(1))) * c.g;
  const Color<T> n{saturate(absolute(h - S(3)) - S(1)), saturate(S(2) - absolute(h - S(2))),
                   saturate(S(2) - absolute(h - S(4)))};
  return map(n, [&](const T& x) { return (x - S(0.5)) * chroma + c.b; });
}

template <class T>
Color<T> convert(ConvertMode mode, const Color<T>& c) {
  switch (mode) {
    case ConvertMode::kToHsv:
      return to_hsv(c);
    case ConvertMode::kFromHsv:
      return from_hsv(c);
    case ConvertMode::kToHsl:
      return to_hsl(c);
    case ConvertMode::kFromHsl:
      return from_hsl(c);
  }
  return c;
}

/// One channel of the blend modes that have one.
template <class T>
T blend_channel(BlendMode mode, const T& a, const T& b, const T& t) {
  using S = scalar_t<T>;
  using enum BlendMode;
  const T rest = S(1) - t;
  switch (mode) {
    case kDarken:
      return lerp(a, min(a, b), t);
    case kMultiply:
      return lerp(a, a * b, t);
    case kBurn: {
      const T d = rest + t * b;
      if (!(value_of(d) > 0)) return T(0);
      return saturate(S(1) - (S(1) - a) / d);
    }
    case kLighten:
      return lerp(a, max(a, b), t);
    case kScreen:
      return S(1) - (rest + t * (S(1) - b)) * (S(1) - a);
    case kDodge: {
      if (value_of(a) == 0) return T(0);
      const T d = S(1) - t * b;
      if (!(value_of(d) > 0)) return T(1);
      return min(a / d, T(1));
    }
    case kAdd:
      return lerp(a, a + b, t);
    case kOverlay:
      return value_of(a) < S(0.5) ? a * (rest + t * b * S(2))
                                  : S(1) - (rest + t * (S(1) - b) * S(2)) * (S(1) - a);
    case kSoftLight: {
      const T screen = S(1) - (S(1) - b) * (S(1) - a);
      return rest * a + t * ((S(1) - a) * b * a + a * screen);
    }
    case kLinearLight:
      return a + t * (b * S(2) - S(1));
    case kDifference:
      return lerp(a, absolute(a - b), t);
    case kExclusion:
      return max(lerp(a, a + b - a * b * S(2), t), T(0));
    case kSubtract:
      return lerp(a, a - b, t);
    case kDivide:
      return value_of(b) != 0 ? rest * a + t * a / b : a;
    default:
      return lerp(a, b, t);
  }
}

/// `factor` has a channel for each; modes of hue and so on take its first.
template <class T>
Color<T> blend(BlendMode mode, const Color<T>& factor, const Color<T>& a, const Color<T>& b) {
  using enum BlendMode;
  if (mode < kHue)
    return each(a, b, factor, [mode](const T& x, const T& y, const T& t) {
      return blend_channel(mode, x, y, t);
    });
  const T& t = factor.r;
  Color<T> one = to_hsv(a);
  const Color<T> other = to_hsv(b);
  switch (mode) {
    case kSaturation:
      if (value_of(one.g) == 0) return a;
      one.g = lerp(one.g, other.g, t);
      return from_hsv(one);
    case kValue:
      one.b = lerp(one.b, other.b, t);
      return from_hsv(one);
    default: {  // hue, colour
      if (value_of(other.g) == 0) return a;
      one.r = other.r;
      if (mode == kColor) one.g = other.g;
      const Color<T> turned = from_hsv(one);
      return each(a, turned, [&t](const T& x, const T& y) { return lerp(x, y, t); });
    }
  }
}

template <class T>
Color<T> hue_saturation(const T& hue, const T& saturation, const T& value, const T& factor,
                        const Color<T>& c) {
  Color<T> hsv = to_hsv(c);
  hsv.r = fraction(hsv.r + hue + scalar_t<T>(0.5));
  hsv.g = saturate(hsv.g * saturation);
  hsv.b = hsv.b * value;
  return each(c, from_hsv(hsv),
              [&](const T& x, const T& y) { return max(lerp(x, y, factor), T(0)); });
}

template <class T>
Color<T> gamma(const Color<T>& c, const T& exponent) {
  if (value_of(exponent) == 0) return Color<T>(of_one(exponent, scalar_t<T>(1), scalar_t<T>(0)));
  return map(c, [&](const T& x) { return value_of(x) > 0 ? safe_power(x, exponent) : x; });
}

/// One channel of a table at x.
template <class T>
T looked_up(const ShaderTable& table, int flags, const T& x, int channel) {
  using S = scalar_t<T>;
  constexpr int kLast = ShaderTable::kSize - 1;
  const S range = S(table.high) - S(table.low), scale = S(kLast) / range;
  const S at = (value_of(x) - S(table.low)) / range;
  const auto entry = [&](int i) { return S(table.values[i][channel]); };
  if ((flags & kExtrapolate) && (at < 0 || at > 1)) {
    const int end = at < 0 ? 0 : kLast, inside = at < 0 ? 1 : kLast - 1;
    const S slope = (entry(end) - entry(inside)) * S(end - inside);
    return of_one(x, entry(end) + slope * (at - S(at < 0 ? 0 : 1)) * S(kLast), slope * scale);
  }
  const S place = std::clamp(at, S(0), S(1)) * S(kLast);
  const int i = std::min(static_cast<int>(place), kLast);
  if ((flags & kStepped) || i == kLast) return T(entry(i));
  const S t = place - S(i), a = entry(i), b = entry(i + 1);
  return of_one(x, (1 - t) * a + t * b, at < 0 || at > 1 ? S(0) : (b - a) * scale);
}

template <class T>
T ease(RangeMode mode, const T& u) {
  using S = scalar_t<T>;
  if (mode == RangeMode::kSmooth) return u * u * (S(3) - u * S(2));
  return u * u * u * (u * (u * S(6) - S(15)) + S(10));
}

/// A number; the end that it stops at with `clamped` is the nearer of To Min and To Max.
template <class T>
T map_range(RangeMode mode, int flags, const T& x, const T& from_min, const T& from_max,
            const T& to_min, const T& to_max, const T& steps) {
  const T range = from_max - from_min;
  const bool per_channel = (flags & kPerChannel) != 0;
  if (value_of(range) == 0 && !per_channel) return T(0);
  T u = safe_divide(x - from_min, range);
  if (mode == RangeMode::kStepped)
    u = value_of(steps) > 0 ? T(floor_of(u * (steps + scalar_t<T>(1)))) / steps : T(0);
  else if (mode != RangeMode::kLinear)
    u = ease(mode, saturate(u));
  const T y = to_min + u * (to_max - to_min);
  if (!(flags & kClampResult)) return y;
  return min(max(y, min(to_min, to_max)), max(to_min, to_max));
}

}  // namespace selenite::shading
