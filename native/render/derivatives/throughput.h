// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "math/color.h"
#include "math/dual.h"
#include "render/derivatives/tape.h"
#include "render/film/slots.h"

namespace selenite {

/// A colour and its derivatives in the few slots of the one that it depends on: a surface, a lamp or the
/// world. These slots follow each other. K bounds their number.
template <int K>
struct Factor {
  Colorf value;
  int first = 0;  ///< slot of the first derivative
  int count = 0;
  std::array<std::array<float, K>, 3> slope{};  ///< channel by channel; 0 from `count` on

  void set_slope(int k, const Colorf& d) {
    if constexpr (K > 0)
      for (int c = 0; c < 3; ++c) slope[c][k] = d[c];
  }
};

/// Derivatives of one owner are added by so many at once: room for them behind the last slot.
inline constexpr int kSlotStep = 4;

/// A number for every slot; 0 beyond those in use.
using SlotScales = std::array<float, kMaxSlots + kSlotStep>;

/// Derivatives of a colour in all slots of a render: channel by channel, by fours, which compilers
/// turn into vector instructions. Only the fours in use are ever touched.
class SlotSlopes {
 public:
  explicit SlotSlopes(int slots) : fours_((slots + 3) / 4) {
    for (int c = 0; c < 3; ++c)
      for (int i = 0; i < 4 * fours_; ++i) channel_[c][i] = 0;
  }
  SlotSlopes(const SlotSlopes& o) : fours_(o.fours_) { copy(o); }
  SlotSlopes& operator=(const SlotSlopes& o) {
    if (this == &o) return *this;
    fours_ = o.fours_;
    copy(o);
    return *this;
  }

  Colorf operator[](int s) const { return {channel_[0][s], channel_[1][s], channel_[2][s]}; }
  void add(int s, const Colorf& d) {
    for (int c = 0; c < 3; ++c) channel_[c][s] += d[c];
  }
  /// Adds the derivatives of one owner times `f`.
  template <int K>
  void add(const Factor<K>& o, const Colorf& f) {
    constexpr int kStep = std::min(K, kSlotStep);
    for (int c = 0; c < 3; ++c) {
      float* to = channel_[c] + o.first;
      for (int start = 0; start < o.count; start += kStep)
        for (int k = start; k < start + kStep; ++k) to[k] += o.slope[c][k] * f[c];
    }
  }
  void scale(const Colorf& f) {
    each(*this, [&](float& x, float, int c) { x *= f[c]; });
  }
  /// Adds `o` times `f`.
  void add(const SlotSlopes& o, const Colorf& f) {
    each(o, [&](float& x, float y, int c) { x += y * f[c]; });
  }
  /// The largest, whatever its sign.
  float largest() const {
    float most = 0;
    for (int c = 0; c < 3; ++c)
      for (int i = 0; i < 4 * fours_; ++i) most = std::max(most, std::abs(channel_[c][i]));
    return most;
  }
  /// The same, each times a number of its slot.
  float largest(const SlotScales& scales) const {
    float most = 0;
    for (int c = 0; c < 3; ++c)
      for (int i = 0; i < 4 * fours_; ++i)
        most = std::max(most, std::abs(channel_[c][i]) * scales[i]);
    return most;
  }

 private:
  void copy(const SlotSlopes& o) {
    each(o, [](float& x, float y, int) { x = y; });
  }
  template <class F>
  void each(const SlotSlopes& o, F&& f) {
    for (int c = 0; c < 3; ++c)
      for (int four = 0; four < fours_; ++four)
        for (int i = 4 * four; i < 4 * four + 4; ++i) f(channel_[c][i], o.channel_[c][i], c);
  }

  int fours_;
  alignas(16) float channel_[3][kMaxSlots + kSlotStep];
};
/// Of the kernel without derivatives.
struct NoSlopes {
  explicit NoSlopes(int) {}
  Colorf operator[](int) const { return {}; }
  void add(int, const Colorf&) {}
  template <int K>
  void add(const Factor<K>&, const Colorf&) {}
  void scale(const Colorf&) {}
  void add(const NoSlopes&, const Colorf&) {}
  float largest() const { return 0; }
  float largest(const SlotScales&) const { return 0; }
};
template <int K>
using Slopes = std::conditional_t<K == 0, NoSlopes, SlotSlopes>;

/// A colour and its derivatives in all slots of a render, updated by the product rule
/// d(ab) = da b + a db. Nothing is divided by a factor, so a black one keeps its derivative.
template <int K>
class Throughput : public SinceEvent<is_taped(K)> {
 public:
  explicit Throughput(int slots) : slope(slots) {}

  Colorf value{1, 1, 1};
  Slopes<K> slope;

  /// A copy for the way to a light.
  Throughput branch() const {
    Throughput copy = *this;
    copy.branches();
    return copy;
  }
  void multiply(float f) {
    value = value * f;
    slope.scale(Colorf(f));
    Since::multiply(f);
  }
  void multiply(const Factor<K>& f) { multiply(f.value, &f, 1, 1); }
  /// A factor whose derivatives are those of `count` parts, each times `scale`.
  void multiply(const Colorf& f, const Factor<K>* parts, int count, float scale) {
    slope.scale(f);
    for (int i = 0; i < count; ++i) slope.add(parts[i], value * scale);
    value = value * f;
    Since::multiply(f);
  }
  /// A factor that depends on what `count` fields of unknowns hold: it goes on the tape, and its
  /// derivative into the one slot that there is.
  void multiply_recorded(const Colorf& f, const FieldSlope* slopes,
                         int count) requires(is_taped(K)) {
    if (this->is_branch) {
      this->tape->record_on_branch(value, this->after, f, slopes, count);
      Since::multiply(f);
      this->after = Colorf(1);
    } else {
      this->tape->record(value, this->since, f, slopes, count);
      this->since = Colorf(1);
    }
    slope.scale(f);
    for (int i = 0; i < count; ++i) slope.add(0, value * slopes[i].slope * slopes[i].unit);
    value = value * f;
  }
  /// Largest of the value and its derivatives: 0 if the path has nothing to bring any more.
  float importance() const { return std::max(max_channel(value), slope.largest()); }
  /// The same with derivatives scaled: what Russian roulette goes by.
  float importance(const SlotScales& scales) const {
    return std::max(max_channel(value), slope.largest(scales));
  }

 private:
  using Since = SinceEvent<is_taped(K)>;
};

/// What a path brings to its pixel: sum of throughput times emission, with derivatives.
template <int K>
class Radiance {
 public:
  explicit Radiance(int slots) : slope(slots) {}

  Colorf value;
  Slopes<K> slope;

  void add(const Throughput<K>& t, const Factor<K>& emitted, float weight) {
    const Colorf e = emitted.value * weight;
    value += t.value * e;
    if constexpr (is_taped(K)) t.bring(e);
    slope.add(t.slope, e);
    slope.add(emitted, t.value * weight);
  }
  /// The same with one more factor, a bsdf's value, between throughput and emission.
  void add(const Throughput<K>& t, const Factor<K>& f, const Factor<K>& emitted, float weight) {
    const Colorf e = emitted.value * weight, fe = f.value * e;
    value += t.value * fe;
    if constexpr (is_taped(K)) t.bring(fe);
    slope.add(t.slope, fe);
    slope.add(f, t.value * e);
    slope.add(emitted, t.value * f.value * weight);
  }
};

}  // namespace selenite
