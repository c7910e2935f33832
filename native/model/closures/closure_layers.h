// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "model/closures/closure.h"
#include "model/closures/conductor_fresnel.h"
#include "model/layers.h"

namespace selenite {

/// What a walk under the surface takes from a Subsurface closure, as the Principled BSDF says it.
template <class T>
Principled<T> under_surface(const closures::Subsurface<T>& m) {
  Principled<T> values;
  values.base_color = m.color;
  values.subsurface_weight = T(1);
  values.subsurface_scale = m.scale;
  values.subsurface_radius = m.radius;
  values.subsurface_ior = m.ior;
  values.subsurface_anisotropy = m.anisotropy;
  return values;
}

/// Fills the lobes of the layered model with those of one closure of a mixture. Nothing is layered in
/// them but the Principled BSDF. Colours are cut off below 0 and not above 1, as in Cycles.
template <class T>
struct ClosureLayers : Layers<T> {
  using S = scalar_t<T>;

  ClosureLayers(const closures::FullPrincipled<T>& m, const T& weight, const Flavour& flavour,
                const SurfacePoint<S>& point, S cos_n)
      : Layers<T>(m, flavour, point, cos_n, true, m.anisotropic, m.film) {
    for (Color<T>* c : {&this->emission, &this->transparency, &this->metal_weight,
                        &this->glass_through, &this->diffuse, &this->subsurface})
      *c = *c * weight;
    for (auto* gloss : {&this->specular, &this->glass, &this->coat}) {
      gloss->flat = gloss->flat * weight;
      gloss->risen = gloss->risen * weight;
    }
    for (Color<T>& c : this->top_weight) c = c * weight;
    for (int k = 0; k < kLobes; ++k) {
      this->estimate_[k] *= value_of(weight);
      if (has_slope(weight) && this->present[k]) this->carries_slope_[k] = true;
    }
  }
  template <class OneClosure>
  ClosureLayers(const OneClosure& m, const T& weight, const Flavour& flavour,
                const SurfacePoint<S>& point, S cos_n)
      : Layers<T>(flavour, cos_n) {
    add(m, weight, point);
    this->choose();
  }

 private:
  using SurfacePointHere = SurfacePoint<S>;

  static Color<T> nonnegative_color(const Color<T>& c) { return map(c, Layers<T>::nonnegative); }
  void place(Lobe lobe, S estimate, bool slope) {
    this->present[lobe] = true;
    this->estimate_[lobe] = estimate;
    this->carries_slope_[lobe] = slope;
  }
  void widen(const T& roughness) {
    this->width2 = this->through_width2 = square(square(clamp01(roughness)));
  }

  void add(const closures::Diffuse<T>& m, const T& weight, const SurfacePointHere& point) {
    const Color<T> color = nonnegative_color(m.color);
    const T roughness = clamp01(m.roughness);
    this->diffuse = color * weight;
    if (!this->matters(this->diffuse)) return;
    if (value_of(roughness) > 0 || has_slope(roughness))
      this->rough_diffuse.emplace(roughness, color, dot(point.n, point.wi));
    place(kDiffuse, value_of(mean_channel(this->diffuse)),
          has_slope(this->diffuse) || has_slope(roughness));
  }

  /// As the Glossy node counts its anisotropy.
  T stretch_glossy(const T& roughness, const T& anisotropy) {
    constexpr S kLeast = S(1e-4), kMost = S(0.99);
    const T a = clamp(anisotropy, -kMost, kMost);
    const bool along = value_of(a) >= 0;
    if (!((along ? value_of(a) : -value_of(a)) > kLeast) && !has_slope(a)) return roughness;
    return this->stretch_to(roughness, along ? T(1) / square(T(1) - a) : square(T(1) + a));
  }
  /// Puts a reflection whose Fresnel term is `metal` times what `mean` is the mean of.
  void add_mirror(const T& roughness, const Color<T>& weight, const Color<T>& mean, S estimate,
                  bool slope) {
    widen(roughness);
    this->metal_weight = weight;
    if (this->compensate_) {
      const AlbedoTables& tables = AlbedoTables::get();
      const T e = tables.mirror(clamp01(roughness), this->cos_i_);
      const T e_mean = tables.mirror_mean(clamp01(roughness));
      this->metal_weight *=
          this->map_tint(mean, [&](const T& f) { return Layers<T>::compensation(f, e, e_mean); });
    }
    if (this->micronormals == Micronormals::kAshikhminShirley) {
      constexpr S kMirror = S(kSingularWidth2Ashikhmin);
      if (value_of(this->width2) <= kMirror) this->width2 = with_value(this->width2, S(0));
    }
    place(kMetal, estimate,
          slope || has_slope(this->metal_weight) || has_slope(this->width2) ||
              has_slope(this->stretch));
  }
  void add(const closures::Glossy<T>& m, const T& weight, const SurfacePointHere&) {
    const Color<T> color = nonnegative_color(m.color), lobe = color * weight;
    if (!this->matters(lobe)) return;
    this->metal = white();
    add_mirror(stretch_glossy(m.roughness, m.anisotropy), lobe, color, value_of(mean_channel(lobe)),
               false);
  }
  void add(const closures::Metallic<T>& m, const T& weight, const SurfacePointHere&) {
    if (!this->matters(weight)) return;
    this->metal = MetalFresnel<T>(map(m.base_color, clamp01<T>), map(m.edge_tint, clamp01<T>));
    bool slope = has_slope(this->metal.f0) || has_slope(this->metal.bump);
    if (is_there(m.film)) {
      this->metal_film.emplace(m.film, this->metal);
      slope = this->metal_film->moves();
    }
    const Color<T> seen =
        this->metal_film ? this->metal_film->at(this->cos_i_) : this->metal.at(this->cos_i_);
    add_mirror(this->stretch_by(m.roughness, m.anisotropy), Color<T>(weight), this->metal.mean(),
               value_of(weight) * value_of(mean_channel(seen)), slope);
  }
  /// Its Fresnel term is left to ConductorBsdf.
  void add(const closures::Conductor<T>& m, const T& weight, const SurfacePointHere&) {
    if (!this->matters(weight)) return;
    const auto fresnel = conductor_fresnel(m, this->blender5_);
    this->metal = white();
    add_mirror(
        this->stretch_by(m.roughness, m.anisotropy), Color<T>(weight), fresnel.mean(),
        value_of(weight) * mean_channel(value_of(fresnel.at(this->cos_i_))),
        has_slope(m.ior) || has_slope(m.extinction) || (fresnel.film && fresnel.film->moves()));
  }

  void add(const closures::Glass<T>& m, const T& weight, const SurfacePointHere& point) {
    const Color<T> color = nonnegative_color(m.color);
    if (!this->matters(weight)) return;
    widen(m.roughness);
    const auto d = seen_interface(m.ior, point.backfacing);
    Color<T> lobe = color * weight;
    if (this->compensate_) {
      const AlbedoTables& tables = AlbedoTables::get();
      const T roughness = clamp01(m.roughness);
      const bool thinner = value_of(d.eta) < 1;
      const T e = tables.glass(roughness, this->cos_i_, d.z, thinner);
      const T e_mean = tables.glass_mean(roughness, d.z, thinner);
      lobe *=
          this->map_tint(color, [&](const T& f) { return Layers<T>::compensation(f, e, e_mean); });
    }
    const T rest = T(1) - d.normal;
    this->glass = {lobe * d.normal, lobe * rest, DielectricRise<T>(d.excess)};
    this->glass_through = this->glass.risen;
    this->glass_flat = value_of(d.normal);
    this->glass_tint = 1 - this->glass_flat;
    bool moves = this->moves(this->glass) || has_slope(d.eta);
    if (is_there(m.film)) {
      this->film_glass(m.film, point.backfacing, d.normal, Color<T>(T(1)));
      moves |= this->glass_film->moves();
    }
    if (has_slope(d.eta)) this->glass_least = S(0.05), this->glass_most = S(0.95);
    place(kGlass, value_of(weight) * mean_channel(value_of(color)),
          moves || has_slope(this->width2));
  }
  void add(const closures::Refraction<T>& m, const T& weight, const SurfacePointHere& point) {
    const Color<T> lobe = nonnegative_color(m.color) * weight;
    if (!this->matters(lobe)) return;
    widen(m.roughness);
    this->bare_refraction = true;
    const auto d = seen_interface(m.ior, point.backfacing);
    this->glass_through = lobe;
    this->glass_tint = 1;
    place(kGlass, value_of(mean_channel(lobe)),
          has_slope(lobe) || has_slope(d.eta) || has_slope(this->width2));
  }
  Dielectric<T> seen_interface(const T& ior, bool backfacing) {
    const T inside = max(ior, T(S(1e-5)));
    this->eta = backfacing ? T(1) / inside : inside;
    return Dielectric<T>::from_ior(this->eta);
  }

  void add(const closures::Subsurface<T>& m, const T& weight, const SurfacePointHere& point) {
    if (!this->matters(weight)) return;
    this->entry_eta = m.ior;
    this->add_subsurface(under_surface(m), weight, point.after_diffuse);
    if (!this->skin_) this->entry_width2 = square(clamp01(m.roughness));
    if (!this->matters(this->diffuse)) return;
    place(kDiffuse, value_of(mean_channel(this->diffuse)), has_slope(this->diffuse));
  }

  void add(const closures::Sheen<T>& m, const T& weight, const SurfacePointHere& point) {
    const Color<T> lobe = nonnegative_color(m.color) * weight;
    if (!this->matters(lobe)) return;
    const Sheen<T> found(clamp01(m.roughness), point.n, point.wi);
    if (!found.exists()) return;
    constexpr int kSheen = 0;
    std::get<kSheen>(this->top) = found;
    this->top_weight[kSheen] = lobe * found.albedo();
    place(static_cast<Lobe>(kFirstTopLobe + kSheen),
          value_of(mean_channel(this->top_weight[kSheen])),
          has_slope(this->top_weight[kSheen]) || has_slope(m.roughness));
  }

  static MetalFresnel<T> white() { return MetalFresnel<T>(Color<T>(T(1)), Color<T>(T(1))); }

 public:
  static ConductorFresnel<T> conductor_fresnel(const closures::Conductor<T>& m, bool blender5) {
    const auto nonnegative = Layers<T>::nonnegative;
    ConductorFresnel<T> found{map(m.ior, nonnegative), map(m.extinction, nonnegative), blender5};
    if (is_there(m.film)) found.film.emplace(m.film, found.n, found.k);
    return found;
  }
};

}  // namespace selenite
