// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <optional>

#include "model/active_lanes.h"
#include "model/dielectric.h"
#include "model/diffuse.h"
#include "model/fresnel.h"
#include "model/layer_weights.h"
#include "model/micronormals.h"
#include "model/principled.h"
#include "model/shading_normal.h"
#include "model/subsurface.h"
#include "model/tables/albedo_tables.h"

namespace selenite {

/// Works out the weights of a material's layers.
template <class T>
struct Layers : LayerWeights<T> {
  using Weights = LayerWeights<T>;
  using typename Weights::R, typename Weights::S, typename Weights::U;
  using Weights::bare_refraction, Weights::coat, Weights::coat_width2, Weights::diffuse,
      Weights::emission, Weights::entry_eta, Weights::entry_width2, Weights::eta, Weights::glass,
      Weights::glass_film, Weights::glass_flat, Weights::glass_least, Weights::glass_most,
      Weights::glass_through, Weights::glass_tint, Weights::macro_reflected, Weights::metal,
      Weights::metal_weight, Weights::pick, Weights::present, Weights::retro_roughness,
      Weights::rough_diffuse, Weights::specular, Weights::specular_film, Weights::subsurface,
      Weights::through_width2, Weights::top, Weights::top_weight, Weights::transparency,
      Weights::version1, Weights::width2;

  /// cos_n: viewer's cosine to the bent normal of the specular lobes. active: the lanes that decide
  /// whether a lobe is there.
  Layers(const Principled<U>& m, const Flavour& flavour, const SurfacePoint<S>& point, S cos_n,
         const mask_t<S>& active, const U& anisotropy = U(0), const ThinFilm<U>& film = {})
      : cos_i_(lobe_cosine(cos_n)),
        cos_slant_(lobe_cosine(abs_of(cos_n))),
        active_(active),
        compensate_(flavour.distribution == Flavour::Distribution::kMultiGgx),
        skin_(flavour.subsurface == Flavour::Subsurface::kRandomWalkSkin),
        blender5_(flavour.blender5) {
    version1 = flavour.version == Flavour::Version::kV1;
    const U alpha = clamp01(m.alpha);
    transparency = Color<U>(U(1) - alpha);
    const U roughness = clamp01(m.roughness);
    width2 = through_width2 = square(square(roughness));
    if constexpr (!kIsLanes<S>) {
      mirror_roughness_ = this->stretch_by(roughness, anisotropy);
      if (this->stretched) width2 = square(square(mirror_roughness_));
      filmed_ = is_there(film);
      film_ = film;
    }
    if (version1) {
      stack_version1(m, alpha, point.backfacing);
    } else {
      stack(m, alpha, point);
    }
    if (flavour.draws_reflections && !point.backfacing) {
      glass_least = R(0.95);
      macro_reflected = max(macro_reflected, S(0.95));
    }
    choose();
  }

  /// What the lobes are likely to reflect and transmit, all together.
  S scattered() const {
    S total = 0;
    for (const S& lobe : estimate_) total += lobe;
    return total;
  }
  /// Whether one of them carries a derivative.
  bool carries_slope() const {
    return std::find(carries_slope_.begin(), carries_slope_.end(), true) != carries_slope_.end();
  }

 protected:
  /// Without lobes: closure_layers.h adds those of other closures.
  Layers(const Flavour& flavour, S cos_n) requires(!kIsLanes<T>)
      : cos_i_(lobe_cosine(cos_n)),
        cos_slant_(lobe_cosine(abs_of(cos_n))),
        active_(true),
        compensate_(flavour.distribution == Flavour::Distribution::kMultiGgx),
        skin_(flavour.subsurface == Flavour::Subsurface::kRandomWalkSkin),
        blender5_(flavour.blender5) {
    using Distribution = Flavour::Distribution;
    if (flavour.distribution == Distribution::kBeckmann)
      this->micronormals = Micronormals::kBeckmann;
    if (flavour.distribution == Distribution::kAshikhminShirley)
      this->micronormals = Micronormals::kAshikhminShirley;
  }

  void stack(const Principled<U>& m, const U& alpha, const SurfacePoint<S>& point) {
    T w = alpha;  // what the layers above let through, one number for all channels
    const U roughness = clamp01(m.roughness);
    for_each_top_lobe(top, [&](int i, auto& lobe) { add_top_lobe(i, lobe, m, point, w); });
    const U coat_weight = nonnegative(m.coat_weight);
    if (matters(w * coat_weight)) add_coat(m, coat_weight, w);
    const Color<T> below = present[kCoat] ? below_coat(m, coat_weight) : Color<T>(T(1));
    for (int c = 0; c < 3; ++c)
      blocked_[c] = !active_.some(value_of(below[c]) != S(0)) && !active_.move(below[c]);
    if (matters(m.emission_strength)) emission = m.emission_color * (m.emission_strength * w);

    const U& mirrored = *[&] {
      if constexpr (kIsLanes<S>)
        return &roughness;
      else
        return &mirror_roughness_;
    }();
    const U metallic = clamp01(m.metallic);
    if (matters(below * (w * metallic))) add_metal(m, mirrored, w * metallic);
    w = w * (U(1) - metallic);

    const U ior = max(m.ior, U(R(1e-5)));
    const U transmission = clamp01(m.transmission);
    if (matters(below * (w * transmission)))
      add_glass(m, roughness, ior, point.backfacing, w * transmission);
    w = w * (U(1) - transmission);

    if (matters(below * w)) {
      add_specular(m, mirrored, ior, w);
      add_diffuse(m, w, below, point);
    }
    if (!present[kCoat]) return;
    for (Color<T>* c : {&emission, &metal_weight, &glass.flat, &glass.risen, &glass_through,
                        &specular.flat, &specular.risen, &diffuse, &subsurface})
      *c *= below;
  }
  void stack_version1(const Principled<U>& m, const U& alpha, bool backfacing);  // layers_v1.h

  // Cycles leaves out lobes below this weight; here only if no derivative would be lost.
  static constexpr R kLeastWeight = R(1e-5);
  // Share of the samples given to a lobe that carries derivatives, however dark it is.
  static constexpr R kSlopeShare = R(0.1);

  /// Cosines are those of micronormals from this on: no lobe of them is seen from behind.
  static S lobe_cosine(const S& cos_n) { return clamp(cos_n, S(1e-7), S(1)); }
  static S abs_of(const S& x) {
    using std::abs;
    return abs(x);
  }
  static U nonnegative(const U& x) { return max(x, U(0)); }
  template <class X>
  bool matters(const X& weight) const {
    if constexpr (requires { weight.r; }) {
      return active_.some(value_of(mean_channel(weight)) >= kLeastWeight) || active_.move(weight);
    } else {
      return active_.some(value_of(weight) >= kLeastWeight) || active_.move(weight);
    }
  }
  bool moves(const Gloss<T>& g) const {
    return active_.move(g.flat) || active_.move(g.risen) || has_slope(g.rise.excess());
  }
  static Color<U> base01(const Principled<U>& m) { return map(m.base_color, clamp01<U>); }

  /// Applies a per-channel function; once only if the channels are equal constants.
  template <class F>
  static auto map_tint(const Color<U>& c, F&& f) {
    using X = decltype(f(c.r));
    return is_constant_grey(c) ? Color<X>(f(c.r)) : map(c, f);
  }
  static bool is_constant_grey(const Color<U>& c) {
    return !has_slope(c) && value_of(c.r) == value_of(c.g) && value_of(c.g) == value_of(c.b);
  }

  /// Factor by which a lobe with single-scattering albedo e (mean e_mean over the hemisphere) and mean
  /// Fresnel reflectance f has to be scaled to account for the light it scatters more than once.
  template <class X, class E>
  static E compensation(const X& f, const E& e, const X& e_mean) {
    const X rescattered = f * e_mean / (X(1) - f * (X(1) - e_mean));
    return E(1) + rescattered * (E(1) - e) / e;
  }

  /// Fresnel terms of a GGX reflection under an interface of relative tint `tint` (flat and risen, see
  /// Gloss), and the share of light that it reflects.
  template <class X>
  auto reflection(const X& roughness, const Dielectric<X>& d, const X& tint,
                  bool compensate) const {
    using Y = decltype(roughness * cos_i_);
    using Terms = std::array<Y, 3>;
    const AlbedoTables& tables = AlbedoTables::get();
    const X f0 = d.normal * tint, rest = X(1) - f0;
    Y reflected = f0 + rest * tables.rise(roughness, cos_i_, d.z);
    if (!compensate) return Terms{f0, rest, reflected};
    const Y e = tables.mirror(roughness, cos_i_);
    const X e_mean = tables.mirror_mean(roughness);
    const X rise_mean = fresnel_rise(fresnel_mean(d.eta), d.normal);
    const Y factor = compensation(X(f0 + rest * rise_mean), e, e_mean);
    reflected = reflected * e * factor;
    return Terms{f0 * factor, rest * factor, reflected};
  }

  /// Puts a reflection over `share` of the surface and takes from w what it reflects: the largest
  /// channel, so that grey stays grey. `interface(parameter)` makes the Dielectric.
  template <class Interface>
  Gloss<T> layer(const U& parameter, const Interface& interface, const Color<U>& tint,
                 const U& roughness, bool compensate, const U& share, T& w, S& albedo) const {
    const T weight = w * share;
    const Dielectric<U> d = interface(parameter);
    Gloss<T> gloss{.rise = DielectricRise<U>(d.excess)};
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
        const auto terms = reflection<U>(roughness, d, tint[c], compensate);
        gloss.flat[c] = terms[0] * weight;
        gloss.risen[c] = terms[1] * weight;
        if (!blocked_[c]) reflected = max(reflected, terms[2]);
      }
    }
    albedo = value_of(reflected) * value_of(weight);
    w = w * clamp01(T(1) - reflected * share);
    return gloss;
  }

  template <class TopLobe>
  void add_top_lobe(int i, TopLobe& lobe, const Principled<T>& m, const SurfacePoint<S>& point,
                    T& w) {
    const T share = nonnegative(TopLobe::share(m));
    const Color<T> tint = map(TopLobe::tint(m), nonnegative);
    if (!matters(tint * (w * share))) return;
    const TopLobe found(m, point);
    if (!found.exists()) return;
    const T reflected = found.albedo() * share;
    lobe = found;
    Color<T>& weight = top_weight[i];
    weight = tint * (reflected * w);
    w = w * clamp01(T(1) - max_channel(tint) * reflected);
    present[kFirstTopLobe + i] = true;
    estimate_[kFirstTopLobe + i] = value_of(mean_channel(weight));
    carries_slope_[kFirstTopLobe + i] = has_slope(weight) || TopLobe::shape_moves(m);
  }

  void add_coat(const Principled<U>& m, const U& coat_weight, T& w) {
    const U roughness = clamp01(m.coat_roughness);
    coat_width2 = square(square(roughness));
    const auto interface = [](const auto& n) {
      return Dielectric<std::decay_t<decltype(n)>>::from_ior(n);
    };
    coat = layer(max(m.coat_ior, U(1)), interface, Color<U>(U(1)), roughness, true, coat_weight, w,
                 estimate_[kCoat]);
    present[kCoat] = true;
    carries_slope_[kCoat] = moves(coat) || has_slope(coat_width2);
  }

  /// What the coat lets through to the layers below, beside what it reflects.
  Color<T> below_coat(const Principled<U>& m, const U& coat_weight) const {
    if (!has_slope(m.coat_tint) && value_of(m.coat_tint.r) == 1 && value_of(m.coat_tint.g) == 1 &&
        value_of(m.coat_tint.b) == 1)
      return Color<T>(T(1));
    using std::sqrt;
    const U n = max(m.coat_ior, U(1));
    // Length of the refracted ray through a coat of thickness 1: 1 / cos_t, n cos_t = sqrt(e + c^2).
    const T path = n / sqrt((n - U(1)) * (n + U(1)) + T(cos_slant_ * cos_slant_));
    return map(m.coat_tint, [&](const U& t) -> T {
      return U(1) - coat_weight + coat_weight * tint_power(nonnegative(t), path);
    });
  }

  void add_metal(const Principled<U>& m, const U& roughness, const T& weight) {
    metal = MetalFresnel<U>(base01(m), map(m.specular_tint, clamp01<U>));
    metal_weight = Color<T>(weight);
    if (compensate_) {
      const AlbedoTables& tables = AlbedoTables::get();
      const T e = tables.mirror(roughness, cos_i_);
      const U e_mean = tables.mirror_mean(roughness);
      metal_weight =
          map(metal.mean(), [&](const U& f) { return weight * compensation(f, e, e_mean); });
    }
    present[kMetal] = true;
    carries_slope_[kMetal] = active_.move(metal_weight) || has_slope(metal.f0) ||
                             has_slope(metal.bump) || has_slope(width2) || this->stretch_moves();
    if constexpr (!kIsLanes<S>)
      if (filmed_ && blender5_) {
        this->metal_film.emplace(film_, metal);
        estimate_[kMetal] = value_of(mean_channel(this->metal_film->at(cos_i_)));
        estimate_[kMetal] *= value_of(weight);
        if (this->metal_film->moves()) carries_slope_[kMetal] = true;
        return;
      }
    estimate_[kMetal] = value_of(weight) * value_of(mean_channel(metal.at(cos_i_)));
  }

  void add_glass(const Principled<U>& m, const U& roughness, const U& ior, bool backfacing,
                 const T& weight) {
    // Slope of the root of the base colour stops growing at 1e-6.
    const Color<U> tint = map(base01(m), [](const U& b) { return capped_root(b, R(1e-3)); });
    eta = backfacing ? U(1) / ior : ior;
    const auto d = Dielectric<U>::from_ior(eta);
    const Color<U> f0 = map(m.specular_tint, [&](const U& t) { return clamp01(t) * d.normal; });
    Color<T> lobe(weight);
    if (compensate_) {
      const AlbedoTables& tables = AlbedoTables::get();
      const bool thinner = value_of(eta) < 1;
      const T e = tables.glass(roughness, cos_i_, d.z, thinner);
      const U e_mean = tables.glass_mean(roughness, d.z, thinner);
      // Where nothing is transmitted, exactly black, Cycles takes the Fresnel mean of a reflection.
      // The parameter's slope there is that of the limit instead, so that it does not jump.
      const bool opaque = !has_slope(tint) && value_of(max_channel(tint)) == 0;
      const U rise_mean = opaque ? fresnel_rise(fresnel_mean(d.eta), d.normal) : U(0);
      const Color<U> mean = opaque ? f0 + (Color<U>(U(1)) - f0) * rise_mean : tint;
      lobe = map_tint(mean, [&](const U& f) { return weight * compensation(f, e, e_mean); });
    }
    glass = {f0 * lobe, (Color<U>(U(1)) - f0) * lobe, DielectricRise<U>(d.excess)};
    glass_through = tint * glass.risen;  // 1 - F' = (1 - f0) (1 - rise)
    glass_flat = mean_channel(value_of(f0));
    glass_tint = mean_channel(value_of(tint * (Color<U>(U(1)) - f0)));
    if (has_slope(f0)) glass_least = R(0.05);
    if (has_slope(tint)) glass_most = R(0.95);
    if constexpr (!kIsLanes<S>) {
      if (filmed_) film_glass(film_, backfacing, d.normal, tint);
    }
    present[kGlass] = true;
    const S rise = glass.rise.value_at(cos_i_);
    estimate_[kGlass] =
        value_of(weight) * (glass_flat + (1 - glass_flat) * rise + glass_tint * (1 - rise));
    carries_slope_[kGlass] =
        moves(glass) || active_.move(glass_through) || has_slope(eta) || has_slope(width2);
    if constexpr (!kIsLanes<S>)
      if (glass_film && glass_film->moves()) carries_slope_[kGlass] = true;
  }

  /// Puts a film on glass, between its inside and the viewer's side of it.
  void film_glass(const ThinFilm<T>& film, bool backfacing, const T& normal,
                  const Color<T>& tint) requires(!kIsLanes<T>) {
    const ThinFilm<T> seen{film.thickness, backfacing ? film.index() * eta : film.index()};
    glass_film.emplace(seen, blender5_, eta, normal, tint);
    glass_least = max(glass_least, R(0.05)), glass_most = min(glass_most, R(0.95));
  }

  /// Interface whose reflectance at normal incidence is given; the far side may be the thinner one.
  template <class X>
  static Dielectric<X> of_reflectance(const X& reflectance, bool thinner) {
    const X x = capped_root(reflectance, kLeastAmplitude);
    auto d = Dielectric<X>::from_amplitude(thinner ? -x : x);
    d.normal = reflectance;
    if (value_of(x) < kLeastAmplitude && has_slope(reflectance)) {
      // The rise depends on x^2; its slope is worked out at the least x where that of x is finite.
      const X least = capped_root(with_value(reflectance, square(kLeastAmplitude)), R(0));
      d.excess = Dielectric<X>::from_amplitude(thinner ? -least : least).excess;
    }
    return d;
  }

  void add_specular(const Principled<U>& m, const U& roughness, const U& ior, T& w) {
    const U r = (ior - U(1)) / (ior + U(1));
    U reflectance = square(r) * (nonnegative(m.specular_level) * R(2));
    if (value_of(m.specular_level) != R(0.5)) reflectance = min(reflectance, U(R(0.99)));
    const bool thinner = value_of(ior) < 1;
    if (!skin_)
      entry_eta = value_of(m.specular_level) == R(0.5) && !has_slope(m.specular_level)
                      ? ior
                      : of_reflectance(reflectance, thinner).eta;
    if constexpr (!kIsLanes<S>)
      if (filmed_)
        return add_filmed_specular(m, roughness, of_reflectance(reflectance, thinner), w);
    if (value_of(reflectance) == 0 && !has_slope(reflectance)) return;
    const auto interface = [thinner](const auto& x) { return of_reflectance(x, thinner); };
    specular = layer(reflectance, interface, map_tint(m.specular_tint, nonnegative), roughness,
                     compensate_, U(1), w, estimate_[kSpecular]);
    present[kSpecular] = true;
    carries_slope_[kSpecular] = moves(specular) || has_slope(width2) || this->stretch_moves();
  }

  /// Takes from w what the film reflects at the viewer's cosine, not at the micronormals, as Cycles.
  void add_filmed_specular(const Principled<T>& m, const T& roughness, const Dielectric<T>& d,
                           T& w) requires(!kIsLanes<T>) {
    specular_film.emplace(film_, blender5_, d.eta, d.normal);
    specular.rise = DielectricRise<T>(d.excess);
    for (int c = 0; c < 3; ++c) {
      const auto terms = reflection<T>(roughness, d, nonnegative(m.specular_tint[c]), compensate_);
      specular.flat[c] = terms[0];
      specular.risen[c] = terms[1];
    }
    Color<T> seen = specular_film->reflect(specular, T(cos_slant_));
    if (compensate_) seen = seen * AlbedoTables::get().mirror(roughness, cos_i_);
    T reflected(0);
    for (int c = 0; c < 3; ++c)
      if (!blocked_[c]) reflected = max(reflected, seen[c]);
    specular.flat = specular.flat * w;
    specular.risen = specular.risen * w;
    estimate_[kSpecular] = value_of(reflected) * value_of(w);
    w = w * clamp01(T(1) - reflected);
    present[kSpecular] = true;
    carries_slope_[kSpecular] =
        moves(specular) || specular_film->moves() || has_slope(width2) || this->stretch_moves();
  }

  void add_diffuse(const Principled<U>& m, const T& w, const Color<T>& below,
                   const SurfacePoint<S>& point) {
    const Color<U> base = map(m.base_color, nonnegative);
    const U under = clamp01(m.subsurface_weight);
    diffuse = base * (w * (U(1) - under));
    if constexpr (!kIsLanes<S>)
      if (matters(w * under)) add_subsurface(m, w * under, point.after_diffuse);
    const S cos_diffuse = dot(point.n, point.wi);
    const U roughness = clamp01(m.diffuse_roughness);
    if (!matters(diffuse * below) && !has_slope(roughness)) return;
    if (matters(roughness)) rough_diffuse.emplace(roughness, base, cos_diffuse);
    present[kDiffuse] = true;
    estimate_[kDiffuse] = value_of(mean_channel(diffuse));
    carries_slope_[kDiffuse] = active_.move(diffuse) || has_slope(roughness);
  }

  /// The channels that scatter under the surface; the others, and before Blender 5 all of them after a
  /// diffuse scattering, are reflected diffusely. `subsurface` is the lobe's weight without its colour.
  void add_subsurface(const Principled<U>& m, const T& weight,
                      bool after_diffuse) requires(!kIsLanes<T>) {
    const Color<T> base = base01(m);
    for (int c = 0; c < 3; ++c) {
      if ((after_diffuse && !blender5_) || !scatters_under(m, c))
        diffuse[c] += base[c] * weight;
      else
        subsurface[c] = weight;
    }
    if (!matters(subsurface)) return;
    if (skin_) entry_eta = m.subsurface_ior;
    entry_eta = clamp(entry_eta, S(1.01), S(3.8));
    entry_width2 = skin_ ? T(1) : through_width2;
    present[kSubsurface] = true;
    estimate_[kSubsurface] = mean_channel(value_of(subsurface * base));
    carries_slope_[kSubsurface] = true;
  }

  /// Probabilities proportional to what each lobe is likely to reflect; detached from the parameters.
  void choose() {
    S total = 0;
    for (int k = 0; k < kLobes; ++k) total += estimate_[k];
    const S least = select(total > S(0), S(kSlopeShare * total), S(1));
    S sum = 0;
    for (int k = 0; k < kLobes; ++k) {
      if (present[k]) pick[k] = carries_slope_[k] ? max(estimate_[k], least) : estimate_[k];
      sum += pick[k];
    }
    if (const mask_t<S> some = sum > S(0); any(some))
      for (int k = 0; k < kLobes; ++k)
        if (present[k]) pick[k] = select(some, S(pick[k] / sum), pick[k]);
  }

  static constexpr R kLeastAmplitude = R(1e-4);

  S cos_i_;      ///< as lobes see it
  S cos_slant_;  ///< of the ray alone, also where the bent normal faces away from the viewer
  ActiveLanes<S> active_;
  bool compensate_, skin_, blender5_;
  /// Of metal and the specular lobe.
  std::conditional_t<kIsLanes<S>, std::tuple<>, T> mirror_roughness_{};
  bool filmed_ = false;
  std::conditional_t<kIsLanes<S>, std::tuple<>, ThinFilm<T>> film_{};
  /// Channels that do not get through the coat at all; Cycles leaves them out of what darkens the
  /// layers below. A tint with a derivative is treated as its limit, so that it does not jump.
  std::array<bool, 3> blocked_{};
  std::array<S, kLobes> estimate_{};
  std::array<bool, kLobes> carries_slope_{};
};

}  // namespace selenite

#include "model/layers_v1.h"
