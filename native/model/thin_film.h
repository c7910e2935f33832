// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>

#include "math/color.h"
#include "model/dielectric.h"
#include "model/fresnel.h"
#include "model/narrow.h"
#include "model/tables/film_table.h"

namespace selenite {

/// A transparent film of even thickness.
template <class T>
struct ThinFilm {
  T thickness{0};  ///< nm
  T ior{1.33};

  T index() const { return max(ior, T(scalar_t<T>(1e-5))); }
};

/// Whether there is a film: Cycles leaves out what is thinner than 0.1 nm.
template <class T>
bool is_there(const ThinFilm<T>& film) {
  return value_of(film.thickness) > scalar_t<T>(0.1) || has_slope(film.thickness);
}

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

/// A complex number.
template <class X>
struct Phasor {
  X re, im;

  friend Phasor operator*(const Phasor& a, const Phasor& b) {
    return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
  }
  Phasor operator*(const X& x) const { return {re * x, im * x}; }
};

/// Fourier transform of the eye's sensitivity to a channel, at a difference between optical paths in
/// nm: Blender 4 interpolates its magnitude and phase, Blender 5 its parts.
template <class X>
class FilmCoherence {
  using S = scalar_t<X>;

 public:
  FilmCoherence(int channel, const X& path) : channel_(channel) {
    constexpr S kStep = S(kFilmReach / (kFilmNodes - 1));
    const X x = clamp(X(path / kStep), S(0), S(kFilmNodes - 1));
    node_ = std::min(static_cast<int>(value_of(x)), kFilmNodes - 2);
    beyond_ = x - X(S(node_));
  }
  X real_of_4() const {
    using std::cos;
    return at(kFilmMagnitude) * cos(at(kFilmPhase));
  }
  X real_of_5() const { return at(kFilmReal); }
  X imaginary_of_5() const { return at(kFilmImaginary); }

 private:
  X at(const float (&rows)[3][kFilmNodes]) const {
    const auto& row = rows[channel_];
    return X(S(row[node_])) + beyond_ * S(row[node_ + 1] - row[node_]);
  }

  int channel_, node_;
  X beyond_;
};

/// The index of a film that Cycles lets fade away below a thickness of `fading` nm.
template <class X>
X faded_ior(const ThinFilm<X>& film, scalar_t<X> fading) {
  using S = scalar_t<X>;
  if (!(value_of(film.thickness) < fading)) return film.index();
  const X t = max(film.thickness, X(0)) / fading;
  return X(1) + (film.index() - X(1)) * (t * t * (X(S(3)) - t * S(2)));
}
inline constexpr double kFadingOf4 = 30, kFadingOf5 = 1;
/// Differences between paths that are counted.
inline constexpr int kFilmOrders = 3;

/// Reflectance of each channel of a film on a dielectric of relative index eta, seen at the cosine c.
/// With r and r' the amplitudes of its faces, R = r^2, T = 1 - R and Rs = T^2 R' / (1 - R R'), it is
///
///     R + Rs + 2 (Rs - T) sum over m of (-r r')^m coherence(m times the path), m = 1 to 3,
///
/// the mean of both polarisations. Source: Belcour and Barla 2017, equation 10, cut off as in Cycles.
template <class X>
std::array<X, 3> film_reflectance(const X& thickness, const X& ior, const X& eta, const X& c,
                                  bool blender5 = false) {
  using S = scalar_t<X>;
  const X all(1);
  const X film = faded_ior(ThinFilm<X>{thickness, ior}, S(blender5 ? kFadingOf5 : kFadingOf4));
  const auto top = amplitudes(c, film);
  if (top.total) return {all, all, all};
  const auto bottom = amplitudes(top.cos_beyond, X(eta / film));
  if (bottom.total) return {all, all, all};
  const X path = film * thickness * top.cos_beyond * S(2);

  std::array<X, kFilmOrders> share{X(0), X(0), X(0)};
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
  for (int m = 0; m < kFilmOrders; ++m)
    for (int k = 0; k < 3; ++k) {
      const FilmCoherence<X> coherence(k, path * S(m + 1));
      found[k] += share[m] * (blender5 ? coherence.real_of_5() : coherence.real_of_4());
    }
  return {clamp01(found[0]), clamp01(found[1]), clamp01(found[2])};
}

/// Metal below a film in one channel: its complex index, and where it has the colours of MetalFresnel
/// their value at cosine 1/7, whose curve then stands for the reflectance.
template <class X>
struct MetalBelow {
  X n, k;
  bool has_edge = false;
  X edge{0};
};

/// The index that has a metal's reflectance f0 at normal incidence and approximately `edge` at cosine
/// 1/7. Source: Gulbrandsen 2014.
template <class X>
MetalBelow<X> metal_of_colors(const X& f0, const X& edge) {
  using S = scalar_t<X>;
  const X r = min(f0, X(S(0.999))), root = capped_root(r, S(1e-3));
  const X bare = (X(1) + root) / (X(1) - root), least = (X(1) - r) / (X(1) + r);
  const X n = bare + (least - bare) * edge;
  return {n, safe_sqrt(X((r * square(n + X(1)) - square(n - X(1))) / (X(1) - r))), true, edge};
}

/// What metal reflects of the two polarisations of light that comes from the index `outside`.
template <class X>
struct MetalAmplitudes {
  Phasor<X> across, along;  ///< of length 1: phases
  X across2, along2;        ///< reflectances

  MetalAmplitudes(const MetalBelow<X>& metal, const X& outside, const X& c) {
    const X n2 = square(metal.n), k2 = square(metal.k), both = metal.n * metal.k * scalar_t<X>(2);
    // The refracted wave u + i v is the root of the square of the index less that of the sine.
    const X part = n2 - k2 - square(outside) * (X(1) - c * c);
    const Phasor<X> beyond = root_of(part, both);
    divide({outside * c, X(0)}, beyond, across, across2);
    divide({(n2 - k2) * c, both * c}, beyond * outside, along, along2);
    if (!metal.has_edge) return;
    const X p = metal.n / outside, q = square(metal.k / outside);
    const X f0 = (square(p - X(1)) + q) / (square(p + X(1)) + q);
    across2 = along2 = MetalFresnel<X>::curve(f0, MetalFresnel<X>::bump_of(f0, metal.edge), c);
  }

 private:
  /// The root of part + i both, both >= 0. Its smaller number is a quotient, not a root of a
  /// difference, so that it has a slope where it is 0.
  static Phasor<X> root_of(const X& part, const X& both) {
    using S = scalar_t<X>;
    const X whole = safe_sqrt(X(square(part) + square(both)));
    const bool is_real = value_of(part) > 0;
    const X larger = safe_sqrt(X((is_real ? whole + part : whole - part) * S(0.5)));
    if (!(value_of(larger) > 0)) return {larger, larger};
    const X smaller = both / (larger * S(2));
    return is_real ? Phasor<X>{larger, smaller} : Phasor<X>{smaller, larger};
  }
  /// (a - b) / (a + b) as its phase and its squared length.
  static void divide(const Phasor<X>& a, const Phasor<X>& b, Phasor<X>& phase, X& length2) {
    const Phasor<X> over{a.re - b.re, a.im - b.im}, under{a.re + b.re, a.im + b.im};
    const X below = square(under.re) + square(under.im);
    length2 = value_of(below) > 0 ? X((square(over.re) + square(over.im)) / below) : X(0);
    const Phasor<X> turned = over * Phasor<X>{under.re, -under.im};
    const X length = safe_sqrt(X(square(turned.re) + square(turned.im)));
    phase = value_of(length) > 0 ? turned * X(X(1) / length) : Phasor<X>{X(1), X(0)};
  }
};

/// Reflectance of a film on metal in one channel, as of Blender 5: the sum of `film_reflectance` with
/// the phases of the metal.
template <class X>
X filmed_metal(int channel, const ThinFilm<X>& given, const MetalBelow<X>& metal, const X& c) {
  using S = scalar_t<X>;
  const X film = faded_ior(given, S(kFadingOf5)), all(1);
  const auto top = amplitudes(c, film);
  if (top.total) return all;
  const MetalAmplitudes<X> bottom(metal, film, top.cos_beyond);
  const X path = film * given.thickness * top.cos_beyond * S(2);
  std::array<Phasor<X>, kFilmOrders> coherence;
  for (int m = 0; m < kFilmOrders; ++m) {
    const FilmCoherence<X> found(channel, path * S(m + 1));
    coherence[m] = {found.real_of_5(), found.imaginary_of_5()};
  }
  const auto polarised = [&](const X& r, const X& b2, const Phasor<X>& phase) {
    const X r2 = r * r, through = all - r2;
    const X rest = through * through * b2 / (all - r2 * b2);
    const Phasor<X> turn = phase * X(-(r * safe_sqrt(b2)));
    X found = r2 + rest;
    Phasor<X> power = turn;
    for (const Phasor<X>& at : coherence) {
      found += (rest - through) * (power.re * at.re + power.im * at.im) * S(2);
      power = power * turn;
    }
    return found;
  };
  return clamp01(X((polarised(top.across, bottom.across2, bottom.across) +
                    polarised(top.along, bottom.along2, bottom.along)) *
                   S(0.5)));
}

/// What a film makes of a dielectric reflection.
template <class T>
class FilmedInterface {
  using S = scalar_t<T>;

 public:
  /// normal: reflectance without film at normal incidence; tint: colour of what passes.
  FilmedInterface(const ThinFilm<T>& film, bool blender5, const T& eta, const T& normal,
                  const Color<T>& tint = Color<T>(T(1)))
      : film_(film), blender5_(blender5), eta_(eta), normal_(normal), tint_(tint) {}

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
      const auto found = film_reflectance(d, n, eta_, c, blender5_);
      return {found[0], found[1], found[2]};
    } else {
      Color<T> result;
      if (!moves() && !has_slope(c)) {
        const auto found = film_reflectance(d.v, n.v, eta_.v, c.v, blender5_);
        for (int k = 0; k < 3; ++k) result[k] = T(found[k]);
        return result;
      }
      using D = Dual<S, 4>;
      const auto found = film_reflectance(D::variable(d.v, 0), D::variable(n.v, 1),
                                          D::variable(eta_.v, 2), D::variable(c.v, 3), blender5_);
      for (int k = 0; k < 3; ++k) {
        const D& x = found[k];
        result[k] = chain(d, x.v, x.d[0]) + chain(n, S(0), x.d[1]) + chain(eta_, S(0), x.d[2]) +
                    chain(c, S(0), x.d[3]);
      }
      return result;
    }
  }

  ThinFilm<T> film_;
  bool blender5_;
  T eta_, normal_;
  Color<T> tint_;
};

/// What a film makes of metal, in Blender 5.
template <class T>
class FilmedMetal {
  using S = scalar_t<T>;

 public:
  FilmedMetal(const ThinFilm<T>& film, const MetalFresnel<T>& metal)
      : film_(film), first_(metal.f0), second_(metal.bump), colored_(true) {}
  /// Of the complex index n + i k.
  FilmedMetal(const ThinFilm<T>& film, const Color<T>& n, const Color<T>& k)
      : film_(film), first_(n), second_(k), colored_(false) {}

  /// Instead of its Fresnel term at the cosine c.
  Color<T> at(S c) const {
    Color<T> found;
    for (int k = 0; k < 3; ++k) found[k] = channel(k, c);
    return found;
  }
  bool moves() const {
    return has_slope(film_.thickness) || has_slope(film_.ior) || has_slope(first_) ||
           has_slope(second_);
  }

 private:
  T channel(int k, S c) const {
    const T &d = film_.thickness, &n = film_.ior, &first = first_[k], &second = second_[k];
    if constexpr (std::is_same_v<T, S>) {
      return reflectance<S>(k, {d, n}, first, second, c);
    } else {
      if (!moves()) return T(reflectance<S>(k, {d.v, n.v}, first.v, second.v, c));
      using D = Dual<S, 4>;
      const D x = reflectance<D>(k, {D::variable(d.v, 0), D::variable(n.v, 1)},
                                 D::variable(first.v, 2), D::variable(second.v, 3), D(c));
      return chain(d, x.v, x.d[0]) + chain(n, S(0), x.d[1]) + chain(first, S(0), x.d[2]) +
             chain(second, S(0), x.d[3]);
    }
  }
  template <class X>
  X reflectance(int k, const ThinFilm<X>& film, const X& first, const X& second, const X& c) const {
    if (!colored_) return filmed_metal(k, film, MetalBelow<X>{first, second}, c);
    const X edge = MetalFresnel<X>::curve(first, second, X(S(1) / 7));
    return filmed_metal(k, film, metal_of_colors(first, edge), c);
  }

  ThinFilm<T> film_;
  Color<T> first_, second_;  ///< f0 and bump of MetalFresnel, or the index
  bool colored_;
};

}  // namespace selenite
