// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "math/rng.h"
#include "render/prepared/prepared.h"

namespace selenite {

/// The same as `scatter`, where a grid of the medium is unknown.
template <int L>
void scatter_recorded(const PreparedMaterial<L>& medium, const Vec3f& position,
                      Throughput<L>& beta) {
  const Colorf sigma_t = value_of(medium.extinction_at(position));
  if (medium.density_field >= 0) {
    const FieldSlope slope{
        value_of(medium.values.extinction), {position, medium.density_field}, medium.density_unit};
    beta.multiply_recorded(sigma_t, &slope, 1);
  } else {
    beta.multiply(medium.factor(sigma_t));
  }
  const Colorf albedo =
      medium.albedo_grid ? medium.albedo_grid->at(position) : value_of(medium.values.albedo);
  if (medium.albedo_field >= 0) {
    const FieldSlope slope{Colorf(1), {position, medium.albedo_field}, 1};
    beta.multiply_recorded(albedo, &slope, 1);
  } else {
    beta.multiply(medium.factor(albedo));
  }
}

/// Light is scattered at `position`: the throughput takes the medium's scattering coefficient there.
template <int L>
void scatter(const PreparedMaterial<L>& medium, const Vec3f& position, Throughput<L>& beta) {
  if constexpr (is_taped(L))
    if (medium.albedo_field >= 0 || medium.density_field >= 0)
      return scatter_recorded(medium, position, beta);
  if (!medium.albedo_grid && !medium.density_grid) {
    beta.multiply(medium.factor(medium.sigma_s));
    return;
  }
  const auto sigma_t = medium.extinction_at(position);
  if (!medium.albedo_grid) {
    beta.multiply(medium.factor(sigma_t * medium.values.albedo));
    return;
  }
  const Color<PathScalar<L>> albedo(medium.albedo_grid->at(position));
  beta.multiply(medium.factor(sigma_t * albedo));
}

/// The way along a ray through media that vary in space, by null collisions: the ray is stopped at
/// the rate of a constant majorant, and the difference to the media's own extinction is a collision
/// that changes nothing. Where a parameter or the density is unknown the majorant is loose, for the
/// derivative of a null collision must not be dropped where its value is 0.
///
/// An unknown density has its derivative in the collisions themselves. Where light is scattered it is
/// that of the coefficient; a null collision has minus the extinction's, and their number per length
/// makes up for their value: its expectation is that of the transmittance's derivative.
///
/// Sources: Woodcock et al. 1965 (null collisions), Novak et al. 2014 (ratio tracking), Kutz et al.
/// 2017 (the choice between collisions by all channels).
template <int L>
class GridFlight {
 public:
  static constexpr int kMost = 8;

  explicit GridFlight(const Ray& ray) : origin_(ray.origin), direction_(ray.direction) {}

  void add(const PreparedMaterial<L>& medium) {
    media_[count_++] = &medium;
    majorant_ += medium.majorant;
  }

  /// What passes `length` without being met, by ratio tracking.
  void attenuate(float length, const Random& random, Throughput<L>& beta) const {
    const float start = beta.importance();
    float t = 0;
    for (std::uint32_t step = 0; start > 0; step += kAttenuationDraws) {
      t += free_path(random.uniform(step));
      if (!(t < length)) return;
      pass(at(t), 1 / majorant_, beta);
      // The way through a dense medium would have no end.
      const float left = beta.importance();
      if (left > kDim * start) continue;
      if (!(left > 0) || random.uniform(step + 1) < kEnd) {
        beta.multiply(0);
        return;
      }
      beta.multiply(1 / (1 - kEnd));
    }
  }

  /// Draws where light is scattered, less than `length` away; empty if nothing is met. `beta` takes
  /// all factors but the scattering coefficient. `shares`: how much a channel counts, from its
  /// throughput.
  template <class Shares>
  std::optional<float> fly(float length, const Random& random, Throughput<L>& beta,
                           Shares&& shares) const {
    float t = 0;
    for (std::uint32_t step = 0;; step += kFlightDraws) {
      t += free_path(random.uniform(step));
      if (!(t < length)) return std::nullopt;
      const Vec3f p = at(t);
      Colorf rate;
      for (int i = 0; i < count_; ++i) rate += media_[i]->rate_at(p);
      const Colorf share = shares(beta.value);
      const float probability =
          (share.r * rate.r + share.g * rate.g + share.b * rate.b) / majorant_;
      if (!(random.uniform(step + 1) < probability)) {
        pass(p, 1 / (majorant_ * (1 - probability)), beta);
        if (!(beta.importance() > 0)) return std::nullopt;
        continue;
      }
      beta.multiply(1 / (majorant_ * probability));
      return t;
    }
  }

 private:
  static constexpr float kDim = 0.05f, kEnd = 0.5f;
  static constexpr std::uint32_t kAttenuationDraws = 2, kFlightDraws = 2;

  Vec3f at(float t) const { return origin_ + direction_ * t; }
  float free_path(float u) const {
    return majorant_ > 0 ? exponential(u) / majorant_ : std::numeric_limits<float>::infinity();
  }
  /// A null collision: the majorant less what the media have there.
  void pass(const Vec3f& p, float scale, Throughput<L>& beta) const {
    std::array<Factor<L>, kMost> parts;
    Colorf left(majorant_);
    for (int i = 0; i < count_; ++i) {
      parts[i] = media_[i]->factor(media_[i]->extinction_at(p));
      left = left - parts[i].value;
    }
    // Rounding can leave a tight majorant a little below the extinction.
    left = map(left, [](float x) { return std::max(x, 0.0f); });
    if constexpr (is_taped(L)) {
      std::array<FieldSlope, kMost> slopes;
      int unknown = 0;
      for (int i = 0; i < count_; ++i)
        if (media_[i]->density_field >= 0)
          // Of a loose majorant something is always left: no path gets black here.
          slopes[unknown++] = {
              value_of(media_[i]->values.extinction) * -scale, {p, media_[i]->density_field}, 0};
      if (unknown > 0) return beta.multiply_recorded(left * scale, slopes.data(), unknown);
    }
    beta.multiply(left * scale, parts.data(), count_, -scale);
  }

  Vec3f origin_, direction_;
  std::array<const PreparedMaterial<L>*, kMost> media_{};
  int count_ = 0;
  float majorant_ = 0;
};

}  // namespace selenite
