// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include "math/rng.h"
#include "math/sampling.h"
#include "model/medium.h"
#include "model/subsurface.h"
#include "scene/geometry.h"

namespace selenite {

/// Where a walk under the surface comes out and what it has kept of its light.
template <class T>
struct WalkExit {
  Hit hit;
  Vec3f direction;  ///< of the last flight, out of the object
  Color<T> weight;
};

/// Derivative of the logarithm of Henyey and Greenstein's phase function, with respect to g.
inline float henyey_greenstein_slope(float g, float cosine) {
  return -2 * g / (1 - g * g) - 3 * (g - cosine) / (1 + g * g - 2 * g * cosine);
}

/// Random walk in a homogeneous medium inside one instance, until it meets the surface again; empty
/// if it takes more than 256 flights, as in Cycles.
///
/// The distance of a flight is drawn for one channel and weighted for all (balance heuristic). The
/// medium has no position, so a whole walk is known by the number n and the length l of its flights:
/// its weight is sigma_s^n exp(-sigma_t l), and so are its derivatives. After nine scatterings the
/// phase function is isotropic and the coefficients are reduced by similarity, as in Cycles.
template <class T>
class RandomWalk {
 public:
  explicit RandomWalk(const SubsurfaceMedium<T>& medium) : medium_(medium) {
    const float g = value_of(medium.anisotropy);
    for (int c = 0; c < 3; ++c) {
      const float t = value_of(medium.sigma_t[c]), s = t * value_of(medium.albedo[c]);
      stages_[0].sigma_t[c] = t;
      stages_[0].sigma_s[c] = s;
      stages_[1].sigma_t[c] = t - s * g;
      stages_[1].sigma_s[c] = s * (1 - g);
    }
  }

  /// Starts at `surface`, a point of the instance, towards `direction` behind it. `dimension`: first
  /// of the random numbers that the walk may use.
  std::optional<WalkExit<T>> run(const Geometry& geometry, int instance, const Surface& surface,
                                 const Vec3f& direction, const Random& random,
                                 std::uint32_t dimension) {
    // From the surface itself, not from beside it: a free path may be as short as that offset.
    Ray ray{surface.position, direction, surface.offset / std::abs(dot(direction, surface.ng)), 0};
    const Colorf entry = value_of(medium_.entry);
    for (int flight = 0; flight < kMostFlights; ++flight, dimension += kDimensions) {
      Stage& stage = stages_[flight > kSimilarity];
      if (flight > 0) {
        const float g = flight > kSimilarity ? 0 : value_of(medium_.anisotropy);
        const float cosine = sample_henyey_greenstein(g, random.uniform(dimension + kCosine));
        ray.direction = deflect(ray.direction, cosine, random.uniform(dimension + kAzimuth));
        if (flight <= kSimilarity) phase_slope_ += henyey_greenstein_slope(g, cosine);
      }
      const Colorf left = entry * product_;
      const float sum = left.r + left.g + left.b;
      if (!(sum > 0)) return std::nullopt;
      const Colorf share = left / sum;
      const float u = random.uniform(dimension + kChannel);
      const int channel = u < share.r ? 0 : (u < share.r + share.g || share.b == 0 ? 1 : 2);
      const float free =
          exponential(random.uniform(dimension + kDistance)) / stage.sigma_t[channel];
      ray.t_max = free;
      const auto hit = geometry.intersect_inside(instance, ray);
      const float length = hit ? hit->t : free;

      Colorf kept;
      float density = 0;
      for (int c = 0; c < 3; ++c) {
        const float through = std::exp(-stage.sigma_t[c] * length);
        kept[c] = hit ? through : through * stage.sigma_s[c];
        density += share[c] * (hit ? through : through * stage.sigma_t[c]);
      }
      if (!(density > 0)) return std::nullopt;
      product_ = product_ * kept / density;
      stage.length += length;
      if (hit) return WalkExit<T>{*hit, ray.direction, weight()};
      stage.scatterings += 1;
      ray.origin = ray.origin + ray.direction * length;
      ray.t_min = 0;
    }
    return std::nullopt;
  }

 private:
  static constexpr int kMostFlights = 256, kSimilarity = 9;
  enum Dimension : std::uint32_t { kCosine, kAzimuth, kChannel, kDistance, kDimensions };

  struct Stage {
    Colorf sigma_t, sigma_s;
    float scatterings = 0, length = 0;
  };

  Color<T> weight() const {
    Color<T> w;
    for (int c = 0; c < 3; ++c) w[c] = medium_.entry[c] * flights(c);
    return w;
  }
  /// What all flights have kept of one channel, with its derivatives: d log of
  /// sigma_s^n exp(-sigma_t l) of both stages and of the phase function.
  T flights(int c) const {
    if constexpr (std::is_same_v<T, float>) {
      return product_[c];
    } else {
      using std::log;
      const T &t = medium_.sigma_t[c], &g = medium_.anisotropy;
      if (!has_slope(t) && !has_slope(medium_.albedo[c]) && !has_slope(g)) return T(product_[c]);
      if (!(product_[c] > 0)) return T(0);
      const T s = t * medium_.albedo[c];
      const Stage &first = stages_[0], &second = stages_[1];
      T change = log(s) * (first.scatterings + second.scatterings) - t * first.length -
                 (t - s * g) * second.length + log(T(1) - g) * second.scatterings +
                 g * phase_slope_;
      return chain(change, product_[c], product_[c]);
    }
  }

  const SubsurfaceMedium<T>& medium_;
  std::array<Stage, 2> stages_{};  // before and after the phase function is taken as isotropic
  Colorf product_{1, 1, 1};        // of all flights, over their density
  float phase_slope_ = 0;          // d log of the phase functions / d g
};

}  // namespace selenite
