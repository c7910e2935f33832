// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/closures/tilted_closure.h"

#include "model/closures/bump_terminator.h"

namespace selenite {
namespace {

template <class S>
SurfacePoint<Tilted<S>> lifted(const SurfacePoint<S>& p, const Vec3<Tilted<S>>& n) {
  using V = Vec3<Tilted<S>>;
  return {V(p.ng), n, V(p.wi), p.backfacing, p.after_diffuse, V(p.tangent), V(p.n)};
}

/// n + a s + b t by the angles a and b, at 0.
template <class S>
Vec3<Tilted<S>> tilting(const Vec3<S>& n) {
  const auto frame = Frame<S>::from_normal(n);
  return {{n.x, frame.s.x, frame.t.x}, {n.y, frame.s.y, frame.t.y}, {n.z, frame.s.z, frame.t.z}};
}

template <class X>
ClosureBsdf<X> made(const Closure<X>& closure, const Flavour& flavour, const X& weight,
                    const SurfacePoint<X>& point) {
  return std::visit(
      [&](const auto& m) -> ClosureBsdf<X> {
        using One = std::decay_t<decltype(m)>;
        if constexpr (std::is_same_v<One, closures::Translucent<X>>) {
          const auto color = map(m.color, [](const X& c) { return max(c, X(0)); });
          return TranslucentBsdf<X>(color * weight, point);
        } else if constexpr (std::is_same_v<One, closures::Transparent<X>> ||
                             std::is_same_v<One, closures::Emission<X>>) {
          return TranslucentBsdf<X>(Color<X>(X(0)), point);  // scatters nothing
        } else {
          const PrincipledBsdf<X> lobes(
              [&](X cos_n) { return ClosureLayers<X>(m, weight, flavour, point, cos_n); }, flavour,
              point);
          if constexpr (std::is_same_v<One, closures::Conductor<X>>)
            return ConductorBsdf<X>(lobes, ClosureLayers<X>::conductor_fresnel(m, flavour.blender5),
                                    point.wi);
          else
            return lobes;
        }
      },
      closure);
}

}  // namespace

template <class S>
TiltedClosure<S>::TiltedClosure(const Closure<X>& closure, const Flavour& flavour, S weight,
                                const SurfacePoint<S>& at, const Vec3<S>& n)
    : point_(lifted(at, tilting(n))),
      bsdf_(made<X>(closure, flavour, weight, point_)),
      smooth_(at.n),
      skin_(flavour.subsurface == Flavour::Subsurface::kRandomWalkSkin) {}

template <class S>
Color<Tilted<S>> TiltedClosure<S>::lost(const Vec3<X>& wo) const {
  if (std::holds_alternative<ConductorBsdf<X>>(bsdf_)) return {};
  return std::visit(
      [&](const auto& b) {
        Color<X> diffuse;
        X unused;
        b.seen_by(kDiffuseRay).value_and_density(wo, diffuse, unused);
        return diffuse * (bump_terminator(smooth_, point_.n, wo) - 1);
      },
      bsdf_);
}

template <class S>
Color<Tilted<S>> TiltedClosure<S>::value(const Vec3<S>& to) const {
  const Vec3<X> wo(to);
  return std::visit(
      [&](const auto& b) {
        Color<X> f;
        X unused;
        b.value_and_density(wo, f, unused);
        return f + lost(wo);
      },
      bsdf_);
}

template <class S>
Color<Tilted<S>> TiltedClosure<S>::value_of_drawn(const Vec3<S>& to, bool diffuse) const {
  if (diffuse && !std::holds_alternative<TranslucentBsdf<X>>(bsdf_)) return value(to);
  const Vec3<X> wo(to);
  const Color<X> f = std::visit([&](const auto& b) { return b.value_of_drawn(wo); }, bsdf_);
  // Cycles leaves the transmission that it has drawn as it is.
  return std::holds_alternative<TranslucentBsdf<X>>(bsdf_) ? f : f + lost(wo);
}

template <class S>
Tilted<S> TiltedClosure<S>::entry_change(const Vec3<S>& to) const {
  const auto* lobes = std::get_if<PrincipledBsdf<X>>(&bsdf_);
  if (!lobes || skin_) return 1;
  const auto& layers = lobes->layers();
  if (!layers.has(kSubsurface) || layers.entry_width2 <= kSingularWidth2) return 1;
  const auto frame = lobe_frame(point_, visible_normal(point_));
  const Vec3<X> wi = frame.to_local(point_.wi), wo = frame.to_local(Vec3<X>(to));
  const X density = entry_density<X, X>(wi, clamp(wi.z, 1e-7, 1), wo, nullptr, layers.entry_width2,
                                        layers.entry_eta);
  return density > 0 ? density / density.value() : X(1);
}

template <class S>
void TiltedClosure<S>::keep(RayKinds kinds) {
  bsdf_ = std::visit([&](const auto& b) -> ClosureBsdf<X> { return b.seen_by(kinds); }, bsdf_);
}

template class TiltedClosure<float>;
template class TiltedClosure<double>;

}  // namespace selenite
