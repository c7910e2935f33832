// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <span>

#include "model/closures/bump_terminator.h"
#include "model/closures/closure_bsdf.h"
#include "model/closures/tilted_closure.h"
#include "model/subsurface.h"

namespace selenite {

/// A direction drawn from a mixture.
template <class T>
struct SurfaceSample : BsdfSample<T> {
  int part = 0;  ///< whose walk it is if it `enters`; for `SurfaceBsdf::medium`
};

/// Several closures at one shading point, each with its own shading normal: their sum. See
/// PrincipledBsdf for the conventions.
template <class T>
class SurfaceBsdf {
  using S = scalar_t<T>;

 public:
  /// `closures` stay where they are as long as this does. point.n: the normal of the surface itself.
  SurfaceBsdf(std::span<const PlacedClosure<T>> closures, const SurfacePoint<S>& point)
      : ng_(point.ng), smooth_(point.n) {
    for (const PlacedClosure<T>& placed : closures)
      std::visit([&](const auto& closure) { add(closure, placed, point); }, placed.closure);
    choose();
  }

  Color<T> value(const Vec3<S>& wo) const {
    Color<T> f;
    S unused;
    value_and_density(wo, f, unused);
    return f;
  }
  S density(const Vec3<S>& wo) const {
    Color<T> unused;
    S p;
    value_and_density(wo, unused, p);
    return p;
  }
  void value_and_density(const Vec3<S>& wo, Color<T>& f, S& p) const {
    f = {};
    p = 0;
    add_all_but(-1, wo, f, p);
  }
  SurfaceBsdf seen_by(RayKinds kinds) const {
    SurfaceBsdf left = *this;
    for (int i = 0; i < count_; ++i) {
      left.parts_[i]->bsdf = std::visit(
          [&](const auto& b) -> ClosureBsdf<T> { return b.seen_by(kinds); }, parts_[i]->bsdf);
      if constexpr (kTurns)
        if (auto& turning = left.parts_[i]->turning) turning->closure.keep(kinds);
    }
    return left;
  }

  /// Draws a closure and a direction from three uniform numbers; empty if the light is absorbed.
  std::optional<SurfaceSample<T>> sample(S u_lobe, S u1, S u2) const {
    int chosen = -1;
    for (int i = 0; i < count_; ++i) {
      if (!(parts_[i]->pick > 0)) continue;
      chosen = i;
      if (u_lobe < parts_[i]->pick) break;
      u_lobe -= parts_[i]->pick;
    }
    if (chosen < 0) return std::nullopt;
    const Part& part = *parts_[chosen];
    const S u = min(u_lobe / part.pick, kBelowOne);
    SurfaceSample<T> s{std::visit([&](const auto& b) { return b.draw(u, u1, u2); }, part.bsdf),
                       chosen};
    if (!s.exists) return std::nullopt;
    if (s.enters) {
      s.weight = s.weight / part.pick;
      if constexpr (kTurns)
        if (part.turning)
          s.weight =
              s.weight * (T(1) + part.turning->slopes(part.turning->closure.entry_change(s.wo)));
      return s;
    }
    if (s.singular) {
      s.weight = s.weight / part.pick;
      s.density *= part.pick;
      return s;
    }
    Color<T> f = s.weight * s.density;
    S p = part.pick * s.density;
    // Blender 4 leaves the diffuse transmission that it has drawn as it is.
    if (const bool lobes = std::holds_alternative<PrincipledBsdf<T>>(part.bsdf);
        part.bumped && (lobes || part.from->flavour.blender5))
      f +=
          std::visit([&](const auto& b) { return lost_at_terminator(b, part.n, s.wo); }, part.bsdf);
    if constexpr (kTurns)
      if (part.turning)
        f += part.turning->slopes(part.turning->closure.value_of_drawn(s.wo, s.diffuse));
    add_all_but(chosen, s.wo, f, p);
    s.weight = f / p;
    s.density = p;
    return s;
  }

  /// Radiance emitted towards the viewer, W/(m^2 sr).
  const Color<T>& emission() const { return emission_; }
  /// Factor of the light that passes straight through; part neither of `value` nor of `sample`.
  const Color<T>& transparency() const { return transparency_; }
  /// Probability with which a path passes straight through, so that what scatters, if anything does,
  /// has its share.
  S pass_probability() const {
    const S passed = max(mean_channel(value_of(transparency_)), S(0));
    const bool slope = has_slope(transparency_);
    if (count_ == 0) return passed > 0 || slope ? S(1) : S(0);
    const S p = passed > 0 ? passed / (passed + scattered_) : S(0);
    // A derivative needs both events at either end of the range.
    return slope ? clamp(p, S(0.1), S(0.9)) : min(p, S(0.99));
  }
  bool transmits(const Vec3<S>& wo) const { return dot(ng_, wo) < S(0); }
  bool all_singular() const {
    for (int i = 0; i < count_; ++i)
      if (!std::visit([](const auto& b) { return b.all_singular(); }, parts_[i]->bsdf))
        return false;
    return true;
  }
  /// Of the micronormals of what a sample was drawn from; 1 of diffuse transmission.
  S roughness(const SurfaceSample<T>& s) const {
    const auto* lobes = std::get_if<PrincipledBsdf<T>>(&parts_[s.part]->bsdf);
    return lobes ? std::sqrt(std::sqrt(value_of(lobes->layers().through_width2))) : S(1);
  }
  /// What a sample walks through that `enters`.
  SubsurfaceMedium<T> medium(const SurfaceSample<T>& s) const {
    const Part& part = *parts_[s.part];
    const T& eta = std::get<PrincipledBsdf<T>>(part.bsdf).layers().entry_eta;
    if (const auto* m = std::get_if<closures::Subsurface<T>>(&part.from->closure))
      return {under_surface(*m), part.from->flavour, eta};
    return {std::get<closures::FullPrincipled<T>>(part.from->closure), part.from->flavour, eta};
  }

 private:
  /// A normal has derivatives only where numbers have.
  static constexpr bool kTurns = !std::is_same_v<T, S>;
  struct Turning {
    TiltedClosure<S> closure;
    std::array<T, 2> angles;  ///< by which the normal tilts: 0, with their derivatives

    T slopes(const Tilted<S>& x) const requires(kTurns) {
      return chain(angles[0], S(0), x.slope(0)) + chain(angles[1], S(0), x.slope(1));
    }
    Color<T> slopes(const Color<Tilted<S>>& c) const requires(kTurns) {
      return {slopes(c.r), slopes(c.g), slopes(c.b)};
    }
  };
  struct Still {};
  struct Part {
    /// In place: a bsdf is large.
    template <class Bsdf, class... Arguments>
    Part(std::in_place_type_t<Bsdf> kind, const PlacedClosure<T>& from,
         const Arguments&... arguments)
        : bsdf(kind, arguments...), from(&from), n(from.n) {}

    ClosureBsdf<T> bsdf;
    const PlacedClosure<T>* from;
    S estimate = 0;       ///< of what it scatters
    bool slope = false;   ///< carries a derivative
    bool bumped = false;  ///< its normal is not that of the surface
    S pick = 0;
    Vec3<S> n;
    std::conditional_t<kTurns, std::optional<Turning>, Still> turning{};
  };
  static constexpr S kSlopeShare =
      S(0.1);  ///< least share of the samples, of all, with a derivative
  static constexpr S kBelowOne = S(1) - std::numeric_limits<S>::epsilon() / 2;

  template <class OneClosure>
  void add(const OneClosure& m, const PlacedClosure<T>& placed, const SurfacePoint<S>& at) {
    const SurfacePoint<S> point = of_closure(at, placed);
    const auto layers_of = [&](S cos_n) {
      return ClosureLayers<T>(m, placed.weight, placed.flavour, point, cos_n);
    };
    // Highlights of two widths turn with the tangent.
    const auto rotate = [&placed]([[maybe_unused]] PrincipledBsdf<T>& lobes) {
      if constexpr (kTurns) {
        if (!placed.rotating || !lobes.layers_.stretched) return;
        const S along = value_of(T(dot(lobes.frame_.s, *placed.rotating)));
        if (along > S(0))
          lobes.twist_ = with_value(T(dot(lobes.frame_.t, *placed.rotating)) / along, S(0));
      }
    };
    if constexpr (std::is_same_v<OneClosure, closures::Conductor<T>>) {
      PrincipledBsdf<T> lobes(layers_of, placed.flavour, point);
      rotate(lobes);
      Part& part = parts_[count_].emplace(
          std::in_place_type<ConductorBsdf<T>>, placed, lobes,
          ClosureLayers<T>::conductor_fresnel(m, placed.flavour.blender5), at.wi);
      judge(part, lobes.layers(), at);
    } else {
      Part& part = parts_[count_].emplace(std::in_place_type<PrincipledBsdf<T>>, placed, layers_of,
                                          placed.flavour, point);
      rotate(std::get<PrincipledBsdf<T>>(part.bsdf));
      part.bumped = is_bumped(placed);
      judge(part, std::get<PrincipledBsdf<T>>(part.bsdf).layers(), at);
    }
  }
  void judge(Part& part, const Layers<T>& layers, const SurfacePoint<S>& at) {
    emission_ += layers.emission;
    transparency_ += layers.transparency;
    keep(part, layers.scattered(), layers.carries_slope(), at);
  }
  void add(const closures::Translucent<T>& m, const PlacedClosure<T>& placed,
           const SurfacePoint<S>& at) {
    const SurfacePoint<S> point = of_closure(at, placed);
    const Color<T> color = map(m.color, [](const T& c) { return max(c, T(0)); }) * placed.weight;
    const S estimate = mean_channel(value_of(color));
    if (!(estimate >= kLeastWeight) && !has_slope(color)) return;
    Part& part =
        parts_[count_].emplace(std::in_place_type<TranslucentBsdf<T>>, placed, color, point);
    part.bumped = is_bumped(placed);
    keep(part, estimate, has_slope(color), at);
  }
  void add(const closures::Transparent<T>& m, const PlacedClosure<T>& placed,
           const SurfacePoint<S>&) {
    transparency_ += m.color * placed.weight;
  }
  void add(const closures::Emission<T>& m, const PlacedClosure<T>& placed, const SurfacePoint<S>&) {
    emission_ += m.color * (m.strength * placed.weight);
  }
  static constexpr S kLeastWeight = S(1e-5);

  bool is_bumped(const PlacedClosure<T>& placed) const {
    const Vec3<S> apart = placed.n - smooth_;
    return dot(apart, apart) > 0;
  }
  static SurfacePoint<S> of_closure(const SurfacePoint<S>& at, const PlacedClosure<T>& placed) {
    SurfacePoint<S> point = at;
    point.n = placed.n;
    point.tangent = placed.tangent;
    point.smooth = at.n;
    return point;
  }
  void keep(Part& part, S estimate, bool slope, const SurfacePoint<S>& at) {
    part.estimate = estimate;
    const bool moved = part.from->turning || part.from->rotating;
    part.slope = slope || (moved && estimate > 0);
    const bool full = count_ == kMostClosures;  // Cycles leaves out what is too much, too
    if (full || (!(estimate > 0) && !part.slope)) return parts_[count_].reset();
    ++count_;
    if constexpr (kTurns)
      if (part.from->turning) turn(part, *part.from, at);
  }
  void turn(Part& part, const PlacedClosure<T>& placed,
            const SurfacePoint<S>& at) requires(kTurns) {
    const auto frame = Frame<S>::from_normal(placed.n);
    SurfacePoint<S> point = at;
    point.tangent = placed.tangent;
    const auto angle = [&](const Vec3<S>& axis) {
      return with_value(T(dot(axis, *placed.turning)), S(0));
    };
    part.turning.emplace(
        Turning{TiltedClosure<S>(values_as<Tilted<S>>(placed.closure), placed.flavour,
                                 value_of(placed.weight), point, placed.n),
                {angle(frame.s), angle(frame.t)}});
  }
  void choose() {
    scattered_ = 0;
    for (int i = 0; i < count_; ++i) scattered_ += parts_[i]->estimate;
    const S least = scattered_ > 0 ? kSlopeShare * scattered_ : S(1);
    S sum = 0;
    for (int i = 0; i < count_; ++i) {
      Part& part = *parts_[i];
      part.pick = part.slope ? max(part.estimate, least) : part.estimate;
      sum += part.pick;
    }
    if (sum > 0)
      for (int i = 0; i < count_; ++i) parts_[i]->pick /= sum;
  }

  /// What of its diffuse lobes the bumped normal n has too much; see bump_terminator.
  template <class Bsdf>
  Color<T> lost_at_terminator(const Bsdf& bsdf, const Vec3<S>& n, const Vec3<S>& wo) const {
    if constexpr (requires { bsdf.layers(); })
      if (!bsdf.layers().has(kDiffuse) && !bsdf.layers().has_top_lobe()) return {};
    Color<T> diffuse;
    S unused;
    bsdf.seen_by(kDiffuseRay).value_and_density(wo, diffuse, unused);
    return diffuse * (bump_terminator(smooth_, n, wo) - 1);
  }
  void add_all_but(int left_out, const Vec3<S>& wo, Color<T>& f, S& p) const {
    for (int i = 0; i < count_; ++i) {
      if (i == left_out) continue;
      const Part& part = *parts_[i];
      std::visit(
          [&](const auto& b) {
            Color<T> g;
            S q;
            b.value_and_density(wo, g, q);
            f += g;
            p += part.pick * q;
            if (part.bumped) f += lost_at_terminator(b, part.n, wo);
          },
          part.bsdf);
      if constexpr (kTurns)
        if (part.turning) f += part.turning->slopes(part.turning->closure.value(wo));
    }
  }

  Vec3<S> ng_, smooth_;
  int count_ = 0;
  std::array<std::optional<Part>, kMostClosures + 1> parts_;  ///< the last one is never kept
  Color<T> emission_{}, transparency_{};
  S scattered_ = 0;
};

}  // namespace selenite
