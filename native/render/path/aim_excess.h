// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <vector>

#include "render/derivatives/throughput.h"

namespace selenite {

/// By how much the square of a path's radiance, and of its derivatives, would be larger on average if
/// chance alone found the lamps that the path aims at.
///
/// What a way F to a lamp brings is X = w F / p with the weight w of the technique, whose density is p.
/// Chance alone, of density q, would bring Y = F / q. The second moment of Y is the mean of X Y over both
/// techniques, so X Y - X^2 = X^2 (p / (w q) - 1) is summed. Products of two ways are left out.
template <int L>
class AimExcess {
 public:
  Colorf value;
  std::vector<Colorf> slope;

  void start(int slots) {
    value = {};
    slope.assign(slots, Colorf());
  }
  /// `rarer`: Y / X of what `after` has beyond `before`.
  void add(const Radiance<L>& before, const Radiance<L>& after, float rarer) {
    const auto squared = [&](const Colorf& x) { return x * x * (rarer - 1); };
    value += squared(after.value - before.value);
    for (std::size_t s = 0; s < slope.size(); ++s)
      slope[s] += squared(after.slope[static_cast<int>(s)] - before.slope[static_cast<int>(s)]);
  }
};

/// How much rarer the ways that were just followed are by chance alone.
struct Rarity {
  float rarer = 1;
  /// The share of a technique in what all techniques find together, for a way that chance has found.
  float of_share(float share) {
    if (share > kLeastShare) rarer = std::max(rarer, 1 / share);
    return share;
  }

 private:
  static constexpr float kLeastShare = 1e-6f;
};

}  // namespace selenite
