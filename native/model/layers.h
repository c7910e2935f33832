// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include "model/albedo_tables.h"
#include "model/dielectric.h"
#include "model/diffuse.h"
#include "model/fresnel.h"
#include "model/ggx.h"
#include "model/principled.h"
#include "model/shading_normal.h"
#include "model/sheen.h"
#include "model/subsurface.h"

namespace selenite {

/// Lobes in the order in which one is drawn.
enum Lobe { kDiffuse, kSubsurface, kSpecular, kMetal, kGlass, kCoat, kSheen, kLobes };

/// Weights of all lobes for one shading point and viewer direction, from top to bottom: transparency,
/// sheen, coat, emission, metal, glass, dielectric specular, subsurface, diffuse. Constant over the
/// light direction.
template <class T>
struct Layers {
  using S = scalar_t<T>;

  std::array<bool, kLobes> present{};
  std::array<S, kLobes> pick{};  ///< probabilities of drawing a lobe; sum 1, or all 0
  T width2{}, coat_width2{};     ///< squared GGX widths
  T through_width2{};            ///< of the refraction, which version 1 may make wider
  Gloss<T> specular, glass, coat;
  MetalFresnel<T> metal;
  Sheen<T> sheen;
  Color<T> sheen_weight{};  ///< of the sheen lobe, its albedo included
  Color<T> metal_weight{}, glass_through{}, diffuse{}, subsurface{}, emission{}, transparency{};
  /// Of the refraction on entry into subsurface scattering: squared GGX width, index of refraction.
  T entry_width2{}, entry_eta{1};
  std::optional<OrenNayar<T>> rough_diffuse;
  T retro_roughness{};  ///< of the diffuse lobe of version 1
  T eta{1};             ///< index of refraction of the far side over the viewer's side, for glass
  /// Reflected and refracted share of white glass; for the choice between the two.
  S glass_flat = 0, glass_tint = 0, glass_least = 0, glass_most = 1;
  /// Version 1: masking and shadowing multiply instead of being height-correlated, glass is weighted
  /// by the Fresnel term at the shading normal and not at the micronormal, diffuse is Disney's.
  bool version1;
  S macro_reflected = 0;  ///< version 1: probability that glass reflects

  /// cos_i: viewer's cosine to the bent normal of the specular lobes, > 0.
  Layers(const Principled<T>& m, const Flavour& flavour, const SurfacePoint<S>& point, S cos_i)
      : version1(flavour.version == Flavour::Version::kV1),
        cos_i_(cos_i),
        compensate_(flavour.distribution == Flavour::Distribution::kMultiGgx),
        skin_(flavour.subsurface == Flavour::Subsurface::kRandomWalkSkin) {
    const T alpha = clamp01(m.alpha);
    transparency = Color<T>(T(1) - alpha);
    const T roughness = clamp01(m.roughness);
    width2 = through_width2 = square(square(roughness));
    if (version1) {
      stack_version1(m, alpha, point.backfacing);
    } else {
      stack(m, alpha, point);
    }
    choose();
  }

 private:
  void stack(const Principled<T>& m, const T& alpha, const SurfacePoint<S>& point) {
    T w = alpha;  // what the layers above let through, one number for all channels
    const T roughness = clamp01(m.roughness);
    const T sheen_share = nonnegative(m.sheen_weight);
    const Color<T> sheen_tint = map(m.sheen_tint, nonnegative);
    if (matters(sheen_tint * (w * sheen_share))) add_sheen(m, sheen_tint, sheen_share, point, w);
    const T coat_weight = nonnegative(m.coat_weight);
    if (matters(w * coat_weight)) add_coat(m, coat_weight, w);
    const Color<T> below = present[kCoat] ? below_coat(m, coat_weight) : Color<T>(T(1));
    for (int c = 0; c < 3; ++c) blocked_[c] = value_of(below[c]) == 0 && !has_slope(below[c]);
    if (matters(m.emission_strength)) emission = m.emission_color * (m.emission_strength * w);

    const T metallic = clamp01(m.metallic);
    if (matters(below * (w * metallic))) add_metal(m, roughness, w * metallic);
    w = w * (T(1) - metallic);

    const T ior = max(m.ior, T(S(1e-5)));
    const T transmission = clamp01(m.transmission);
    if (matters(below * (w * transmission)))
      add_glass(m, roughness, point.backfacing ? T(1) / ior : ior, w * transmission);
    w = w * (T(1) - transmission);

    if (matters(below * w)) {
      add_specular(m, roughness, ior, w);
      add_diffuse(m, w, below, point);
    }
    if (!present[kCoat]) return;
    for (Color<T>* c : {&emission, &metal_weight, &glass.flat, &glass.risen, &glass_through,
                        &specular.flat, &specular.risen, &diffuse, &subsurface})
      *c *= below;
  }
  void stack_version1(const Principled<T>& m, const T& alpha, bool backfacing);  // layers_v1.h

  // Cycles leaves out lobes below this weight; here only if no derivative would be lost.
  static constexpr S kLeastWeight = S(1e-5);
  // Share of the samples given to a lobe that carries derivatives, however dark it is.
  static constexpr S kSlopeShare = S(0.1);

  static T nonnegative(const T& x) { return max(x, T(0)); }
  template <class X>
  static bool matters(const X& weight) {
    if constexpr (requires { weight.r; }) {
      return value_of(mean_channel(weight)) >= kLeastWeight || has_slope(weight);
    } else {
      return value_of(weight) >= kLeastWeight || has_slope(weight);
    }
  }
  static Color<T> base01(const Principled<T>& m) { return map(m.base_color, clamp01<T>); }

  /// Applies a per-channel function; once only if the channels are equal constants.
  template <class F>
  static Color<T> map_tint(const Color<T>& c, F&& f) {
    return is_constant_grey(c) ? Color<T>(f(c.r)) : map(c, f);
  }
  static bool is_constant_grey(const Color<T>& c) {
    return !has_slope(c) && value_of(c.r) == value_of(c.g) && value_of(c.g) == value_of(c.b);
  }

  /// Factor by which a lobe with single-scattering albedo e (mean e_mean over the hemisphere) and mean
  /// Fresnel reflectance f has to be scaled to account for the light it scatters more than once.
  template <class X>
  static X compensation(const X& f, const X& e, const X& e_mean) {
    const X rescattered = f * e_mean / (X(1) - f * (X(1) - e_mean));
    return X(1) + rescattered * (X(1) - e) / e;
  }

  /// Fresnel terms of a GGX reflection under an interface of relative tint `tint` (flat and risen, see
  /// Gloss), and the share of light that it reflects.
  template <class X>
  std::array<X, 3> reflection(const X& roughness, const Dielectric<X>& d, const X& tint,
                              bool compensate) const {
    const AlbedoTables& tables = AlbedoTables::get();
    const X f0 = d.normal * tint, rest = X(1) - f0;
    X reflected = f0 + rest * tables.rise(roughness, cos_i_, d.z);
    if (!compensate) return {f0, rest, reflected};
    const X e = tables.mirror(roughness, cos_i_), e_mean = tables.mirror_mean(roughness);
    const X rise_mean = fresnel_rise(fresnel_mean(d.eta), d.normal);
    const X factor = compensation(f0 + rest * rise_mean, e, e_mean);
    reflected = reflected * e * factor;
    return {f0 * factor, rest * factor, reflected};
  }

  /// Puts a reflection over `share` of the surface and takes from w what it reflects: the largest
  /// channel, so that grey stays grey. `interface(parameter)` makes the Dielectric.
  template <class Interface>
  Gloss<T> layer(const T& parameter, const Interface& interface, const Color<T>& tint,
                 const T& roughness, bool compensate, const T& share, T& w, S& albedo) const {
    const T weight = w * share;
    const Dielectric<T> d = interface(parameter);
    Gloss<T> gloss{.rise = DielectricRise<T>(d.excess)};
    T reflected(0);
    if (is_constant_grey(tint)) {
      const auto terms = narrow_all(roughness, parameter, [&](const auto& r, const auto& x) {
        using X = std::decay_t<decltype(r)>;
        return reflection<X>(r, interface(x), X(value_of(tint.r)), compensate);
      });
      gloss.flat = Color<T>(terms[0] * weight);
      gloss.risen = Color<T>(terms[1] * weight);
      reflected = terms[2];
    } else {
      for (int c = 0; c < 3; ++c) {
        const auto terms = reflection<T>(roughness, d, tint[c], compensate);
        gloss.flat[c] = terms[0] * weight;
        gloss.risen[c] = terms[1] * weight;
        if (!blocked_[c]) reflected = max(reflected, terms[2]);
      }
    }
    albedo = value_of(reflected) * value_of(weight);
    w = w * clamp01(T(1) - reflected * share);
    return gloss;
  }

  void add_sheen(const Principled<T>& m, const Color<T>& tint, const T& share,
                 const SurfacePoint<S>& point, T& w) {
    const Sheen<T> lobe(clamp01(m.sheen_roughness), point.n, point.wi);
    if (!lobe.exists()) return;
    const T reflected = lobe.albedo() * share;
    sheen = lobe;
    sheen_weight = tint * (reflected * w);
    w = w * clamp01(T(1) - max_channel(tint) * reflected);
    present[kSheen] = true;
    estimate_[kSheen] = value_of(mean_channel(sheen_weight));
    carries_slope_[kSheen] = has_slope(sheen_weight) || has_slope(m.sheen_roughness);
  }

  void add_coat(const Principled<T>& m, const T& coat_weight, T& w) {
    const T roughness = clamp01(m.coat_roughness);
    coat_width2 = square(square(roughness));
    const auto interface = [](const auto& n) {
      return Dielectric<std::decay_t<decltype(n)>>::from_ior(n);
    };
    coat = layer(max(m.coat_ior, T(1)), interface, Color<T>(T(1)), roughness, true, coat_weight, w,
                 estimate_[kCoat]);
    present[kCoat] = true;
    carries_slope_[kCoat] = has_slope(coat.flat) || has_slope(coat.risen) || has_slope(coat_width2);
  }

  /// What the coat lets through to the layers below, beside what it reflects.
  Color<T> below_coat(const Principled<T>& m, const T& coat_weight) const {
    if (!has_slope(m.coat_tint) && value_of(m.coat_tint.r) == 1 && value_of(m.coat_tint.g) == 1 &&
        value_of(m.coat_tint.b) == 1)
      return Color<T>(T(1));
    using std::sqrt;
    const T n = max(m.coat_ior, T(1));
    // Length of the refracted ray through a coat of thickness 1: 1 / cos_t, n cos_t = sqrt(e + c^2).
    const T path = n / sqrt((n - T(1)) * (n + T(1)) + T(cos_i_ * cos_i_));
    return map(m.coat_tint, [&](const T& t) {
      return T(1) - coat_weight + coat_weight * tint_power(nonnegative(t), path);
    });
  }

  void add_metal(const Principled<T>& m, const T& roughness, const T& weight) {
    metal = MetalFresnel<T>(base01(m), map(m.specular_tint, clamp01<T>));
    metal_weight = Color<T>(weight);
    if (compensate_) {
      const AlbedoTables& tables = AlbedoTables::get();
      const T e = tables.mirror(roughness, cos_i_), e_mean = tables.mirror_mean(roughness);
      metal_weight =
          map(metal.mean(), [&](const T& f) { return weight * compensation(f, e, e_mean); });
    }
    present[kMetal] = true;
    estimate_[kMetal] = value_of(weight) * value_of(mean_channel(metal.at(cos_i_)));
    carries_slope_[kMetal] = has_slope(metal_weight) || has_slope(metal.f0) ||
                             has_slope(metal.bump) || has_slope(width2);
  }

  void add_glass(const Principled<T>& m, const T& roughness, const T& eta_seen, const T& weight) {
    // Slope of the root of the base colour stops growing at 1e-6.
    const Color<T> tint = map(base01(m), [](const T& b) { return capped_root(b, S(1e-3)); });
    const auto d = Dielectric<T>::from_ior(eta_seen);
    const Color<T> f0 = map(m.specular_tint, [&](const T& t) { return clamp01(t) * d.normal; });
    eta = eta_seen;
    Color<T> lobe(weight);
    if (compensate_) {
      const AlbedoTables& tables = AlbedoTables::get();
      const bool thinner = value_of(eta) < 1;
      const T e = tables.glass(roughness, cos_i_, d.z, thinner);
      const T e_mean = tables.glass_mean(roughness, d.z, thinner);
      // Where nothing is transmitted, exactly black, Cycles takes the Fresnel mean of a reflection.
      // The parameter's slope there is that of the limit instead, so that it does not jump.
      const bool opaque = !has_slope(tint) && value_of(max_channel(tint)) == 0;
      const T rise_mean = opaque ? fresnel_rise(fresnel_mean(d.eta), d.normal) : T(0);
      const Color<T> mean = opaque ? f0 + (Color<T>(T(1)) - f0) * rise_mean : tint;
      lobe = map_tint(mean, [&](const T& f) { return weight * compensation(f, e, e_mean); });
    }
    glass = {f0 * lobe, (Color<T>(T(1)) - f0) * lobe, DielectricRise<T>(d.excess)};
    glass_through = tint * glass.risen;  // 1 - F' = (1 - f0) (1 - rise)
    glass_flat = mean_channel(value_of(f0));
    glass_tint = mean_channel(value_of(tint * (Color<T>(T(1)) - f0)));
    if (has_slope(f0)) glass_least = S(0.05);
    if (has_slope(tint)) glass_most = S(0.95);
    present[kGlass] = true;
    const S rise = glass.rise.value_at(cos_i_);
    estimate_[kGlass] =
        value_of(weight) * (glass_flat + (1 - glass_flat) * rise + glass_tint * (1 - rise));
    carries_slope_[kGlass] = has_slope(glass.flat) || has_slope(glass.risen) ||
                             has_slope(glass_through) || has_slope(eta) || has_slope(width2);
  }

  /// Interface whose reflectance at normal incidence is given; the far side may be the thinner one.
  template <class X>
  static Dielectric<X> of_reflectance(const X& reflectance, bool thinner) {
    const X x = capped_root(reflectance, kLeastAmplitude);
    auto d = Dielectric<X>::from_amplitude(thinner ? -x : x);
    d.normal = reflectance;
    if (value_of(x) < kLeastAmplitude && has_slope(reflectance)) {
      // The rise depends on x^2; its slope is worked out at the least x where that of x is finite.
      const X least = capped_root(with_value(reflectance, square(kLeastAmplitude)), S(0));
      d.excess = Dielectric<X>::from_amplitude(thinner ? -least : least).excess;
    }
    return d;
  }

  void add_specular(const Principled<T>& m, const T& roughness, const T& ior, T& w) {
    const T r = (ior - T(1)) / (ior + T(1));
    T reflectance = square(r) * (nonnegative(m.specular_level) * S(2));
    if (value_of(m.specular_level) != S(0.5)) reflectance = min(reflectance, T(S(0.99)));
    const bool thinner = value_of(ior) < 1;
    if (!skin_)
      entry_eta = value_of(m.specular_level) == S(0.5) && !has_slope(m.specular_level)
                      ? ior
                      : of_reflectance(reflectance, thinner).eta;
    if (value_of(reflectance) == 0 && !has_slope(reflectance)) return;
    const auto interface = [thinner](const auto& x) { return of_reflectance(x, thinner); };
    specular = layer(reflectance, interface, map_tint(m.specular_tint, nonnegative), roughness,
                     compensate_, T(1), w, estimate_[kSpecular]);
    present[kSpecular] = true;
    carries_slope_[kSpecular] = specular.has_slope() || has_slope(width2);
  }

  void add_diffuse(const Principled<T>& m, const T& w, const Color<T>& below,
                   const SurfacePoint<S>& point) {
    const Color<T> base = map(m.base_color, nonnegative);
    const T under = clamp01(m.subsurface_weight);
    diffuse = base * (w * (T(1) - under));
    if (matters(w * under)) add_subsurface(m, w * under, point.after_diffuse);
    const S cos_diffuse = dot(point.n, point.wi);
    const T roughness = clamp01(m.diffuse_roughness);
    if (!matters(diffuse * below) && !has_slope(roughness)) return;
    if (matters(roughness)) rough_diffuse.emplace(roughness, base, cos_diffuse);
    present[kDiffuse] = true;
    estimate_[kDiffuse] = value_of(mean_channel(diffuse));
    carries_slope_[kDiffuse] = has_slope(diffuse) || has_slope(roughness);
  }

  /// The channels that scatter under the surface; the others, and all of them after a diffuse
  /// scattering, are reflected diffusely. `subsurface` is the lobe's weight without its colour.
  void add_subsurface(const Principled<T>& m, const T& weight, bool after_diffuse) {
    const Color<T> base = base01(m);
    for (int c = 0; c < 3; ++c) {
      if (after_diffuse || !scatters_under(m, c))
        diffuse[c] += base[c] * weight;
      else
        subsurface[c] = weight;
    }
    if (!matters(subsurface)) return;
    if (skin_) entry_eta = m.subsurface_ior;
    entry_eta = clamp(entry_eta, S(1.01), S(3.8));
    entry_width2 = skin_ ? T(1) : width2;
    present[kSubsurface] = true;
    estimate_[kSubsurface] = mean_channel(value_of(subsurface * base));
    carries_slope_[kSubsurface] = true;
  }

  /// Probabilities proportional to what each lobe is likely to reflect; detached from the parameters.
  void choose() {
    S total = 0;
    for (int k = 0; k < kLobes; ++k) total += estimate_[k];
    const S least = total > 0 ? kSlopeShare * total : S(1);
    S sum = 0;
    for (int k = 0; k < kLobes; ++k) {
      if (present[k]) pick[k] = carries_slope_[k] ? max(estimate_[k], least) : estimate_[k];
      sum += pick[k];
    }
    if (sum > 0)
      for (S& p : pick) p /= sum;
  }

  static constexpr S kLeastAmplitude = S(1e-4);

  S cos_i_;
  bool compensate_, skin_;
  /// Channels that do not get through the coat at all; Cycles leaves them out of what darkens the
  /// layers below. A tint with a derivative is treated as its limit, so that it does not jump.
  std::array<bool, 3> blocked_{};
  std::array<S, kLobes> estimate_{};
  std::array<bool, kLobes> carries_slope_{};
};

}  // namespace selenite

#include "model/layers_v1.h"
