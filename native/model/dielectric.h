// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/color.h"
#include "model/fresnel.h"

namespace selenite {

/// sqrt(x) whose slope stops growing below `least`: the table axes and the colour of refraction are
/// roots of parameters, whose true slope at 0 is infinite; an optimiser needs a finite one.
template <class T>
T capped_root(const T& x, scalar_t<T> least) {
  using S = scalar_t<T>;
  if constexpr (std::is_same_v<T, S>) {
    return safe_sqrt(x);
  } else {
    const S root = safe_sqrt(x.v);
    return chain(x, root, S(0.5) / max(root, least));
  }
}

/// base^exponent for base >= 0, exponent >= 1, which may differ from lane to lane.
template <class T>
T tint_power(const uniform_t<T>& base, const T& exponent) {
  using std::pow;
  using S = scalar_t<T>;
  const number_t<T> b = value_of(base);
  const S e = value_of(exponent), v = pow(b, e);
  if constexpr (std::is_same_v<T, S>) {
    return v;
  } else {
    return chain(base, v, S(e * pow(b, S(e - 1)))) +
           chain(exponent, S(0), b > 0 ? S(v * std::log(b)) : S(0));
  }
}

/// A dielectric interface, described by x = (n - 1) / (n + 1), whose square is the reflectance at
/// normal incidence and which is an odd function of log n.
template <class T>
struct Dielectric {
  T eta, excess, normal, z;  ///< n; n^2 - 1; x^2; axis of the tables

  static Dielectric from_amplitude(const T& x) {
    using std::abs;
    return {(T(1) + x) / (T(1) - x), x * scalar_t<T>(4) / square(T(1) - x), square(x),
            capped_root(abs(x), kLeastAxis)};
  }
  static Dielectric from_ior(const T& n) {
    using std::abs;
    const T x = (n - T(1)) / (n + T(1));
    return {n, (n - T(1)) * (n + T(1)), square(x), capped_root(abs(x), kLeastAxis)};
  }

 private:
  static constexpr scalar_t<T> kLeastAxis = scalar_t<T>(0.01);  // |n - 1| = 2e-4
};

/// Reflectance of a tinted dielectric, weight of the lobe included: flat + risen * rise.
template <class T>
struct Gloss {
  Color<T> flat{}, risen{};
  DielectricRise<uniform_t<T>> rise{};

  Color<T> at(scalar_t<T> c) const { return flat + risen * rise.at(c); }
};

}  // namespace selenite
