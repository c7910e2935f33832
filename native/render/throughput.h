// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cmath>

#include "math/color.h"
#include "math/dual.h"
#include "render/slots.h"
#include "render/tape.h"

namespace selenite {

/// A colour and its derivatives in the few slots that it depends on: what a surface, a lamp or the
/// world contributes to a path. K bounds the slots of one such owner.
template <int K>
struct Factor {
  Colorf value;
  int count = 0;
  std::array<int, K> slot{};
  std::array<Colorf, K> slope{};

  void add_slope(int s, const Colorf& d) {
    if constexpr (K > 0) {
      slot[count] = s;
      slope[count++] = d;
    }
  }
};

/// A colour and its derivatives in all slots of a render, updated by the product rule
/// d(ab) = da b + a db. Nothing is divided by a factor, so a black one keeps its derivative.
template <int K>
class Throughput : public SinceEvent<K == kTaped> {
 public:
  explicit Throughput(int slots) : slots_(K > 0 ? slots : 0) {}

  Colorf value{1, 1, 1};
  std::array<Colorf, K == 0 ? 1 : kMaxSlots> slope{};

  /// A copy for the way to a light.
  Throughput branch() const {
    Throughput copy = *this;
    copy.branches();
    return copy;
  }
  void multiply(float f) {
    value = value * f;
    for (int s = 0; s < slots_; ++s) slope[s] = slope[s] * f;
    Since::multiply(f);
  }
  void multiply(const Factor<K>& f) {
    for (int s = 0; s < slots_; ++s) slope[s] = slope[s] * f.value;
    for (int k = 0; k < f.count; ++k) slope[f.slot[k]] += value * f.slope[k];
    value = value * f.value;
    Since::multiply(f.value);
  }
  /// A factor whose derivatives are those of `count` parts, each times `scale`.
  void multiply(const Colorf& f, const Factor<K>* parts, int count, float scale) {
    for (int s = 0; s < slots_; ++s) slope[s] = slope[s] * f;
    for (int i = 0; i < count; ++i)
      for (int k = 0; k < parts[i].count; ++k)
        slope[parts[i].slot[k]] += value * parts[i].slope[k] * scale;
    value = value * f;
    Since::multiply(f);
  }
  /// A factor that depends on what `count` fields of unknowns hold at `position`: it goes on the
  /// tape, and its derivative into the one slot that there is.
  void multiply_recorded(const Colorf& f, const FieldSlope* slopes, int count,
                         const Vec3f& position) requires(K == kTaped) {
    if (this->is_branch) {
      this->tape->record_on_branch(value, this->after, f, slopes, count, position);
      Since::multiply(f);
      this->after = Colorf(1);
    } else {
      this->tape->record(value, this->since, f, slopes, count, position);
      this->since = Colorf(1);
    }
    slope[0] = slope[0] * f;
    for (int i = 0; i < count; ++i) slope[0] += value * slopes[i].slope * slopes[i].unit;
    value = value * f;
  }
  /// Largest of the value and its derivatives: what Russian roulette may not throw away.
  float importance() const {
    float most = max_channel(value);
    if constexpr (K > 0)
      for (int s = 0; s < slots_; ++s)
        for (int c = 0; c < 3; ++c) most = std::max(most, std::abs(slope[s][c]));
    return most;
  }
  int slots() const { return slots_; }

 private:
  using Since = SinceEvent<K == kTaped>;
  int slots_;
};

/// What a path brings to its pixel: sum of throughput times emission, with derivatives.
template <int K>
class Radiance {
 public:
  explicit Radiance(int slots) : slots_(K > 0 ? slots : 0) {}

  Colorf value;
  std::array<Colorf, K == 0 ? 1 : kMaxSlots> slope{};

  void add(const Throughput<K>& t, const Factor<K>& emitted, float weight) {
    const Colorf e = emitted.value * weight;
    value += t.value * e;
    if constexpr (K == kTaped) t.bring(e);
    for (int s = 0; s < slots_; ++s) slope[s] += t.slope[s] * e;
    for (int k = 0; k < emitted.count; ++k)
      slope[emitted.slot[k]] += t.value * emitted.slope[k] * weight;
  }
  /// The same with one more factor, a bsdf's value, between throughput and emission.
  void add(const Throughput<K>& t, const Factor<K>& f, const Factor<K>& emitted, float weight) {
    const Colorf e = emitted.value * weight, fe = f.value * e;
    value += t.value * fe;
    if constexpr (K == kTaped) t.bring(fe);
    for (int s = 0; s < slots_; ++s) slope[s] += t.slope[s] * fe;
    for (int k = 0; k < f.count; ++k) slope[f.slot[k]] += t.value * f.slope[k] * e;
    for (int k = 0; k < emitted.count; ++k)
      slope[emitted.slot[k]] += t.value * f.value * emitted.slope[k] * weight;
  }

 private:
  int slots_;
};

}  // namespace selenite
