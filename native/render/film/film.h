// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "math/color.h"

namespace selenite {

/// A picture: height x width, row 0 at the top.
using Picture = std::vector<Colorf>;

/// Derivative pictures of one slot (see SlotLayout), all over the samples of one pixel.
struct SlotFilm {
  Picture mean;        ///< d(radiance)/d(parameter)
  Picture half_a;      ///< the same over the even samples only
  Picture variance;    ///< of `mean`
  Picture covariance;  ///< of `mean` with the image's mean: what makes a product of both unbiased
  Picture aim_excess;  ///< see Film
  /// The share of `mean` and `half_a` along paths that end at the first surface; empty: not known apart.
  Picture direct, direct_half_a;
};

/// What a render gives. Samples are independent, so the two halves are too; the half over the odd
/// samples follows from mean and half_a (`half_b`).
struct Film {
  Film() = default;
  Film(int width, int height, int spp, int slot_count = 0)
      : width(width), height(height), spp(spp), slots(slot_count) {
    const auto size = static_cast<std::size_t>(width) * height;
    for (Picture* picture : {&mean, &half_a, &variance}) picture->resize(size);
    for (SlotFilm& slot : slots)
      for (Picture* picture : {&slot.mean, &slot.half_a, &slot.variance, &slot.covariance})
        picture->resize(size);
  }

  int width = 0, height = 0, spp = 0;
  int lanes = 1;  ///< paths that were traced in lockstep
  Picture mean;
  Picture half_a;    ///< mean over the even samples
  Picture variance;  ///< of `mean`; 0 where spp is 1
  std::vector<SlotFilm> slots;
  std::int64_t dropped = 0;    ///< samples left out because a value was not finite
  std::string first_dropped;   ///< pixel, sample and what was not finite
  std::int64_t truncated = 0;  ///< paths ended by the hard limit on their length
  /// Where paths that are traced alone were scattered or ended, and the places on surfaces that they
  /// looked at on the way to lamps that they aim at.
  std::int64_t vertices = 0, exits = 0;
  /// By how much larger `variance` would be if paths found these lamps by chance alone; only of a pilot.
  Picture aim_excess;
  double seconds = 0, cpu_seconds = 0;

  std::size_t size() const { return mean.size(); }
  void make_room_for_excess() {
    aim_excess.resize(size());
    for (SlotFilm& slot : slots) slot.aim_excess.resize(size());
  }
  /// Mean over the odd samples of a pixel, from the mean over all and over the even ones.
  Colorf half_b(const Colorf& mean, const Colorf& half_a) const {
    const int even = (spp + 1) / 2, odd = spp / 2;
    return (mean * static_cast<float>(spp) - half_a * static_cast<float>(even)) /
           static_cast<float>(odd);
  }
};

}  // namespace selenite
