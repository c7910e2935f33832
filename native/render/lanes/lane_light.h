// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/dual.h"
#include "math/lanes.h"
#include "render/prepared/prepared.h"

// What eight paths carry: `Throughput` and `Radiance` lane by lane. Every operation is for the lanes of
// a mask and leaves the others as they are; these may hold anything, so they are left by `select`.
namespace selenite {

/// Eight floats without derivatives, or eight duals with L local slots.
template <int L>
using LaneScalar = std::conditional_t<L == 0, Lanes, Dual<Lanes, L == 0 ? 1 : L>>;

/// Color of lanes where the mask is set, else `other`.
inline Color<Lanes> masked(const LaneMask& mask, const Color<Lanes>& c, float other) {
  return {select(mask, c.r, other), select(mask, c.g, other), select(mask, c.b, other)};
}
inline Color<Lanes> lanes_of(const Colorf& c) { return {c.r, c.g, c.b}; }

/// Adds `others` times the derivatives of f to the slots of a material.
template <int L>
void add_slopes_of(const LaneMask& mask, const PreparedMaterial<L>& owner,
                   const Color<Lanes>& others, const Color<LaneScalar<L>>& f, Color<Lanes>* slots) {
  if constexpr (L > 0)
    for (int k = 0; k < owner.count; ++k)
      for (int c = 0; c < 3; ++c)
        slots[owner.first + k][c] += others[c] * select(mask, f[c].d[k], 0);
}

template <int L>
class LaneThroughput {
 public:
  explicit LaneThroughput(int slots) : slots_(L > 0 ? slots : 0) {}

  Color<Lanes> value;
  const Color<Lanes>& slope(int slot) const { return slope_[slot]; }
  int slots() const { return slots_; }

  void start(int lane) {
    for (int c = 0; c < 3; ++c) value[c].set(lane, 1);
    for (int s = 0; s < slots_; ++s)
      for (int c = 0; c < 3; ++c) slope_[s][c].set(lane, 0);
  }
  void multiply(const LaneMask& mask, const Lanes& f) { scale(Color<Lanes>(select(mask, f, 1))); }
  void multiply(const LaneMask& mask, const Color<Lanes>& f) { scale(masked(mask, f, 1)); }
  /// A factor with derivatives by the ticked parameters of one material.
  void multiply(const LaneMask& mask, const PreparedMaterial<L>& owner,
                const Color<LaneScalar<L>>& f) {
    const Color<Lanes> before = value;
    multiply(mask, value_of(f));
    add_slopes(mask, owner, before, f);
  }
  /// What the derivatives of a factor add, where the value was `before` it.
  void add_slopes(const LaneMask& mask, const PreparedMaterial<L>& owner,
                  const Color<Lanes>& before, const Color<LaneScalar<L>>& f) {
    add_slopes_of(mask, owner, before, f, slope_);
  }
  /// See Throughput.
  Lanes importance(const SlotScales& scales) const {
    Lanes most = max_channel(value);
    for (int s = 0; s < slots_; ++s)
      for (int c = 0; c < 3; ++c) most = max(most, abs(slope_[s][c]) * scales[s]);
    return most;
  }

 private:
  void scale(const Color<Lanes>& f) {
    value *= f;
    for (int s = 0; s < slots_; ++s) slope_[s] *= f;
  }

  int slots_;
  Color<Lanes> slope_[L > 0 ? kMaxSlots : 1];
};

template <int L>
class LaneRadiance {
 public:
  explicit LaneRadiance(int slots) : slots_(L > 0 ? slots : 0) {}

  Color<Lanes> value;
  const Color<Lanes>& slope(int slot) const { return slope_[slot]; }

  void start(int lane) {
    for (int c = 0; c < 3; ++c) value[c].set(lane, 0);
    for (int s = 0; s < slots_; ++s)
      for (int c = 0; c < 3; ++c) slope_[s][c].set(lane, 0);
  }
  /// The radiance `e` that arrives after a throughput; 0 in lanes where nothing does.
  void add(const LaneThroughput<L>& t, const Color<Lanes>& e) {
    value += t.value * e;
    for (int s = 0; s < slots_; ++s) slope_[s] += t.slope(s) * e;
  }
  /// What the derivatives of a lamp or the world add; `f` is all that its radiance is multiplied by.
  void add_slopes(const Factor<L>& emitted, const Color<Lanes>& f) {
    if constexpr (L > 0)
      for (int k = 0; k < emitted.count; ++k)
        for (int c = 0; c < 3; ++c) slope_[emitted.first + k][c] += f[c] * emitted.slope[c][k];
  }
  /// The same of a bsdf's value.
  void add_slopes(const LaneMask& mask, const PreparedMaterial<L>& owner,
                  const Color<Lanes>& others, const Color<LaneScalar<L>>& f) {
    add_slopes_of(mask, owner, others, f, slope_);
  }

 private:
  int slots_;
  Color<Lanes> slope_[L > 0 ? kMaxSlots : 1];
};

}  // namespace selenite
