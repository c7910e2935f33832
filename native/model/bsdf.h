// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <type_traits>

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
///
/// Over lanes it stands for several points of one material, seen from one side of their surfaces; what
/// a lane that is not `active` gives is arbitrary. Sheen and subsurface scattering are left out there.
template <class T>
class PrincipledBsdf {
  using S = scalar_t<T>;
  using U = uniform_t<T>;  // of what the material's parameters alone decide
  using R = number_t<T>;
  static constexpr bool kTwists = !kIsLanes<S> && !std::is_same_v<T, S>;

 public:
  /// Of a Principled<U>, or of what makes a `Layers<T>` of other weights when it is called with the
  /// viewer's cosine to the bent normal, which may face away from the viewer.
  template <class Source>
  PrincipledBsdf(const Source& material, const Flavour& flavour, const SurfacePoint<S>& point,
                 const mask_t<S>& active = true)
      : point_(point),
        frame_(lobe_frame(point, visible_normal(point))),
        wi_(frame_.to_local(point.wi)),
        cos_i_(clamp(wi_.z, S(1e-7), S(1))),
        layers_([&]() -> Layers<T> {
          if constexpr (std::is_invocable_v<const Source&, S>)
            return material(wi_.z);
          else
            return {material, flavour, point, wi_.z, active};
        }()),
        active_(active),
        skin_(flavour.subsurface == Flavour::Subsurface::kRandomWalkSkin),
        unphysical_(flavour.evaluate_unphysical_refraction),
        blender5_(flavour.blender5) {
    const S tan2 = tangent2(wi_);
    const auto lambda = [tan2](const R& width2) { return ggx_lambda(tan2, width2); };
    const R singular = static_cast<R>(layers_.version1 ? kSingularWidth2V1 : kSingularWidth2);
    base_.start(layers_.width2, layers_.has_base(), singular, lambda);
    if constexpr (!kIsLanes<S>)
      if (layers_.stretched)
        base_.lambda_i =
            ggx_lambda(stretched_tangent2(wi_, S(value_of(layers_.stretch))), base_.width2);
    through_.start(layers_.through_width2, layers_.has(kGlass), singular, lambda);
    coat_.start(layers_.coat_width2, layers_.has(kCoat), singular, lambda);
  }

  /// f(wi, wo) |cos| of everything that is not singular, 1/sr.
  Color<T> value(const Vec3<S>& wo) const {
    Color<T> f{};
    S unused = 0;
    evaluate<true, false>(wo, {}, f, unused);
    return f;
  }
  /// Density of `sample` in wo, 1/sr, without the singular lobes.
  S density(const Vec3<S>& wo) const {
    Color<T> unused{};
    S p = 0;
    evaluate<false, true>(wo, {}, unused, p);
    return p;
  }
  void value_and_density(const Vec3<S>& wo, Color<T>& f, S& p) const {
    f = {};
    p = 0;
    evaluate<true, true>(wo, {}, f, p);
  }

  /// The value towards a direction that a micronormal of its own has sent there, and which may lie on
  /// the other side of the bent normal than of the surface.
  Color<T> value_of_drawn(const Vec3<S>& wo) const requires(!kIsLanes<T>) {
    const Vec3<S> o = frame_.to_local(wo);
    const Vec3<S> sum = transmits(wo) ? wi_ + o * S(value_of(layers_.eta)) : wi_ + o;
    const S length2 = dot(sum, sum);
    if (!(length2 > S(1e-12))) return value(wo);
    using std::sqrt;
    const S inverse = 1 / sqrt(length2);
    Color<T> f{};
    S unused = 0;
    evaluate<true, false>(wo, {sum * (dot(sum, wi_) < S(0) ? -inverse : inverse), true}, f, unused);
    return f;
  }

  /// What light that is seen by these kinds of rays alone finds of it. Shares of samples stay those of
  /// the whole.
  PrincipledBsdf seen_by(RayKinds kinds) const requires(!kIsLanes<T>) {
    PrincipledBsdf left = *this;
    left.layers_.keep(kinds);
    const auto has = [&left](Lobe lobe) { return left.layers_.has(lobe); };
    left.base_.spreads = base_.spreads && left.layers_.has_base();
    left.through_.spreads = through_.spreads && has(kGlass);
    left.coat_.spreads = coat_.spreads && has(kCoat);
    return left;
  }

  /// Draws a direction from three uniform numbers; empty if the light is absorbed.
  std::optional<BsdfSample<T>> sample(S u_lobe, S u1, S u2) const requires(!kIsLanes<T>) {
    const BsdfSample<T> s = draw(u_lobe, u1, u2);
    return s.exists ? std::optional(s) : std::nullopt;
  }
  /// The same; `exists`: whether each lane has a direction.
  BsdfSample<T> draw(S u_lobe, S u1, S u2) const;  // bsdf_sampling.h

  /// Radiance emitted towards the viewer, W/(m^2 sr).
  const Color<T>& emission() const { return layers_.emission; }
  /// Factor of the light that passes straight through. It belongs to the path tracer and is part
  /// neither of `value` nor of `sample`.
  const Color<U>& transparency() const { return layers_.transparency; }
  const Layers<T>& layers() const { return layers_; }
  /// Whether a direction leads through the geometric surface.
  mask_t<S> transmits(const Vec3<S>& wo) const { return dot(point_.ng, wo) < S(0); }
  /// True if `value` is 0 for every direction, so that a light sample would be wasted.
  bool all_singular() const {
    return !layers_.has(kDiffuse) && !layers_.has_top_lobe() && !base_.spreads &&
           !through_.spreads && !coat_.spreads;
  }

 private:
  template <class>
  friend class SurfaceBsdf;

  /// Lobes of one roughness share micronormals.
  struct Width {
    R width2 = 0;
    S lambda_i = 0;
    bool singular = false;  ///< a mirror
    bool spreads = false;   ///< present and not a mirror

    template <class Lambda>
    void start(const U& dual_width2, bool present, R singular_width2, const Lambda& lambda) {
      width2 = value_of(dual_width2);
      singular = width2 <= singular_width2;
      spreads = present && !singular;
      lambda_i = lambda(width2);
    }
  };

  /// Whether the bent normal is on the viewer's side. Lobes of micronormals are black where it is not.
  mask_t<S> faced() const { return wi_.z > S(0); }

  // What a lobe adds in lanes where it gives nothing, by its mask, is exactly 0: its factors there are
  // those of a direction that it does reach, or are selected away before they meet the others.

  /// Adds the lobes that are not singular to f and p.
  template <bool kValue, bool kDensity>
  void evaluate(const Vec3<S>& wo, const DrawnNormal<S>& drawn, Color<T>& f, S& p) const {
    if (layers_.has(kDiffuse)) add_diffuse<kValue, kDensity>(wo, f, p);
    for_each_top_lobe(layers_.top, [&](int i, const auto& lobe) {
      if (layers_.has(kFirstTopLobe + i)) add_top_lobe<kValue, kDensity>(i, lobe, wo, f, p);
    });
    if (!base_.spreads && !through_.spreads && !coat_.spreads) return;
    const Vec3<S> o = frame_.to_local(wo);
    // Light that is not drawn lies on the side of the interpolated normal, as in Cycles: where that of
    // the bent one is the other, on neither.
    const mask_t<S> below = select(drawn.known, mask_t<S>(dot(point_.ng, wo) < S(0)),
                                   mask_t<S>(dot(point_.interpolated(), wo) < S(0)));
    const mask_t<S> astray = below ^ (o.z < S(0));
    const mask_t<S> sided = faced() & (o.z != S(0)) & (drawn.known | !astray);
    if (const mask_t<S> behind = sided & below; through_.spreads && active_.some(behind))
      add_refraction<kValue, kDensity>(o, drawn, behind, f, p);
    if (const mask_t<S> before = sided & !below; active_.some(before))
      add_reflection<kValue, kDensity>(o, drawn, before, f, p);
  }

  template <bool kValue, bool kDensity>
  void add_diffuse(const Vec3<S>& wo, Color<T>& f, S& p) const {
    const S cosine = dot(point_.n, wo);
    const mask_t<S> reached = cosine > S(0);
    if (!active_.some(reached)) return;
    const S factor = select(reached, cosine, S(0)), cos_o = select(reached, cosine, S(1));
    if constexpr (kValue) {
      if (layers_.version1) {
        f += layers_.diffuse * (disney_diffuse(layers_.retro_roughness, dot(point_.n, point_.wi),
                                               cos_o, dot(point_.wi, wo)) *
                                factor);
      } else if (layers_.rough_diffuse) {
        f += layers_.diffuse * layers_.rough_diffuse->value(cos_o, dot(point_.wi, wo)) * factor;
      } else {
        f += layers_.diffuse * S(factor * kInvPi<S>);
      }
    }
    if constexpr (kDensity) p += layers_.pick[kDiffuse] * factor * kInvPi<S>;
  }

  template <bool kValue, bool kDensity, class TopLobe>
  void add_top_lobe(int i, const TopLobe& lobe, const Vec3<S>& wo, Color<T>& f, S& p) const {
    if (!(dot(point_.n, wo) > 0)) return;
    if constexpr (kValue) f += layers_.top_weight[i] * lobe.value(wo);
    if constexpr (kDensity) p += layers_.pick[kFirstTopLobe + i] * lobe.density(wo);
  }

  template <bool kValue, bool kDensity>
  void add_reflection(const Vec3<S>& o, const DrawnNormal<S>& drawn, const mask_t<S>& where,
                      Color<T>& f, S& p) const {
    using std::sqrt;
    const Vec3<S> sum = wi_ + o;
    const S length2 = dot(sum, sum);
    const mask_t<S> reached = where & (length2 > S(1e-14));
    if (!active_.some(reached)) return;
    S cos_m = S(0.5) * sqrt(length2);
    S r2 = (sum.x * sum.x + sum.y * sum.y) / length2, z2 = sum.z * sum.z / length2;
    if (any(drawn.known)) {
      const Vec3<S>& m = drawn.m;
      cos_m = select(drawn.known, dot(m, wi_), cos_m);
      r2 = select(drawn.known, S(m.x * m.x + m.y * m.y), r2);
      z2 = select(drawn.known, S(m.z * m.z), z2);
    }
    cos_m = select(reached, cos_m, S(1));
    if constexpr (!kIsLanes<S>) {
      if (layers_.has_uncommon()) {
        const Vec3<S> m = drawn.known ? drawn.m : sum / sqrt(length2);
        add_uncommon_reflection<kValue, kDensity>(o, m, cos_m, f, p);
        if (!layers_.glass_apart() && !coat_.spreads) return;
      }
    }
    const S tan2_i = tangent2(wi_), tan2_o = tangent2(o);
    const S per_cos = 1 / (4 * cos_i_);
    const auto shape = [&](const U& width2) {
      const T lobe = narrow(width2, [&](const auto& w2) {
        return ggx_normals(r2, z2, w2) * per_cos * layers_.shadowing(tan2_i, tan2_o, w2);
      });
      return select(reached, lobe, T(0));
    };
    const auto seen = [&](const Width& width) {
      const S density = ggx_normals(r2, z2, width.width2) * per_cos / (1 + width.lambda_i);
      return select(reached, density, S(0));
    };
    if (layers_.glass_apart()) {
      if (through_.spreads) {
        if constexpr (kValue) f += layers_.glass_at(cos_m) * shape(layers_.through_width2);
        if constexpr (kDensity)
          p += layers_.pick[kGlass] * layers_.reflected_share(cos_m) * seen(through_);
      }
    } else if (base_.spreads && !layers_.has_uncommon()) {
      if constexpr (kValue) f += layers_.base_reflectance(cos_m) * shape(layers_.width2);
      if constexpr (kDensity) p += layers_.base_reflection_pick(cos_m) * seen(base_);
    }
    if (coat_.spreads) {
      if constexpr (kValue) f += layers_.coat.at(cos_m) * shape(layers_.coat_width2);
      if constexpr (kDensity) p += layers_.pick[kCoat] * seen(coat_);
    }
  }

  /// By the micronormal m that is not one of isotropic GGX.
  template <bool kValue, bool kDensity>
  void add_uncommon_reflection(const Vec3<S>& o, const Vec3<S>& m, const S& cos_m, Color<T>& f,
                               S& p) const {
    if (!base_.spreads) return;
    const Vec3<S> m2{m.x * m.x, m.y * m.y, m.z * m.z};
    if constexpr (kValue) {
      // `twist`: nothing, or the angle by which the widths turn.
      const auto shape_by = [&](const auto& width2, const auto& stretch, const auto&... twist) {
        using X = std::decay_t<decltype(width2)>;
        using std::abs;
        X r2 = stretched_normal(m2.x, m2.y, stretch);
        ((r2 += twisted(S(2 * m.x * m.y), stretch, twist)), ...);
        if (layers_.micronormals == Micronormals::kAshikhminShirley)
          return X(ashikhmin_shirley(m2, r2, cos_m, cos_i_, S(abs(o.z)), width2, stretch));
        const auto tangent = [&](const Vec3<S>& v) {
          X tan2 = stretched_tangent2(v, stretch);
          ((tan2 +=
            twisted(S(2 * v.x * v.y / max(v.z * v.z, S(1e-14))), X(X(S(1)) / stretch), twist)),
           ...);
          return tan2;
        };
        return X(layers_.normals(r2, X(m2.z), width2) *
                 layers_.shadowing(tangent(wi_), tangent(o), width2) / (4 * cos_i_));
      };
      const T shape = [&]() -> T {
        if constexpr (kTwists)
          if (has_slope(twist_)) return shape_by(layers_.width2, layers_.stretch, twist_);
        return narrow(layers_.width2, layers_.stretch, shape_by);
      }();
      f += layers_.base_reflectance(cos_m) * shape;
    }
    if constexpr (kDensity) {
      const S r2 = stretched_normal(m2.x, m2.y, S(value_of(layers_.stretch)));
      p += layers_.base_reflection_pick(cos_m) * ggx_normals(r2, m2.z, base_.width2) /
           (4 * cos_i_ * (1 + base_.lambda_i));
    }
  }

  template <bool kValue, bool kDensity>
  void add_refraction(const Vec3<S>& o, const DrawnNormal<S>& drawn, const mask_t<S>& where,
                      Color<T>& f, S& p) const {
    const R eta = value_of(layers_.eta);
    const Vec3<S> sum = wi_ + o * eta;
    // Straight through an interface that bends nothing: the half vector is rounding noise.
    mask_t<S> reached = where & (dot(sum, sum) > S(1e-12));
    if (!unphysical_ && !all(drawn.known)) reached &= drawn.known | refracts_into(wi_, o, sum, eta);
    if (!active_.some(reached)) return;
    const S tan2_i = tangent2(wi_), tan2_o = tangent2(o);
    if constexpr (kValue) {
      const bool filmed = layers_.has_filmed_glass();
      const T shape =
          narrow(layers_.through_width2, layers_.eta, [&](const auto& width2, const auto& n) {
            using N = std::decay_t<decltype(n)>;
            using X = decltype(n * wi_.x);
            const Refraction<X> g(wi_, o, n, drawn);
            const X lobe = refracted_flow(cos_i_, X(layers_.normals(g.r2, g.z2, width2)), g, n) *
                           layers_.shadowing(tan2_i, tan2_o, width2);
            if (layers_.bare_refraction || filmed) return lobe;
            if constexpr (std::is_same_v<X, S>)
              return X(lobe * (1 - layers_.glass.rise.value_at(g.cos_m)));
            else
              return X(lobe * (X(1) - dielectric_rise(g.cos_m, N((n - N(1)) * (n + N(1))))));
          });
      if (filmed)
        f += filmed_passing(o, drawn) * select(reached, shape, T(0));
      else
        f += layers_.glass_through * select(reached, shape, T(0));
    }
    if constexpr (kDensity) {
      const Refraction<S> g(wi_, o, eta, drawn);
      const S density =
          layers_.pick[kGlass] * (1 - layers_.reflected_share(g.cos_m)) *
          refracted_flow(cos_i_, S(ggx_normals(g.r2, g.z2, through_.width2)), g, eta) /
          (1 + through_.lambda_i);
      p += select(reached, density, S(0));
    }
  }

  /// Share of the light that a film on glass lets through to o.
  Color<T> filmed_passing([[maybe_unused]] const Vec3<S>& o,
                          [[maybe_unused]] const DrawnNormal<S>& drawn) const {
    if constexpr (kIsLanes<S>) {
      return {};
    } else {
      const T cos_m = narrow(layers_.eta, [&](const auto& n) {
        return Refraction<std::decay_t<decltype(n)>>(wi_, o, n, drawn).cos_m;
      });
      return layers_.glass_film->transmit(layers_.glass, cos_m);
    }
  }

  // Sampling: bsdf_sampling.h
  struct Choice;
  struct Proposal;
  Choice choose(const S& u_lobe) const;
  void mirror_or_refract(const Choice& choice, const S& u1, const S& u2, Proposal& proposal) const;
  BsdfSample<T> weigh(const Proposal& proposal) const;
  void weigh_singular(const Proposal& proposal, Color<T>& f, S& p) const;
  BsdfSample<T> enter(S u, S u1, S u2) const requires(!kIsLanes<T>);
  T entry_change(const Vec3<S>& o, const Vec3<S>& m) const requires(!kIsLanes<T>);

  SurfacePoint<S> point_;
  Frame<S> frame_;  // of the bent normal
  Vec3<S> wi_;      // in that frame
  S cos_i_;
  Layers<T> layers_;
  ActiveLanes<S> active_;
  bool skin_;
  Width base_, through_, coat_;
  bool unphysical_;
  bool blender5_;
  /// By which the two widths turn: 0, with its derivatives. `SurfaceBsdf` sets it.
  std::conditional_t<kTwists, T, std::tuple<>> twist_{};
};

}  // namespace selenite

#include "model/bsdf_sampling.h"
