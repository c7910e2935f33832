// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>

#include "math/color.h"
#include "model/dielectric.h"
#include "model/narrow.h"
#include "model/tables/film_table.h"

namespace selenite {

/// A transparent film of even thickness.
template <class T>
struct ThinFilm {
  T thickness{0};  ///< nm
  T ior{1.33};
};

/// Cycles leaves thinner films out, nm.
inline constexpr double kThinnestFilm = 0.1;

/// Amplitudes that an interface reflects of the two polarisations.
template <class X>
struct Amplitudes {
  X across, along;
  X cos_beyond;        ///< of the refracted ray
  bool total = false;  ///< nothing is refracted
};

/// Fresnel's equations. c > 0: cosine on this side; n: index beyond over here.
template <class X>
Amplitudes<X> amplitudes(const X& c, const X& n) {
  using std::sqrt;
  const X g2 = n * n - (X(1) - c * c);
  if (!(g2 > X(0))) return {X(1), X(1), X(0), true};
  const X g = sqrt(g2);  // n times the cosine beyond
  return {(c - g) / (c + g), (n * n * c - g) / (n * n * c + g), g / n};
}

/// Real part of the Fourier transform of the eye's sensitivity to a channel, at a difference between
/// optical paths in nm.
template <class X>
X film_coherence(int channel, const X& path) {
  using S = scalar_t<X>;
  using std::cos;
  constexpr S kStep = S(kFilmReach / (kFilmNodes - 1));
  const X x = clamp(X(path / kStep), S(0), S(kFilmNodes - 1));
  const int i = std::min(static_cast<int>(value_of(x)), kFilmNodes - 2);
  const X t = x - X(S(i));
  const auto at = [&](const float(&row)[kFilmNodes]) {
    return X(S(row[i])) + t * S(row[i + 1] - row[i]);
  };
  return at(kFilmMagnitude[channel]) * cos(at(kFilmPhase[channel]));
}

/// Reflectance of each channel of a film on a dielectric of relative index eta, seen at the cosine c.
/// With r and r' the amplitudes of its faces, R = r^2, T = 1 - R and Rs = T^2 R' / (1 - R R'), it is
///
///     R + Rs + 2 (Rs - T) sum over m of (-r r')^m coherence(m times the path), m = 1 to 3,
///
/// the mean of both polarisations. Source: Belcour and Barla 2017, equation 10, cut off as in Cycles,
/// which also lets films below 30 nm fade away.
template <class X>
std::array<X, 3> film_reflectance(const X& thickness, const X& ior, const X& eta, const X& c) {
  using S = scalar_t<X>;
  constexpr S kFading = S(30);
  const X all(1);
  X film = ior;
  if (value_of(thickness) < kFading) {
    const X t = max(thickness, X(0)) / kFading;
    film = all + (ior - all) * (t * t * (X(S(3)) - t * S(2)));
  }
  const auto top = amplitudes(c, film);
  if (top.total) return {all, all, all};
  const auto bottom = amplitudes(top.cos_beyond, X(eta / film));
  if (bottom.total) return {all, all, all};
  const X path = film * thickness * top.cos_beyond * S(2);

  constexpr int kOrders = 3;
  std::array<X, kOrders> share{X(0), X(0), X(0)};
  X mean(0);
  const auto add = [&](const X& r, const X& beyond) {
    const X r2 = r * r, b2 = beyond * beyond, through = all - r2;
    const X rest = through * through * b2 / (all - r2 * b2);
    mean += (r2 + rest) * S(0.5);
    X term = rest - through;
    for (X& order : share) {
      term = term * -(r * beyond);
      order += term;
    }
  };
  add(top.across, bottom.across);
  add(top.along, bottom.along);
  std::array<X, 3> found{mean, mean, mean};
  for (int m = 0; m < kOrders; ++m)
    for (int k = 0; k < 3; ++k) found[k] += share[m] * film_coherence(k, X(path * S(m + 1)));
  return {clamp01(found[0]), clamp01(found[1]), clamp01(found[2])};
}

/// What a film makes of a dielectric reflection.
template <class T>
class FilmedInterface {
  using S = scalar_t<T>;

 public:
  /// normal: reflectance without film at normal incidence; tint: colour of what passes.
  FilmedInterface(const ThinFilm<T>& film, const T& eta, const T& normal,
                  const Color<T>& tint = Color<T>(T(1)))
      : film_(film), eta_(eta), normal_(normal), tint_(tint) {}

  /// Of `gloss`, the reflection without film. Cycles tints it the more, the closer the reflectance is
  /// to that at normal incidence.
  Color<T> reflect(const Gloss<T>& gloss, const T& c) const {
    const Color<T> film = reflectance(c), whole = gloss.flat + gloss.risen;
    if (!(value_of(normal_) > kLeastNormal)) return film * whole;
    Color<T> found;
    for (int k = 0; k < 3; ++k) {
      const T tinted = clamp01(T((T(1) - film[k]) / (T(1) - normal_)));
      found[k] = film[k] * (whole[k] * (T(1) - tinted) + gloss.flat[k] * (tinted / normal_));
    }
    return found;
  }
  Color<T> transmit(const Gloss<T>& gloss, const T& c) const {
    return (gloss.flat + gloss.risen - reflect(gloss, c)) * tint_;
  }
  bool moves() const {
    return has_slope(film_.thickness) || has_slope(film_.ior) || has_slope(eta_);
  }

 private:
  static constexpr S kLeastNormal = S(1e-5);

  Color<T> reflectance(const T& c) const {
    const auto &d = film_.thickness, &n = film_.ior;
    if constexpr (std::is_same_v<T, S>) {
      const auto found = film_reflectance(d, n, eta_, c);
      return {found[0], found[1], found[2]};
    } else {
      Color<T> result;
      if (!moves() && !has_slope(c)) {
        const auto found = film_reflectance(d.v, n.v, eta_.v, c.v);
        for (int k = 0; k < 3; ++k) result[k] = T(found[k]);
        return result;
      }
      using D = Dual<S, 4>;
      const auto found = film_reflectance(D::variable(d.v, 0), D::variable(n.v, 1),
                                          D::variable(eta_.v, 2), D::variable(c.v, 3));
      for (int k = 0; k < 3; ++k) {
        const D& x = found[k];
        result[k] = chain(d, x.v, x.d[0]) + chain(n, S(0), x.d[1]) + chain(eta_, S(0), x.d[2]) +
                    chain(c, S(0), x.d[3]);
      }
      return result;
    }
  }

  ThinFilm<T> film_;
  T eta_, normal_;
  Color<T> tint_;
};

}  // namespace selenite
