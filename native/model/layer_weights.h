// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <optional>
#include <tuple>
#include <type_traits>

#include "model/dielectric.h"
#include "model/diffuse.h"
#include "model/fresnel.h"
#include "model/micronormals.h"
#include "model/narrow.h"
#include "model/ray_kind.h"
#include "model/thin_film.h"
#include "model/top_lobes.h"

namespace selenite {

/// Lobes in the order in which one is drawn; those of `TopLobes` follow.
enum Lobe { kDiffuse, kSubsurface, kSpecular, kMetal, kGlass, kCoat, kFirstTopLobe };
inline constexpr int kLobes = kFirstTopLobe + kTopLobes;

/// Weights of all lobes for one shading point and viewer direction, from top to bottom: transparency,
/// sheen, coat, emission, metal, glass, dielectric specular, subsurface, diffuse. Constant over the
/// light direction.
///
/// Lanes meet one material, all on the same side: what follows from its parameters alone is a number
/// of type U for all of them, and a lobe is there for all or for none. What the viewer's cosine changes
/// differs from lane to lane. Sheen and subsurface scattering are left out in lanes.
template <class T>
struct LayerWeights {
  using S = scalar_t<T>;
  using U = uniform_t<T>;
  using R = number_t<T>;

  std::array<bool, kLobes> present{};
  std::array<S, kLobes> pick{};  ///< probabilities of drawing a lobe; sum 1, or all 0
  U width2{}, coat_width2{};     ///< squared GGX widths
  U through_width2{};            ///< of the refraction, which version 1 may make wider
  Gloss<T> specular, glass, coat;
  /// What films make of the specular lobe, of glass and of metal.
  std::conditional_t<kIsLanes<S>, std::tuple<>, std::optional<FilmedInterface<T>>> specular_film,
      glass_film;
  std::conditional_t<kIsLanes<S>, std::tuple<>, std::optional<FilmedMetal<T>>> metal_film;
  MetalFresnel<U> metal;
  std::conditional_t<kIsLanes<S>, std::tuple<>, TopLobes<T>> top;
  std::array<Color<T>, kTopLobes> top_weight{};  ///< of each, its albedo included
  Color<T> metal_weight{}, glass_through{}, diffuse{}, subsurface{}, emission{};
  Color<U> transparency{};
  /// Of the refraction on entry into subsurface scattering: squared GGX width, index of refraction.
  U entry_width2{}, entry_eta{1};
  std::optional<OrenNayar<T>> rough_diffuse;
  U retro_roughness{};  ///< of the diffuse lobe of version 1
  U eta{1};             ///< index of refraction of the far side over the viewer's side, for glass
  /// Reflected and refracted share of white glass; for the choice between the two.
  R glass_flat = 0, glass_tint = 0, glass_least = 0, glass_most = 1;
  /// Version 1: masking and shadowing multiply instead of being height-correlated, glass is weighted
  /// by the Fresnel term at the shading normal and not at the micronormal, diffuse is Disney's.
  bool version1 = false;
  bool bare_refraction = false;  ///< that of single micronormals has no Fresnel term
  /// What reflects and refracts; drawn are GGX micronormals of the same widths in any case. Lanes have
  /// no others.
  Micronormals micronormals = Micronormals::kGgx;
  bool stretched = false;  ///< reflections have two widths, whose ratio is `stretch`
  U stretch{1};
  S macro_reflected = 0;  ///< version 1: probability that glass reflects

  bool has(int lobe) const { return present[lobe]; }
  /// Whether glass reflects by other micronormals than metal and the specular lobe: those of its
  /// refraction, which are never stretched.
  bool glass_apart() const {
    if constexpr (kIsLanes<S>)
      return false;
    else
      return stretched && has(kGlass);
  }
  /// Whether there are reflections by the base roughness.
  bool has_base() const { return has(kSpecular) || has(kMetal) || (has(kGlass) && !glass_apart()); }
  /// Whether their micronormals are not isotropic GGX ones.
  bool has_uncommon() const {
    if constexpr (kIsLanes<S>)
      return false;
    else
      return stretched || micronormals != Micronormals::kGgx;
  }
  /// Two widths about that of the roughness, none above 1; `ratio`: y over x. Returns the roughness
  /// of their mean.
  T stretch_to(const T& roughness, const T& ratio) requires(!kIsLanes<S>) {
    const T width = square(clamp01(roughness)), root = safe_sqrt(ratio);
    const T x = width / root, y = width * root;
    stretched = true;
    stretch = ratio;
    if (!(value_of(max(x, y)) > 1)) return roughness;
    const T x1 = min(x, T(1)), y1 = min(y, T(1));
    stretch = y1 / x1;
    return safe_sqrt(safe_sqrt(x1 * y1));
  }
  /// As the nodes Principled BSDF and Metallic BSDF count their anisotropy.
  T stretch_by(const T& roughness, const T& anisotropy) requires(!kIsLanes<S>) {
    const T a = clamp01(anisotropy);
    if (!(value_of(a) > 0) && !has_slope(a)) return roughness;
    return stretch_to(roughness, T(1) - a * S(0.9));
  }
  bool stretch_moves() const {
    if constexpr (kIsLanes<S>)
      return false;
    else
      return stretched && has_slope(stretch);
  }
  /// D of what reflects and refracts.
  template <class X, class W>
  auto normals(const X& r2, const X& z2, const W& squared_width) const {
    if constexpr (!kIsLanes<S>)
      if (micronormals == Micronormals::kBeckmann) return beckmann_normals(r2, z2, squared_width);
    return ggx_normals(r2, z2, squared_width);
  }
  template <class X, class W>
  auto lambda(const X& tan2, const W& squared_width) const {
    if constexpr (!kIsLanes<S>)
      if (micronormals == Micronormals::kBeckmann) return beckmann_lambda(tan2, squared_width);
    return ggx_lambda(tan2, squared_width);
  }
  /// Masking and shadowing, G2.
  template <class C, class W>
  auto shadowing(const C& tan2_i, const C& tan2_o, const W& squared_width) const {
    using X = decltype(squared_width * tan2_i);
    const X i = lambda(tan2_i, squared_width), o = lambda(tan2_o, squared_width);
    return X(X(1) / (version1 ? X((i + S(1)) * (o + S(1))) : X(i + o + S(1))));
  }
  bool has_top_lobe() const {
    for (int lobe = kFirstTopLobe; lobe < kLobes; ++lobe)
      if (present[lobe]) return true;
    return false;
  }
  /// Takes away the lobes whose light comes along other kinds of rays. The glass of version 2, which
  /// reflects and refracts, is one lobe that goes only if both kinds do, as in Cycles.
  void keep(RayKinds kinds) {
    const auto drop = [this](int lobe) {
      present[lobe] = false;
      pick[lobe] = 0;
    };
    const bool reflects = kinds & kGlossyRay, refracts = kinds & kTransmissionRay;
    if (!(kinds & kDiffuseRay)) {  // as all top lobes are seen, fibres do not mirror
      drop(kDiffuse);
      for (int lobe = kFirstTopLobe; lobe < kLobes; ++lobe) drop(lobe);
    }
    if (!reflects)
      for (const Lobe lobe : {kSpecular, kMetal, kCoat}) drop(lobe);
    if (!reflects && !refracts) drop(kGlass);
    if (!version1) return;
    if (!reflects) glass.flat = glass.risen = {};
    if (!refracts) glass_through = {};
  }
  bool has_filmed_glass() const {
    if constexpr (kIsLanes<S>)
      return false;
    else
      return glass_film.has_value();
  }
  /// Weighted Fresnel terms of what glass reflects and lets through, and of the specular lobe.
  Color<T> glass_at(S cos_m) const {
    if constexpr (!kIsLanes<S>)
      if (glass_film) return glass_film->reflect(glass, T(cos_m));
    return glass.at(cos_m);
  }
  Color<T> glass_passing(S cos_m) const {
    if constexpr (!kIsLanes<S>)
      if (glass_film) return glass_film->transmit(glass, T(cos_m));
    return glass_through * T(T(1) - glass.rise.at(cos_m));
  }
  Color<T> specular_at(S cos_m) const {
    if constexpr (!kIsLanes<S>)
      if (specular_film) return specular_film->reflect(specular, T(cos_m));
    return specular.at(cos_m);
  }
  Color<T> metal_at(S cos_m) const {
    if constexpr (!kIsLanes<S>)
      if (metal_film) return metal_weight * metal_film->at(cos_m);
    return metal_weight * metal.at(cos_m);
  }
  /// Weighted Fresnel terms of the reflections that share the base roughness.
  Color<T> base_reflectance(S cos_m) const {
    Color<T> sum{};
    if (has(kSpecular)) sum += specular_at(cos_m);
    if (has(kGlass) && !glass_apart()) sum += glass_at(cos_m);
    if (has(kMetal)) sum += metal_at(cos_m);
    return sum;
  }
  /// Probability of drawing one of them, given the micronormal.
  S base_reflection_pick(S cos_m) const {
    S sum = pick[kSpecular] + pick[kMetal];
    if (has(kGlass) && !glass_apart()) sum += pick[kGlass] * reflected_share(cos_m);
    return sum;
  }
  /// Probability that the glass lobe reflects at a micronormal, close to its share of the energy.
  S reflected_share(S cos_m) const {
    if (version1) return macro_reflected;
    return reflected_share_of_rise(glass.rise.value_at(cos_m));
  }
  S reflected_share_of_rise(S rise) const {
    const mask_t<S> total = rise >= S(1);  // internal reflection
    if (all(total)) return S(1);
    const S reflected = glass_flat + (1 - glass_flat) * rise;
    const S through = glass_tint * (1 - rise);
    const S both = reflected + through;
    const S share = select(both > S(0), S(reflected / both), S(0.5));
    return select(total, S(1), clamp(share, S(glass_least), S(glass_most)));
  }
};

}  // namespace selenite
