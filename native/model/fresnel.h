// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/color.h"
#include "model/narrow.h"

// Reflectances. An interface is described by its excess e = eta^2 - 1 rather than by eta, and no
// difference of nearly equal numbers is left: relative errors stay at rounding level down to eta = 1.
namespace selenite {

/// Unpolarised reflectance of a smooth dielectric at incidence cosine c > 0; 1 beyond the critical
/// angle. Fresnel's equations with g = eta cos_t = sqrt(e + c^2), multiplied out:
/// r_s = -e / (c + g)^2,  r_p = e ((e + 2) c^2 - 1) / ((e + 1) c + g)^2.
template <class C, class E>
auto fresnel_dielectric(const C& c, const E& e) {
  using std::sqrt;
  using T = decltype(c * e);
  const C c2 = c * c;
  const T g2 = e + c2;
  const auto total = !(g2 > T(0));
  if (all(total)) return T(1);
  const T g = sqrt(g2);
  const T s = e / square(c + g);
  const T p = e * ((e + E(2)) * c2 - T(1)) / square((e + E(1)) * c + g);
  return select(total, T(1), T((s * s + p * p) * number_t<T>(0.5)));
}

/// Reflectance at normal incidence, ((eta - 1) / (eta + 1))^2 = (e / (eta + 1)^2)^2.
template <class T>
T fresnel_normal(const T& e) {
  using std::sqrt;
  return square(e / square(sqrt(e + T(1)) + T(1)));
}

/// How far a reflectance has risen from its value at normal incidence f0 to 1, in [0, 1]. The
/// Principled lobes replace f0 by a tinted one and keep the rise. Where f0 is 1 (in float, below an
/// index of 2e-4) all but light at exactly normal incidence is reflected: there the rise is over.
template <class T>
T fresnel_rise(const T& reflectance, const uniform_t<T>& f0) {
  using S = scalar_t<T>;
  if (!(value_of(f0) < 1)) return T(select(value_of(reflectance) < S(value_of(f0)), S(0), S(1)));
  return clamp01(T((reflectance - f0) / (uniform_t<T>(1) - f0)));
}

/// Rise of the exact dielectric reflectance at cosine c.
template <class C, class E>
auto dielectric_rise(const C& c, const E& e) {
  return fresnel_rise(fresnel_dielectric(c, e), fresnel_normal(e));
}

/// The same of one interface, which is seen at several cosines. The interface is one for all lanes.
template <class T>
class DielectricRise {
  using S = scalar_t<T>;
  using Narrow = std::conditional_t<std::is_same_v<T, S>, S, Dual<S, 1>>;

 public:
  DielectricRise() = default;
  explicit DielectricRise(const T& excess) : excess_(excess) {
    if constexpr (std::is_same_v<T, S>)
      normal_ = fresnel_normal(excess);
    else
      normal_ = fresnel_normal(Narrow::variable(excess.v, 0));
  }
  const T& excess() const { return excess_; }

  template <class C>
  auto at(const C& c) const {
    return narrow(excess_, [&](const auto& e) { return at(c, e); });
  }
  template <class C>
  C value_at(const C& c) const {
    return at(c, value_of(excess_));
  }

 private:
  template <class C, class X>
  auto at(const C& c, const X& e) const {
    if constexpr (std::is_same_v<X, S>)
      return fresnel_rise(fresnel_dielectric(c, e), value_of(normal_));
    else
      return fresnel_rise(fresnel_dielectric(c, e), normal_);
  }

  T excess_{};
  Narrow normal_{};
};

/// Cosine-weighted mean of the dielectric reflectance over the hemisphere; a rational fit that Cycles
/// uses for energy compensation, so its error (up to 0.006) is part of the picture.
template <class T>
T fresnel_mean(const T& eta) {
  using S = scalar_t<T>;
  if (eta < T(1))
    return T(S(0.997118)) + eta * (T(S(0.1014)) - eta * (T(S(0.965241)) + eta * S(0.130607)));
  return (eta - T(1)) / (eta * S(1.00071) + T(S(4.08567)));
}

/// Metal with a colour at normal incidence (f0) and one near 82 degrees: Schlick's curve minus a
/// bump, F(c) = f0 + (1 - f0) (1 - c)^5 - b c (1 - c)^6, clamped to [0, 1].
template <class T>
struct MetalFresnel {
  Color<T> f0, bump;

  /// `edge` multiplies the reflectance that Schlick's curve has at cosine 1/7.
  MetalFresnel(const Color<T>& f0, const Color<T>& edge) : f0(f0) {
    using S = scalar_t<T>;
    const S f = S(6) / 7, f5 = f * f * f * f * f;
    for (int c = 0; c < 3; ++c)
      bump[c] = (f0[c] + (T(1) - f0[c]) * f5) * (S(7) / (f5 * f)) * (T(1) - edge[c]);
  }
  MetalFresnel() = default;

  template <class C>
  auto at(const C& c) const {
    using R = decltype(f0.r * c);
    return Color<R>(curve(f0.r, bump.r, c), curve(f0.g, bump.g, c), curve(f0.b, bump.b, c));
  }
  /// Of one channel.
  template <class X, class C>
  static auto curve(const X& f0, const X& bump, const C& c) {
    using R = decltype(f0 * c);
    const C q = C(1) - c, q5 = q * q * q * q * q;
    return clamp01(R(f0 * C(C(1) - q5) + R(q5) - bump * C(c * q5 * q)));
  }
  /// The bump of the curve from f0 through `edge` at cosine 1/7.
  template <class X>
  static X bump_of(const X& f0, const X& edge) {
    using S = scalar_t<X>;
    const S f = S(6) / 7, f5 = f * f * f * f * f;
    return (f0 + (X(1) - f0) * f5 - edge) * (S(7) / (f5 * f));
  }
  /// Cosine-weighted mean over the hemisphere (without the clamp).
  Color<T> mean() const {
    using S = scalar_t<T>;
    return f0 * (S(20) / 21) + Color<T>(T(S(1) / 21)) - bump * (S(1) / 126);
  }
};

}  // namespace selenite
