// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/color.h"
#include "math/vec.h"
#include "model/narrow.h"

namespace selenite {

/// Diffuse reflection of a rough surface, Oren and Nayar's model in Fujii's form with the energy that
/// single scattering loses given back. Roughness 0 is exactly Lambert's law, and has a derivative.
///
/// With s = roughness, A = 1 / (pi + s k), k = pi/2 - 2/3 and the albedo E(c) = A (pi + s G(c)):
/// 1 - E = A s (k - G), which keeps the energy term free of 0/0 at s = 0.
template <class T>
class OrenNayar {
  using S = scalar_t<T>;
  using U = uniform_t<T>;
  using R = number_t<T>;

 public:
  OrenNayar() = default;
  /// cos_i: viewer's cosine to the shading normal. albedo: single-scattering colour, at least 0.
  OrenNayar(const U& roughness, const Color<U>& albedo, S cos_i) : cos_i_(max(cos_i, S(0))) {
    flat_ = U(1) / (roughness * kShadow + U(kPi<R>));
    tilt_ = roughness * flat_;
    const U mean_loss = tilt_ * (kShadow - kMeanGain);
    const T view_loss = tilt_ * max(kShadow - gain(cos_i_), S(0));
    const T shape = (U(1) - mean_loss) * view_loss * (kInvPi<R> / (kShadow - kMeanGain));
    for (int c = 0; c < 3; ++c) {
      const U rho = clamp01(albedo[c]);
      rescattered_[c] = rho * rho * shape / (U(1) - rho * mean_loss);
    }
  }

  /// Per unit of albedo, 1/sr, without the cosine. cos_o > 0; cos_io = dot(wi, wo).
  Color<T> value(S cos_o, S cos_io) const {
    S t = max(cos_io - cos_i_ * cos_o, S(-1));  // rounding must not make light negative
    if (const auto forward = t > S(0); any(forward))
      t = select(forward, S(t / max(cos_i_, cos_o)), t);
    const T single = flat_ + tilt_ * t;
    const S light_loss = max(kShadow - gain(cos_o), S(0));
    return rescattered_ * light_loss + Color<T>(single);
  }

 private:
  static constexpr R kShadow = kPi<R> / 2 - R(2) / 3;
  static constexpr R kMeanGain = (2 * kPi<R> - R(5.6)) / 3;  // cosine-weighted mean of gain

  /// G(c) = sin (theta - 2/3 - sin c) + 2/3 tan (1 - sin^3); the last term without 0 * inf at c = 0.
  static S gain(S c) {
    using std::acos;
    c = min(c, S(1));
    const S s = safe_sqrt((1 - c) * (1 + c));
    const S last = s * c * (1 + s + s * s) / (1 + s);
    return s * (acos(c) - R(2) / 3 - s * c) + last * R(2) / 3;
  }

  S cos_i_ = 0;
  U flat_{}, tilt_{};
  Color<T> rescattered_{};
};

/// Diffuse reflection of the Principled BSDF of Blender 3.x. Source: Burley 2012 (base diffuse) with
/// the retro-reflection separated, Burley 2015.
/// Per unit of albedo, 1/sr, without the cosine; cosines to the shading normal, cos_io = dot(wi, wo).
template <class U, class S>
auto disney_diffuse(const U& roughness, const S& cos_i, const S& cos_o, const S& cos_io) {
  const auto schlick = [](S c) {
    const S q = 1 - clamp01(c);
    return q * q * q * q * q;
  };
  const S i = schlick(cos_i), o = schlick(cos_o);
  using T = decltype(roughness * cos_io);
  const T retro = roughness * (cos_io + 1);
  return ((retro - T(1)) * (i * o) + T(i + o)) * retro * kInvPi<S> +
         T((1 - i / 2) * (1 - o / 2) * kInvPi<S>);
}

}  // namespace selenite
