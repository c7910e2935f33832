// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include "model/albedo_tables.h"
#include "model/diffuse.h"
#include "model/fresnel.h"
#include "model/ggx.h"
#include "model/principled.h"

namespace selenite {

/// Lobes in the order in which one is drawn.
enum Lobe { kDiffuse, kSpecular, kMetal, kGlass, kCoat, kLobes };

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

/// base^exponent for base >= 0, exponent >= 1.
template <class T>
T tint_power(const T& base, const T& exponent) {
  using S = scalar_t<T>;
  const S b = value_of(base), e = value_of(exponent), v = std::pow(b, e);
  if constexpr (std::is_same_v<T, S>) {
    return v;
  } else {
    return chain(base, v, e * std::pow(b, e - 1)) +
           chain(exponent, S(0), b > 0 ? v * std::log(b) : S(0));
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

/// Reflectance flat + risen * rise(c) of a tinted dielectric, weight of the lobe included.
template <class T>
struct Gloss {
  Color<T> flat{}, risen{};
  T excess{};

  Color<T> at(const T& rise) const { return flat + risen * rise; }
};

/// Weights of all lobes for one shading point and viewer direction, from top to bottom: transparency,
/// coat, emission, metal, glass, dielectric specular, diffuse. Constant over the light direction.
template <class T>
struct Layers {
  using S = scalar_t<T>;

  std::array<bool, kLobes> present{};
  std::array<S, kLobes> pick{};  ///< probabilities of drawing a lobe; sum 1, or all 0
  T width2{}, coat_width2{};     ///< squared GGX widths
  Gloss<T> specular, glass, coat;
  MetalFresnel<T> metal;
  Color<T> metal_weight{}, glass_through{}, diffuse{}, emission{}, transparency{};
  std::optional<OrenNayar<T>> rough_diffuse;
  T eta{1};  ///< index of refraction of the far side over the viewer's side, for glass
  /// Reflected and refracted share of white glass; for the choice between the two.
  S glass_flat = 0, glass_tint = 0, glass_least = 0, glass_most = 1;

  /// cos_i: viewer's cosine to the bent normal of the specular lobes, > 0; cos_diffuse: to the
  /// shading normal.
  Layers(const Principled<T>& m, const Flavour& flavour, bool backfacing, S cos_i, S cos_diffuse)
      : cos_i_(cos_i), compensate_(flavour.distribution == Flavour::Distribution::kMultiGgx) {
    const T alpha = clamp01(m.alpha);
    transparency = Color<T>(T(1) - alpha);
    T w = alpha;  // what the layers above let through, one number for all channels

    const T roughness = clamp01(m.roughness);
    width2 = square(square(roughness));
    const T coat_weight = nonnegative(m.coat_weight);
    if (matters(w * coat_weight)) add_coat(m, coat_weight, w);
    emission = m.emission_color * (m.emission_strength * w);

    const T metallic = clamp01(m.metallic);
    if (matters(w * metallic)) add_metal(m, roughness, w * metallic);
    w = w * (T(1) - metallic);

    const T ior = max(m.ior, T(S(1e-5)));
    const T transmission = clamp01(m.transmission);
    if (matters(w * transmission))
      add_glass(m, roughness, backfacing ? T(1) / ior : ior, w * transmission);
    w = w * (T(1) - transmission);

    if (matters(w)) {
      add_specular(m, roughness, ior, w);
      add_diffuse(m, w, cos_diffuse);
    }
    if (present[kCoat]) tint_below_coat(m, coat_weight);
    choose();
  }

 private:
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
  static Color<T> base01(const Principled<T>& m) {
    return map(m.base_color, clamp01<T>);
  }

  /// Applies a per-channel function; once only if the channels are equal constants.
  template <class F>
  static Color<T> map_tint(const Color<T>& c, F&& f) {
    if (!has_slope(c) && value_of(c.r) == value_of(c.g) && value_of(c.g) == value_of(c.b))
      return Color<T>(f(c.r));
    return map(c, f);
  }

  /// Factor by which a lobe with single-scattering albedo e (mean e_mean over the hemisphere) and mean
  /// Fresnel reflectance f has to be scaled to account for the light it scatters more than once.
  static T compensation(const T& f, const T& e, const T& e_mean) {
    const T rescattered = f * e_mean / (T(1) - f * (T(1) - e_mean));
    return T(1) + rescattered * (T(1) - e) / e;
  }

  /// A GGX reflection under `d` whose reflectance at normal incidence is tinted. Returns its weighted
  /// Fresnel terms (it covers `share` of the surface) and takes from w what it reflects: the largest
  /// channel, so that grey stays grey.
  Gloss<T> dielectric_layer(const Dielectric<T>& d, const Color<T>& tint, const T& roughness,
                            bool compensate, const T& share, T& w, S& albedo) const {
    const AlbedoTables& tables = AlbedoTables::get();
    const T risen = tables.rise(roughness, cos_i_, d.z);
    const T e = compensate ? tables.mirror(roughness, cos_i_) : T(1);
    const T e_mean = compensate ? tables.mirror_mean(roughness) : T(1);
    const T rise_mean = compensate ? fresnel_rise(fresnel_mean(d.eta), d.normal) : T(0);
    Gloss<T> gloss{.excess = d.excess};
    const Color<T> factor = map_tint(tint, [&](const T& t) {
      const T f0 = t * d.normal;
      return compensate ? compensation(f0 + (T(1) - f0) * rise_mean, e, e_mean) : T(1);
    });
    const Color<T> f0 = map_tint(tint, [&](const T& t) { return t * d.normal; });
    T reflected = max_channel(factor * (f0 + (Color<T>(T(1)) - f0) * risen));
    if (compensate) reflected = reflected * e;
    const T weight = w * share;
    gloss.flat = f0 * factor * weight;
    gloss.risen = (Color<T>(T(1)) - f0) * factor * weight;
    albedo = value_of(reflected) * value_of(weight);
    w = w * clamp01(T(1) - reflected * share);
    return gloss;
  }

  void add_coat(const Principled<T>& m, const T& coat_weight, T& w) {
    const T roughness = clamp01(m.coat_roughness);
    coat_width2 = square(square(roughness));
    const auto d = Dielectric<T>::from_ior(max(m.coat_ior, T(1)));
    coat = dielectric_layer(d, Color<T>(T(1)), roughness, true, coat_weight, w, estimate_[kCoat]);
    present[kCoat] = true;
    carries_slope_[kCoat] = has_slope(coat.flat) || has_slope(coat.risen) ||
                            has_slope(coat_width2);
  }

  void tint_below_coat(const Principled<T>& m, const T& coat_weight) {
    if (!has_slope(m.coat_tint) && value_of(m.coat_tint.r) == 1 && value_of(m.coat_tint.g) == 1 &&
        value_of(m.coat_tint.b) == 1)
      return;
    using std::sqrt;
    const T n = max(m.coat_ior, T(1));
    // Length of the refracted ray through a coat of thickness 1: 1 / cos_t, n cos_t = sqrt(e + c^2).
    const T path = n / sqrt((n - T(1)) * (n + T(1)) + T(cos_i_ * cos_i_));
    const Color<T> below = map(m.coat_tint, [&](const T& t) {
      return T(1) - coat_weight + coat_weight * tint_power(nonnegative(t), path);
    });
    for (Color<T>* c : {&emission, &metal_weight, &glass.flat, &glass.risen, &glass_through,
                        &specular.flat, &specular.risen, &diffuse})
      *c *= below;
  }

  void add_metal(const Principled<T>& m, const T& roughness, const T& weight) {
    metal = MetalFresnel<T>(base01(m), map(m.specular_tint, clamp01<T>));
    metal_weight = Color<T>(weight);
    if (compensate_) {
      const AlbedoTables& tables = AlbedoTables::get();
      const T e = tables.mirror(roughness, cos_i_), e_mean = tables.mirror_mean(roughness);
      metal_weight = map(metal.mean(), [&](const T& f) {
        return weight * compensation(f, e, e_mean);
      });
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
      lobe = map_tint(tint, [&](const T& t) { return weight * compensation(t, e, e_mean); });
    }
    glass = {f0 * lobe, (Color<T>(T(1)) - f0) * lobe, d.excess};
    glass_through = tint * glass.risen;  // 1 - F' = (1 - f0) (1 - rise)
    glass_flat = mean_channel(value_of(f0));
    glass_tint = mean_channel(value_of(tint * (Color<T>(T(1)) - f0)));
    if (has_slope(f0)) glass_least = S(0.05);
    if (has_slope(tint)) glass_most = S(0.95);
    present[kGlass] = true;
    const S rise = value_of(dielectric_rise(T(cos_i_), d.excess));
    estimate_[kGlass] = value_of(weight) * (glass_flat + (1 - glass_flat) * rise +
                                            glass_tint * (1 - rise));
    carries_slope_[kGlass] = has_slope(glass.flat) || has_slope(glass.risen) ||
                             has_slope(glass_through) || has_slope(eta) || has_slope(width2);
  }

  void add_specular(const Principled<T>& m, const T& roughness, const T& ior, T& w) {
    const T r = (ior - T(1)) / (ior + T(1));
    T reflectance = square(r) * (nonnegative(m.specular_level) * S(2));
    if (value_of(m.specular_level) != S(0.5)) reflectance = min(reflectance, T(S(0.99)));
    if (value_of(reflectance) == 0 && !has_slope(reflectance)) return;
    const T x = capped_root(reflectance, kLeastAmplitude);
    auto d = Dielectric<T>::from_amplitude(value_of(ior) < 1 ? -x : x);
    d.normal = reflectance;
    if (value_of(x) < kLeastAmplitude && has_slope(reflectance)) {
      // The rise depends on x^2; its slope is worked out at the least x where that of x is finite.
      const T least = capped_root(with_value(reflectance, square(kLeastAmplitude)), S(0));
      d.excess = Dielectric<T>::from_amplitude(value_of(ior) < 1 ? -least : least).excess;
    }
    const Color<T> tint = map_tint(m.specular_tint, nonnegative);
    specular = dielectric_layer(d, tint, roughness, compensate_, T(1), w, estimate_[kSpecular]);
    present[kSpecular] = true;
    carries_slope_[kSpecular] = has_slope(specular.flat) || has_slope(specular.risen) ||
                                has_slope(d.excess) || has_slope(width2);
  }

  void add_diffuse(const Principled<T>& m, const T& w, S cos_diffuse) {
    const Color<T> base = map(m.base_color, nonnegative);
    diffuse = base * w;
    const T roughness = clamp01(m.diffuse_roughness);
    if (!matters(diffuse) && !has_slope(roughness)) return;
    if (matters(roughness)) rough_diffuse.emplace(roughness, base, cos_diffuse);
    present[kDiffuse] = true;
    estimate_[kDiffuse] = value_of(mean_channel(diffuse));
    carries_slope_[kDiffuse] = has_slope(diffuse) || has_slope(roughness);
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
  bool compensate_;
  std::array<S, kLobes> estimate_{};
  std::array<bool, kLobes> carries_slope_{};
};

}  // namespace selenite
