// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <limits>

#include "math/sampling.h"
#include "render/lanes/lane_light.h"
#include "render/lanes/lane_random.h"
#include "render/media/media_stack.h"
#include "render/path/dimension.h"

// Free flights of eight paths in one homogeneous medium: what MediaStack does for one path.
namespace selenite {

/// Where flights end.
struct LaneFlight {
  LaneMask scatters;  ///< before they arrive
  Lanes length;
};

/// By which share of the flights a channel draws the length.
template <int L>
Color<Lanes> channel_shares(const Color<Lanes>& throughput) {
  const Lanes sum = throughput.r + throughput.g + throughput.b;
  // Derivatives may live in a channel whose light is gone.
  const Lanes scale = (L > 0 ? 0.9f : 1.0f) / sum;
  const Color<Lanes> share = throughput * scale + Color<Lanes>(Lanes(L > 0 ? 0.1f / 3 : 0.0f));
  return masked(sum > 0, share, 1.0f / 3);
}

/// Lengths of flights from the surfaces that the rays have left.
template <int L>
Lanes draw_flight(const PreparedMaterial<L>& medium, const Color<Lanes>& throughput,
                  const LaneRandom& random) {
  const Color<Lanes> share = channel_shares<L>(throughput);
  const Colorf& rate = medium.typical_rate;
  const Lanes u = random.uniform(kFreeChannel);
  const Lanes chosen =
      select(u < share.r, Lanes(rate.r), select(u < share.r + share.g, Lanes(rate.g), rate.b));
  return select(chosen > 0, exponential(random.uniform(kFreePath)) / chosen,
                Lanes(std::numeric_limits<float>::infinity()));
}

inline Lanes transmittance(float sigma, const Lanes& length) {
  return sigma == 0 ? Lanes(1) : exp(length * -sigma);
}
inline Color<Lanes> transmittance(const Colorf& sigma, const Lanes& length) {
  Color<Lanes> through(transmittance(sigma.r, length));
  if (sigma.g != sigma.r) through.g = transmittance(sigma.g, length);
  if (sigma.b != sigma.r) through.b = transmittance(sigma.b, length);
  return through;
}

/// Flies the lengths that were drawn, at most `distance`, weighted for all channels (balance
/// heuristic). `beta` takes what is carried, with the scattering coefficient where light is scattered.
template <int L>
LaneFlight fly(const PreparedMaterial<L>& medium, const LaneMask& flying, const Lanes& drawn,
               const Lanes& distance, const Lanes& beside, LaneThroughput<L>& beta) {
  const Lanes whole = distance + beside, flown = min(drawn, whole);
  LaneFlight flight{flying & (drawn < whole), max(flown - beside, Lanes(0))};
  const Colorf& rate = medium.typical_rate;
  const Color<Lanes> share = channel_shares<L>(beta.value), through = transmittance(rate, flown);
  Lanes density(0);
  for (int c = 0; c < 3; ++c)
    density +=
        select(share[c] > 0, share[c] * select(flight.scatters, through[c] * rate[c], through[c]),
               Lanes(0));
  const Lanes inverse = Lanes(1) / density;

  const auto& sigma_t = medium.values.extinction;
  const Colorf sigma = value_of(sigma_t);
  const Color<Lanes> left = sigma == rate ? through : transmittance(sigma, flown);
  const Color<Lanes> scattering = lanes_of(value_of(medium.sigma_s));
  if constexpr (L == 0) {
    beta.multiply(flying, left * masked(flight.scatters, scattering, 1) * inverse);
  } else {
    // An endless way: nothing is left, and nothing of a derivative.
    const LaneMask endless = flown == std::numeric_limits<float>::infinity();
    Color<LaneScalar<L>> factor;
    for (int c = 0; c < 3; ++c) {
      const auto& [sigma_s, t] = std::tie(medium.sigma_s[c], left[c]);
      const Lanes slope = select(endless, Lanes(0), -flown * t);
      const Lanes s = select(flight.scatters, scattering[c], Lanes(1)) * inverse;
      const Lanes rest = select(flight.scatters, t, Lanes(0)) * inverse;
      factor[c].v = t * s;
      for (int k = 0; k < medium.count; ++k)
        factor[c].d[k] = slope * s * sigma_t[c].d[k] + rest * sigma_s.d[k];
    }
    beta.multiply(flying, medium, factor);
  }
  return flight;
}

}  // namespace selenite
