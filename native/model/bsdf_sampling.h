// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "model/bsdf.h"

// How the Principled BSDF draws a direction: each lane from a lobe of its own; then all lanes weigh
// all lobes at the directions they have got, once.
namespace selenite {

/// The lobe that each lane draws from.
template <class T>
struct PrincipledBsdf<T>::Choice {
  std::array<mask_t<S>, kLobes> lobe{};
  S left;  ///< what the lobes before it have left of the random number
};

/// A direction before its weight is known.
template <class T>
struct PrincipledBsdf<T>::Proposal {
  Vec3<S> wo{};
  DrawnNormal<S> drawn;
  S cos_m{};  ///< the micronormal's to the viewer
  mask_t<S> exists = false, singular = false, transmits = false, diffuse = false;
};

template <class T>
inline auto PrincipledBsdf<T>::choose(const S& u_lobe) const -> Choice {
  using Mask = mask_t<S>;
  Choice choice{.left = u_lobe};
  Mask undecided = true;
  int last = -1;
  for (int k = 0; k < kLobes && any(undecided); ++k) {
    if (!layers_.present[k]) continue;
    last = k;
    const Mask beyond = undecided & (choice.left >= layers_.pick[k]);
    choice.lobe[k] = undecided & !beyond;
    choice.left = select(beyond, S(choice.left - layers_.pick[k]), choice.left);
    undecided = beyond;
  }
  // Rounding of the sum: the last lobe that is drawn at all.
  for (int k = last; k >= 0 && any(undecided); --k) {
    const Mask taken = undecided & (layers_.pick[k] > S(0));
    choice.lobe[k] = choice.lobe[k] | taken;
    undecided = undecided & !taken;
  }
  return choice;
}

template <class T>
inline BsdfSample<T> PrincipledBsdf<T>::draw(S u_lobe, S u1, S u2) const {
  const Choice choice = choose(u_lobe);
  Proposal proposal;
  if constexpr (!kIsLanes<S>) {
    if (choice.lobe[kSubsurface]) return enter(choice.left / layers_.pick[kSubsurface], u1, u2);
    for_each_top_lobe(layers_.top, [&](int i, const auto& lobe) {
      if (!choice.lobe[kFirstTopLobe + i]) return;
      proposal.wo = lobe.sample(u1, u2);
      proposal.exists = proposal.diffuse = true;
    });
    if (proposal.exists) return weigh(proposal);
  }
  if (const mask_t<S>& diffuse = choice.lobe[kDiffuse]; active_.some(diffuse)) {
    const Frame<S> frame = Frame<S>::from_normal(point_.n);
    proposal.wo = frame.to_world(square_to_cosine_hemisphere(u1, u2));
    proposal.exists = proposal.diffuse = diffuse;
  }
  mirror_or_refract(choice, u1, u2, proposal);
  return weigh(proposal);
}

/// Directions by way of micronormals, for the lanes that have chosen a lobe that has them.
template <class T>
inline void PrincipledBsdf<T>::mirror_or_refract(const Choice& choice, const S& u1, const S& u2,
                                                 Proposal& proposal) const {
  using std::sqrt;
  using Mask = mask_t<S>;
  const Mask &glass = choice.lobe[kGlass], &coat = choice.lobe[kCoat];
  const Mask chosen = choice.lobe[kSpecular] | choice.lobe[kMetal] | glass | coat;
  if (!active_.some(chosen)) return;
  // Where refraction has a width of its own, in version 1, its share is fixed.
  Mask refracted = false;
  if (layers_.version1)
    refracted = glass & (choice.left >= layers_.pick[kGlass] * layers_.macro_reflected);
  Mask by_through = refracted;
  if (layers_.glass_apart()) by_through = by_through | glass;
  const Mask mirror = select(coat, Mask(coat_.singular),
                             select(by_through, Mask(through_.singular), Mask(base_.singular)));
  Vec3<S> m{S(0), S(0), S(1)};
  if (active_.some(chosen & !mirror)) {
    const S width2 =
        select(coat, S(coat_.width2), select(by_through, S(through_.width2), S(base_.width2)));
    m = select(mirror, m, ggx_sample_visible(wi_, S(sqrt(width2)), u1, u2));
    if constexpr (!kIsLanes<S>)
      if (layers_.stretched && !mirror && !coat && !by_through) {
        const S width = sqrt(width2), root = sqrt(value_of(layers_.stretch));
        m = ggx_sample_stretched(wi_, S(width / root), S(width * root), u1, u2);
      }
  }
  const S cos_m = dot(wi_, m);
  Mask exists = chosen & faced() & (cos_m > S(0));
  if (!active_.some(exists)) return;
  if (!layers_.version1 && active_.some(exists & glass))
    refracted = glass & (choice.left >= layers_.pick[kGlass] * layers_.reflected_share(cos_m));

  Vec3<S> o{};
  Mask singular = mirror;
  if (active_.some(exists & !refracted)) o = m * (2 * cos_m) - wi_;
  if (active_.some(exists & refracted)) {
    const R eta = value_of(layers_.eta), e = (eta - 1) * (eta + 1);
    const S g2 = e + cos_m * cos_m;
    exists = exists & ((!refracted) | (g2 > S(0)));
    const S bend = -e / (cos_m + sqrt(g2));  // cos_m - eta cos_t without its cancellation
    o = select(refracted, (m * bend - wi_) / eta, o);
    singular = select(refracted, Mask(through_.singular || bends_nothing(eta)), singular);
  }
  proposal.wo = select(chosen, normalize(frame_.to_world(o)), proposal.wo);
  proposal.drawn = {m, Mask(chosen & !singular)};
  proposal.cos_m = cos_m;
  proposal.exists = proposal.exists | exists;
  proposal.singular = chosen & singular;
  proposal.transmits = chosen & refracted;
}

template <class T>
inline BsdfSample<T> PrincipledBsdf<T>::weigh(const Proposal& proposal) const {
  using Mask = mask_t<S>;
  const Mask &singular = proposal.singular, &transmits = proposal.transmits;
  BsdfSample<T> s{.wo = proposal.wo,
                  .density = S(0),
                  .weight = {},
                  .singular = singular,
                  .transmits = transmits,
                  .diffuse = proposal.diffuse,
                  .exists = false};
  // Along the surface there is no mirror image, yet other light may be reflected there.
  const S height = dot(point_.ng, proposal.wo);
  const Mask behind = height < S(0);
  const Mask before = select(singular, height > S(0), Mask(!behind));
  Mask exists = proposal.exists & select(transmits, behind, before);
  if (blender5_)  // which draws on the same side of the bent normal
    exists = exists & (proposal.diffuse | !(transmits ^ (dot(frame_.n, proposal.wo) < S(0))));
  Color<T> f{};
  if (active_.some(exists & !singular)) evaluate<true, true>(s.wo, proposal.drawn, f, s.density);
  if (active_.some(exists & singular)) weigh_singular(proposal, f, s.density);
  s.exists = exists & (s.density > S(0));
  if (active_.some(s.exists)) s.weight = f / s.density;
  return s;
}

/// Value and probability of a direction that only mirrors send light to, in the lanes that have one.
template <class T>
inline void PrincipledBsdf<T>::weigh_singular(const Proposal& proposal, Color<T>& f, S& p) const {
  const S cos_m = select(proposal.singular, proposal.cos_m, S(1));
  const mask_t<S> through = proposal.singular & proposal.transmits;
  const mask_t<S> mirrored = proposal.singular & !proposal.transmits;
  if (active_.some(mirrored)) {
    // Every mirror sends the light the same way: one direction, the sum of their values.
    Color<T> sum{};
    S probability = 0;
    if (base_.singular) {
      sum += layers_.base_reflectance(cos_m);
      probability += layers_.base_reflection_pick(cos_m);
    }
    if (layers_.glass_apart() && through_.singular) {
      sum += layers_.glass_at(cos_m);
      probability += layers_.pick[kGlass] * layers_.reflected_share(cos_m);
    }
    if (layers_.has(kCoat) && coat_.singular) {
      sum += layers_.coat.at(cos_m);
      probability += layers_.pick[kCoat];
    }
    f = select(mirrored, sum, f);
    p = select(mirrored, probability, p);
  }
  if (active_.some(through)) {
    f = select(through, layers_.glass_passing(cos_m), f);
    p = select(through, S(layers_.pick[kGlass] * (1 - layers_.reflected_share(cos_m))), p);
  }
}

/// Density of the direction o in which light enters by refraction, whose micronormal m may be known;
/// local frame.
template <class X, class S>
X entry_density(const Vec3<S>& wi, const S& cos_i, const Vec3<S>& o, const Vec3<S>* m,
                const X& width2, const X& eta) {
  const Refraction<X> g(wi, o, eta, m);
  return X(refracted_flow(cos_i, X(ggx_normals(g.r2, g.z2, width2)), g, eta) /
           (ggx_lambda(tangent2(wi), width2) + S(1)));
}

/// Refraction at a visible micronormal without Fresnel term, masking or shadowing; for skin every
/// second time along a cosine lobe instead.
template <class T>
inline BsdfSample<T> PrincipledBsdf<T>::enter(S u, S u1, S u2) const requires(!kIsLanes<T>) {
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
  return {.wo = wo,
          .density = 0,
          .weight = layers_.subsurface * change / layers_.pick[kSubsurface],
          .singular = false,
          .transmits = true,
          .enters = true,
          .exists = dot(point_.ng, wo) < 0};
}

/// 1, with the relative derivative of the density of the refracted direction o: the direction is
/// drawn from a distribution that is not divided out again. A mirror-like entry has none, and that
/// of skin is left out: its micronormals end abruptly at the horizon, so that their image moves.
template <class T>
inline T PrincipledBsdf<T>::entry_change(const Vec3<S>& o, const Vec3<S>& m) const
    requires(!kIsLanes<T>) {
  const T &width2 = layers_.entry_width2, &eta = layers_.entry_eta;
  if constexpr (std::is_same_v<T, S>) {
    return 1;
  } else {
    if (skin_ || (!has_slope(width2) && !has_slope(eta)) || width2.v <= S(kSingularWidth2))
      return T(1);
    const T density = narrow(width2, eta, [&](const auto& w2, const auto& n) {
      return entry_density(wi_, cos_i_, o, &m, w2, n);
    });
    return density.v > 0 ? with_value(density / density.v, S(1)) : T(1);
  }
}

}  // namespace selenite
