// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>

#include "model/narrow.h"
#include "model/principled.h"

namespace selenite {

/// What a random walk under the surface needs: an entry that refracts without reflecting, a medium of
/// one extinction and one albedo per channel, and a Lambertian exit. The colour of the material is the
/// wish; the medium is the one whose half space has about that albedo under diffuse light.
/// Source: docs/method/rendering.md, "Subsurface scattering"; Chiang, Kutz, Burley 2016 (the idea).
template <class T>
struct SubsurfaceMedium {
  using S = scalar_t<T>;

  Color<T> entry{};    ///< what is left of the lobe's weight on entry, the colour divided out
  Color<T> sigma_t{};  ///< per Blender unit; 0 in a channel that does not enter
  Color<T> albedo{};   ///< of single scattering
  T anisotropy{};      ///< g of Henyey and Greenstein, in [0, 0.9]

  SubsurfaceMedium(const Principled<T>& m, const Flavour& flavour, const T& entry_eta);

  /// Single-scattering albedo of the half space of reflectance `color`; both scalars of one type.
  /// Source: the fit of Wrenninge, Villemin and Hery 2017, "Path Traced Subsurface Scattering using
  /// Anisotropic Phase Functions and Non-Exponential Free Flights". At g = 0 it gives .6134, .9137,
  /// .9992 for .2, .5, .9.
  template <class X>
  static X invert(const X& color, const X& g);
};

/// A path length below this stands for no subsurface scattering at all in that channel.
inline constexpr double kLeastSubsurfaceRadius = 1e-8;

/// Whether light of this channel enters.
template <class T>
bool scatters_under(const Principled<T>& m, int channel) {
  return value_of(m.subsurface_radius[channel]) * value_of(m.subsurface_scale) >=
         scalar_t<T>(kLeastSubsurfaceRadius);
}

template <class T>
template <class X>
X SubsurfaceMedium<T>::invert(const X& color, const X& g) {
  using std::atan, std::exp, std::log;
  if (!(value_of(color) > 0)) return X(0);
  const auto polynomial = [&g](const auto& c) {
    X sum(0);
    for (std::size_t i = std::size(c); i-- > 0;) sum = sum * g + X(S(c[i]));
    return sum;
  };
  static constexpr double kA[] = {1.8260523782,   -1.28451056436, -1.79904629312, 9.19393289202,
                                  -22.8215585862, 32.0234874259,  -23.6264803333, 7.21067002658};
  static constexpr double kB[] = {0,
                                  31.1491581433,
                                  -201.847017512,
                                  841.576016723,
                                  -2018.09288505,
                                  2731.71560286,
                                  -1935.41424244,
                                  559.009054474};
  static constexpr double kC[] = {1.09686102424, -0.394704063468, 1.05258115941, -8.83963712726,
                                  28.8643230661, -46.8802913581,  38.5402837518, -12.7181042538};
  static constexpr double kD[] = {0.496310210422, 0.360146581622, -2.15139309747, 17.8896899217,
                                  -55.2984010333, 82.065982243,   -58.5106008578, 15.8478295021};
  static constexpr double kE[] = {0,
                                  76.7316253952,
                                  -594.356773233,
                                  2448.8834203,
                                  -5576.68528998,
                                  7116.60171912,
                                  -4763.54467887,
                                  1303.5318055};
  static constexpr double kF[] = {2.40602999408, -2.51814844609, 9.18494908356, -79.2191708682,
                                  259.082868209, -403.613804597, 302.85712436,  -87.4370473567};
  const X b = exp(polynomial(kB)) * S(0.127355959438) + X(S(4.98511194385));
  const X e = exp(polynomial(kE)) * S(0.00310603949088) + X(S(4.23190299701));
  const X dark = polynomial(kA) * exp(polynomial(kC) * log(atan(b * color)));
  const X bright = polynomial(kD) * exp(polynomial(kF) * log(atan(e * color)));
  const X blend = exp(log(color) * S(0.25));
  return clamp((X(1) - blend) * dark + blend * bright, S(0), S(0.999999));
}

/// Reflectance of a half space with a dipole of light inside it, as a function of its reduced albedo.
/// Source: Jensen et al. 2001, the total of equation 4.
template <class X>
X dipole_reflectance(const X& albedo, const X& boundary) {
  using std::exp, std::sqrt;
  using S = scalar_t<X>;
  const X s = sqrt((X(1) - albedo) * S(3));
  return albedo * (X(1) + exp(-(boundary * s))) * exp(-s) * S(0.5);
}

/// Reduced albedo of the dipole of reflectance `color`, in an index of refraction eta >= 1.
template <class X>
X dipole_albedo(const X& color, const X& eta) {
  using S = scalar_t<X>;
  // Diffuse Fresnel reflectance, a fit of Egan and Hilgeman.
  const X inverse = X(1) / eta;
  const X f = (inverse * S(-1.440) + X(S(0.710))) * inverse + X(S(0.668)) + eta * S(0.0636);
  const X boundary = (X(1) + f) / (X(1) - f) * (S(4) / 3);
  S low = 0, high = 1;
  for (int i = 0; i < 40; ++i) {  // bisection of a growing function
    const S middle = (low + high) / 2;
    (dipole_reflectance(middle, value_of(boundary)) < value_of(color) ? low : high) = middle;
  }
  const S root = std::min((low + high) / 2, S(0.999999));
  if constexpr (std::is_same_v<X, S>) {
    return root;
  } else {
    // The implicit function: R(a, boundary) = color.
    const auto d = dipole_reflectance(Dual<S, 2>::variable(root, 0),
                                      Dual<S, 2>::variable(value_of(boundary), 1));
    return chain(color, root, 1 / d.d[0]) + chain(boundary, S(0), -d.d[1] / d.d[0]);
  }
}

template <class T>
SubsurfaceMedium<T>::SubsurfaceMedium(const Principled<T>& m, const Flavour& flavour,
                                      const T& entry_eta)
    : anisotropy(clamp(m.subsurface_anisotropy, S(0), S(0.9))) {
  // Cycles keeps the albedo of its walk from falling below this and makes up for it in the weight.
  constexpr S kLeastAlbedo = S(0.2);
  for (int c = 0; c < 3; ++c) {
    if (!scatters_under(m, c)) continue;
    const T color = clamp01(m.base_color[c]);
    const T a =
        narrow(color, anisotropy, [](const auto& x, const auto& g) { return invert(x, g); });
    entry[c] = value_of(a) < kLeastAlbedo ? a / kLeastAlbedo : T(1);
    albedo[c] = max(a, T(kLeastAlbedo));
    T free_path = m.subsurface_radius[c] * m.subsurface_scale;
    if (flavour.subsurface == Flavour::Subsurface::kRandomWalkSkin) {
      const T reduced = narrow(
          color, entry_eta, [](const auto& x, const auto& eta) { return dipole_albedo(x, eta); });
      free_path *= safe_sqrt((T(1) - reduced) * S(3));
    } else {
      free_path *= S(0.25) * kInvPi<S>;
    }
    sigma_t[c] = T(1) / (free_path * (T(1) - anisotropy));
  }
}

}  // namespace selenite
