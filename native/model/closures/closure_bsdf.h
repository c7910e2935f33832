// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <variant>

#include "model/bsdf.h"
#include "model/closures/closure_layers.h"

namespace selenite {

/// Metal of a complex index of refraction: mirrors of reflectance 1 times the Fresnel term.
template <class T>
class ConductorBsdf {
  using S = scalar_t<T>;

 public:
  ConductorBsdf(const PrincipledBsdf<T>& mirrors, const ConductorFresnel<T>& fresnel,
                const Vec3<S>& wi)
      : mirrors_(mirrors), fresnel_(fresnel), wi_(wi) {}

  void value_and_density(const Vec3<S>& wo, Color<T>& f, S& p) const {
    mirrors_.value_and_density(wo, f, p);
    if (p > 0) f *= fresnel(wo);
  }
  BsdfSample<T> draw(S u_lobe, S u1, S u2) const {
    BsdfSample<T> s = mirrors_.draw(u_lobe, u1, u2);
    if (s.exists) s.weight *= fresnel(s.wo);
    return s;
  }
  Color<T> value_of_drawn(const Vec3<S>& wo) const {
    return mirrors_.value_of_drawn(wo) * fresnel(wo);
  }
  ConductorBsdf seen_by(RayKinds kinds) const { return {mirrors_.seen_by(kinds), fresnel_, wi_}; }
  bool all_singular() const { return mirrors_.all_singular(); }

 private:
  Color<T> fresnel(const Vec3<S>& wo) const {
    return fresnel_.at(S(0.5) * length(wi_ + wo));  // the cosine to the half vector
  }

  PrincipledBsdf<T> mirrors_;
  ConductorFresnel<T> fresnel_;
  Vec3<S> wi_;
};

/// Lambertian transmission.
template <class T>
class TranslucentBsdf {
  using S = scalar_t<T>;

 public:
  TranslucentBsdf(const Color<T>& color, const SurfacePoint<S>& point)
      : color_(color), n_(visible_normal(point)), ng_(point.ng) {}

  void value_and_density(const Vec3<S>& wo, Color<T>& f, S& p) const {
    p = present_ ? max(-dot(n_, wo), S(0)) * kInvPi<S> : S(0);
    f = color_ * p;
  }
  BsdfSample<T> draw(S, S u1, S u2) const {
    const Vec3<S> wo = -Frame<S>::from_normal(n_).to_world(square_to_cosine_hemisphere(u1, u2));
    BsdfSample<T> s{.wo = wo,
                    .density = S(0),
                    .weight = color_,
                    .singular = false,
                    .transmits = true,
                    .diffuse = true};
    s.density = max(-dot(n_, wo), S(0)) * kInvPi<S>;
    s.exists = s.density > 0 && dot(ng_, wo) < 0;
    return s;
  }
  Color<T> value_of_drawn(const Vec3<S>& wo) const {
    Color<T> f;
    S unused;
    value_and_density(wo, f, unused);
    return f;
  }
  TranslucentBsdf seen_by(RayKinds kinds) const {
    TranslucentBsdf left = *this;
    left.present_ = present_ && kinds & kDiffuseRay;  // Cycles counts it among the diffuse ones
    return left;
  }
  bool all_singular() const { return false; }

 private:
  Color<T> color_;
  Vec3<S> n_, ng_;
  bool present_ = true;
};

/// One closure at a point that scatters light.
template <class T>
using ClosureBsdf = std::variant<PrincipledBsdf<T>, ConductorBsdf<T>, TranslucentBsdf<T>>;

}  // namespace selenite
