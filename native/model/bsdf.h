// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include "math/sampling.h"
#include "model/bsdf_sample.h"
#include "model/layers.h"
#include "model/refraction.h"
#include "model/shading_normal.h"

namespace selenite {

/// Principled BSDF at one shading point, seen from one direction, as Cycles 4.5 renders it.
///
/// wi points to the viewer, wo to the light. T carries the derivatives of the material's parameters;
/// directions, densities and choices are plain numbers (detached sampling). Radiance crosses an
/// interface unscaled (no 1/eta^2), as in Cycles.
template <class T>
class PrincipledBsdf {
  using S = scalar_t<T>;

 public:
  PrincipledBsdf(const Principled<T>& material, const Flavour& flavour,
                 const SurfacePoint<S>& point)
      : point_(point),
        frame_(Frame<S>::from_normal(visible_normal(point))),
        wi_(frame_.to_local(point.wi)),
        cos_i_(clamp(wi_.z, S(1e-7), S(1))),
        layers_(material, flavour, point, cos_i_),
        skin_(flavour.subsurface == Flavour::Subsurface::kRandomWalkSkin),
        unphysical_(flavour.evaluate_unphysical_refraction) {
    const S tan2 = tangent2(wi_);
    const auto lambda = [tan2](const auto& width2) { return ggx_lambda(tan2, width2); };
    const S singular = static_cast<S>(layers_.version1 ? kSingularWidth2V1 : kSingularWidth2);
    base_.start(layers_.width2, has(kSpecular) || has(kMetal) || has(kGlass), singular, lambda);
    through_.start(layers_.through_width2, has(kGlass), singular, lambda);
    coat_.start(layers_.coat_width2, has(kCoat), singular, lambda);
  }

  /// f(wi, wo) |cos| of everything that is not singular, 1/sr.
  Color<T> value(const Vec3<S>& wo) const {
    Color<T> f{};
    S unused = 0;
    evaluate<true, false>(wo, nullptr, f, unused);
    return f;
  }
  /// Density of `sample` in wo, 1/sr, without the singular lobes.
  S density(const Vec3<S>& wo) const {
    Color<T> unused{};
    S p = 0;
    evaluate<false, true>(wo, nullptr, unused, p);
    return p;
  }
  void value_and_density(const Vec3<S>& wo, Color<T>& f, S& p) const {
    f = {};
    p = 0;
    evaluate<true, true>(wo, nullptr, f, p);
  }

  /// Draws a direction from three uniform numbers; empty if the light is absorbed.
  std::optional<BsdfSample<T>> sample(S u_lobe, S u1, S u2) const {
    int lobe = 0;
    S left = u_lobe;
    while (lobe < kLobes - 1 && left >= layers_.pick[lobe]) left -= layers_.pick[lobe++];
    while (lobe > 0 && !(layers_.pick[lobe] > 0)) --lobe;  // rounding of the sum
    if (!(layers_.pick[lobe] > 0)) return std::nullopt;
    if (lobe == kDiffuse) return sample_diffuse(u1, u2);
    if (lobe == kSheen) return sample_sheen(u1, u2);
    if (lobe == kSubsurface) return enter(left / layers_.pick[kSubsurface], u1, u2);
    // Where refraction has a width of its own, in version 1, its share is fixed.
    const bool through = layers_.version1 && lobe == kGlass &&
                         left >= layers_.pick[kGlass] * layers_.macro_reflected;
    const Width& width = lobe == kCoat ? coat_ : through ? through_ : base_;
    const Vec3<S> m = width.singular ? Vec3<S>{0, 0, 1}
                                     : ggx_sample_visible(wi_, std::sqrt(width.width2), u1, u2);
    const S cos_m = dot(wi_, m);
    if (!(cos_m > 0)) return std::nullopt;
    if (lobe == kGlass && left >= layers_.pick[kGlass] * reflected_share(cos_m))
      return refract(m, cos_m);
    return reflect(m, cos_m, width.singular);
  }

  /// Radiance emitted towards the viewer, W/(m^2 sr).
  const Color<T>& emission() const { return layers_.emission; }
  /// Factor of the light that passes straight through. It belongs to the path tracer and is part
  /// neither of `value` nor of `sample`.
  const Color<T>& transparency() const { return layers_.transparency; }
  /// Index of refraction on entry into subsurface scattering.
  const T& entry_eta() const { return layers_.entry_eta; }
  /// Whether a direction leads through the geometric surface.
  bool transmits(const Vec3<S>& wo) const { return dot(point_.ng, wo) < 0; }
  /// True if `value` is 0 for every direction, so that a light sample would be wasted.
  bool all_singular() const {
    return !has(kDiffuse) && !has(kSheen) && !base_.spreads && !through_.spreads && !coat_.spreads;
  }

 private:
  /// Lobes of one roughness share micronormals.
  struct Width {
    S width2 = 0, lambda_i = 0;
    bool singular = false;  ///< a mirror
    bool spreads = false;   ///< present and not a mirror

    template <class Lambda>
    void start(const T& dual_width2, bool present, S singular_width2, const Lambda& lambda) {
      width2 = value_of(dual_width2);
      singular = width2 <= singular_width2;
      spreads = present && !singular;
      lambda_i = lambda(width2);
    }
  };

  bool has(Lobe lobe) const { return layers_.present[lobe]; }

  /// Adds the lobes that are not singular to f and p. `drawn` is the micronormal that wo was made
  /// from, if it was: more precise than what wo gives back.
  template <bool kValue, bool kDensity>
  void evaluate(const Vec3<S>& wo, const Vec3<S>* drawn, Color<T>& f, S& p) const {
    if (has(kDiffuse)) add_diffuse<kValue, kDensity>(wo, f, p);
    if (has(kSheen)) add_sheen<kValue, kDensity>(wo, f, p);
    if (!base_.spreads && !through_.spreads && !coat_.spreads) return;
    const Vec3<S> o = frame_.to_local(wo);
    // A direction above the bent normal's horizon but behind the surface, or the other way round,
    // belongs to neither side, unless a lobe has drawn it: as in Cycles 4.5.
    const bool below = dot(point_.ng, wo) < 0;
    if (o.z == 0 || (!drawn && below != (o.z < 0))) return;
    if (below) {
      if (through_.spreads) add_refraction<kValue, kDensity>(o, drawn, f, p);
    } else {
      add_reflection<kValue, kDensity>(o, drawn, f, p);
    }
  }

  template <bool kValue, bool kDensity>
  void add_diffuse(const Vec3<S>& wo, Color<T>& f, S& p) const {
    const S cos_o = dot(point_.n, wo);
    if (!(cos_o > 0)) return;
    if constexpr (kValue) {
      if (layers_.version1) {
        f += layers_.diffuse * (disney_diffuse(layers_.retro_roughness, dot(point_.n, point_.wi),
                                               cos_o, dot(point_.wi, wo)) *
                                cos_o);
      } else {
        f += layers_.rough_diffuse
                 ? layers_.diffuse * layers_.rough_diffuse->value(cos_o, dot(point_.wi, wo)) * cos_o
                 : layers_.diffuse * (cos_o * kInvPi<S>);
      }
    }
    if constexpr (kDensity) p += layers_.pick[kDiffuse] * cos_o * kInvPi<S>;
  }

  template <bool kValue, bool kDensity>
  void add_sheen(const Vec3<S>& wo, Color<T>& f, S& p) const {
    if (!(dot(point_.n, wo) > 0)) return;
    if constexpr (kValue) f += layers_.sheen_weight * layers_.sheen.value(wo);
    if constexpr (kDensity) p += layers_.pick[kSheen] * layers_.sheen.density(wo);
  }

  template <bool kValue, bool kDensity>
  void add_reflection(const Vec3<S>& o, const Vec3<S>* drawn, Color<T>& f, S& p) const {
    const Vec3<S> sum = wi_ + o;
    const S length2 = dot(sum, sum);
    if (!(length2 > S(1e-14))) return;
    S cos_m = S(0.5) * std::sqrt(length2);
    S r2 = (sum.x * sum.x + sum.y * sum.y) / length2, z2 = sum.z * sum.z / length2;
    if (drawn) {
      cos_m = dot(*drawn, wi_);
      r2 = drawn->x * drawn->x + drawn->y * drawn->y;
      z2 = drawn->z * drawn->z;
    }
    const S tan2_i = tangent2(wi_), tan2_o = tangent2(o);
    const S per_cos = 1 / (4 * cos_i_);
    const auto shape = [&](const T& width2) {
      return narrow(width2, [&](const auto& w2) {
        return ggx_normals(r2, z2, w2) * per_cos * shadowing(tan2_i, tan2_o, w2);
      });
    };
    const auto seen = [&](const Width& width) {
      return ggx_normals(r2, z2, width.width2) * per_cos / (1 + width.lambda_i);
    };
    if (base_.spreads) {
      if constexpr (kValue) f += base_reflectance(cos_m) * shape(layers_.width2);
      if constexpr (kDensity) p += base_reflection_pick(cos_m) * seen(base_);
    }
    if (coat_.spreads) {
      if constexpr (kValue) f += layers_.coat.at(cos_m) * shape(layers_.coat_width2);
      if constexpr (kDensity) p += layers_.pick[kCoat] * seen(coat_);
    }
  }

  /// Masking and shadowing, G2.
  template <class X>
  X shadowing(S tan2_i, S tan2_o, const X& width2) const {
    const X i = ggx_lambda(tan2_i, width2), o = ggx_lambda(tan2_o, width2);
    return X(1) / (layers_.version1 ? (i + S(1)) * (o + S(1)) : i + o + S(1));
  }
  /// Weighted Fresnel terms of the reflections that share the base roughness.
  Color<T> base_reflectance(S cos_m) const {
    Color<T> sum{};
    if (has(kSpecular)) sum += layers_.specular.at(cos_m);
    if (has(kGlass)) sum += layers_.glass.at(cos_m);
    if (has(kMetal)) sum += layers_.metal_weight * layers_.metal.at(cos_m);
    return sum;
  }
  /// Probability of drawing one of them, given the micronormal.
  S base_reflection_pick(S cos_m) const {
    S sum = layers_.pick[kSpecular] + layers_.pick[kMetal];
    if (has(kGlass)) sum += layers_.pick[kGlass] * reflected_share(cos_m);
    return sum;
  }
  /// Probability that the glass lobe reflects at a micronormal, close to its share of the energy.
  S reflected_share(S cos_m) const {
    if (layers_.version1) return layers_.macro_reflected;
    return reflected_share_of_rise(layers_.glass.rise.value_at(cos_m));
  }
  S reflected_share_of_rise(S rise) const {
    if (rise >= 1) return 1;  // total internal reflection
    const S reflected = layers_.glass_flat + (1 - layers_.glass_flat) * rise;
    const S through = layers_.glass_tint * (1 - rise);
    const S share = reflected + through > 0 ? reflected / (reflected + through) : S(0.5);
    return clamp(share, layers_.glass_least, layers_.glass_most);
  }

  /// D |m.wi| |m.wo| eta^2 / (|wi + eta wo|^2 cos_i): what visible micronormals send to wo.
  template <class X>
  X refracted_flow(const Refraction<X>& g, const X& width2, const X& eta) const {
    return ggx_normals(g.r2, g.z2, width2) * g.cos_m * g.cos_o * (eta * eta) / (g.length2 * cos_i_);
  }

  template <bool kValue, bool kDensity>
  void add_refraction(const Vec3<S>& o, const Vec3<S>* drawn, Color<T>& f, S& p) const {
    const S eta = value_of(layers_.eta);
    const Vec3<S> sum = wi_ + o * eta;
    // Straight through an interface that bends nothing: the half vector is rounding noise.
    if (!(dot(sum, sum) > S(1e-12))) return;
    if (!drawn && !unphysical_ && !reachable(sum, o, eta)) return;
    const S tan2_i = tangent2(wi_), tan2_o = tangent2(o);
    if constexpr (kValue) {
      const T shape =
          narrow(layers_.through_width2, layers_.eta, [&](const auto& width2, const auto& n) {
            using X = std::decay_t<decltype(n)>;
            const Refraction<X> g(wi_, o, n, drawn);
            const X lobe = refracted_flow(g, width2, n) * shadowing(tan2_i, tan2_o, width2);
            if (layers_.version1) return lobe;
            if constexpr (std::is_same_v<X, S>)
              return lobe * (1 - layers_.glass.rise.value_at(g.cos_m));
            else
              return lobe * (X(1) - dielectric_rise(g.cos_m, (n - X(1)) * (n + X(1))));
          });
      f += layers_.glass_through * shape;
    }
    if constexpr (kDensity) {
      const Refraction<S> g(wi_, o, eta, drawn);
      p += layers_.pick[kGlass] * (1 - reflected_share(g.cos_m)) *
           refracted_flow(g, through_.width2, eta) / (1 + through_.lambda_i);
    }
  }

  /// Whether a visible micronormal refracts wi to o; sum = wi + eta o.
  bool reachable(const Vec3<S>& sum, const Vec3<S>& o, S eta) const {
    if (bends_nothing(eta)) return false;
    const S up = sum.z < 0 ? S(-1) : S(1);
    return up * dot(sum, wi_) > 0 && up * dot(sum, o) < 0;
  }
  /// Refraction that Cycles samples as if it were singular.
  static bool bends_nothing(S eta) { return std::abs(eta - 1) < S(1e-4); }

  std::optional<BsdfSample<T>> sample_diffuse(S u1, S u2) const {
    const Frame<S> frame = Frame<S>::from_normal(point_.n);
    auto s = finish(frame.to_world(square_to_cosine_hemisphere(u1, u2)), nullptr, false);
    if (s) s->diffuse = true;
    return s;
  }

  std::optional<BsdfSample<T>> sample_sheen(S u1, S u2) const {
    auto s = finish(layers_.sheen.sample(u1, u2), nullptr, false);
    if (s) s->diffuse = true;
    return s;
  }

  /// Refraction at a visible micronormal without Fresnel term, masking or shadowing; for skin every
  /// second time along a cosine lobe instead.
  std::optional<BsdfSample<T>> enter(S u, S u1, S u2) const {
    Vec3<S> o;
    T change(1);  // of the density of the direction, with the parameters that shape it
    if (skin_ && u < S(0.5)) {
      o = -square_to_cosine_hemisphere(u1, u2);
    } else {
      const S eta = value_of(layers_.entry_eta), e = (eta - 1) * (eta + 1);
      const S width2 = value_of(layers_.entry_width2);
      const Vec3<S> m = ggx_sample_visible(wi_, std::sqrt(width2), u1, u2);
      const S cos_m = dot(wi_, m);
      o = (m * (-e / (cos_m + std::sqrt(e + cos_m * cos_m))) - wi_) / eta;
      change = entry_change(o, m);
    }
    const Vec3<S> wo = normalize(frame_.to_world(o));
    if (!(dot(point_.ng, wo) < 0)) return std::nullopt;
    return BsdfSample<T>{.wo = wo,
                         .density = 0,
                         .weight = layers_.subsurface * change / layers_.pick[kSubsurface],
                         .singular = false,
                         .transmits = true,
                         .enters = true};
  }

  /// 1, with the relative derivative of the density of the refracted direction o: the direction is
  /// drawn from a distribution that is not divided out again. A mirror-like entry has none, and that
  /// of skin is left out: its micronormals end abruptly at the horizon, so that their image moves.
  T entry_change(const Vec3<S>& o, const Vec3<S>& m) const {
    const T &width2 = layers_.entry_width2, &eta = layers_.entry_eta;
    if constexpr (std::is_same_v<T, S>) {
      return 1;
    } else {
      if (skin_ || (!has_slope(width2) && !has_slope(eta)) || width2.v <= S(kSingularWidth2))
        return T(1);
      const S tan2 = tangent2(wi_);
      const T density = narrow(width2, eta, [&](const auto& w2, const auto& n) {
        const Refraction<std::decay_t<decltype(n)>> g(wi_, o, n, &m);
        return refracted_flow(g, w2, n) / (ggx_lambda(tan2, w2) + S(1));
      });
      return density.v > 0 ? with_value(density / density.v, S(1)) : T(1);
    }
  }

  std::optional<BsdfSample<T>> reflect(const Vec3<S>& m, S cos_m, bool singular) const {
    const Vec3<S> o = m * (2 * cos_m) - wi_;
    const Vec3<S> wo = normalize(frame_.to_world(o));
    if (!singular) return finish(wo, &m, false);
    if (!(dot(point_.ng, wo) > 0)) return std::nullopt;
    // Every mirror sends the light the same way: one direction, the sum of their values.
    Color<T> f{};
    S p = 0;
    if (base_.singular) {
      f += base_reflectance(cos_m);
      p += base_reflection_pick(cos_m);
    }
    if (has(kCoat) && coat_.singular) {
      f += layers_.coat.at(cos_m);
      p += layers_.pick[kCoat];
    }
    return BsdfSample<T>{wo, p, f / p, true, false};
  }

  std::optional<BsdfSample<T>> refract(const Vec3<S>& m, S cos_m) const {
    const S eta = value_of(layers_.eta), e = (eta - 1) * (eta + 1);
    const S g2 = e + cos_m * cos_m;
    if (!(g2 > 0)) return std::nullopt;
    const S bend = -e / (cos_m + std::sqrt(g2));  // cos_m - eta cos_t without its cancellation
    const Vec3<S> o = (m * bend - wi_) / eta;
    const Vec3<S> wo = normalize(frame_.to_world(o));
    if (!through_.singular && !bends_nothing(eta)) return finish(wo, &m, true);
    if (!(dot(point_.ng, wo) < 0)) return std::nullopt;
    const S p = layers_.pick[kGlass] * (1 - reflected_share(cos_m));
    if (!(p > 0)) return std::nullopt;
    const T through = T(1) - layers_.glass.rise.at(cos_m);
    return BsdfSample<T>{wo, p, layers_.glass_through * through / p, true, true};
  }

  /// Completes a direction of a lobe that is not singular.
  std::optional<BsdfSample<T>> finish(const Vec3<S>& wo, const Vec3<S>* drawn,
                                      bool transmits) const {
    if ((dot(point_.ng, wo) < 0) != transmits) return std::nullopt;
    BsdfSample<T> s{wo, 0, {}, false, transmits};
    Color<T> f{};
    evaluate<true, true>(wo, drawn, f, s.density);
    if (!(s.density > 0)) return std::nullopt;
    s.weight = f / s.density;
    return s;
  }

  SurfacePoint<S> point_;
  Frame<S> frame_;  // of the bent normal
  Vec3<S> wi_;      // in that frame
  S cos_i_;
  Layers<T> layers_;
  bool skin_;
  Width base_, through_, coat_;
  bool unphysical_;
};

}  // namespace selenite
