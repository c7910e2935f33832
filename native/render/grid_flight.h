// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "math/rng.h"
#include "render/prepared.h"

namespace selenite {

/// Light is scattered at `position`: the throughput takes the medium's scattering coefficient there.
template <int L>
void scatter(const PreparedMaterial<L>& medium, const Vec3f& position, Throughput<L>& beta) {
  if (!medium.albedo_grid && !medium.density_grid) {
    beta.multiply(medium.factor(medium.sigma_s));
    return;
  }
  const auto sigma_t = medium.extinction_at(position);
  if (!medium.albedo_grid) {
    beta.multiply(medium.factor(sigma_t * medium.values.albedo));
    return;
  }
  const Colorf albedo = medium.albedo_grid->at(position);
  if constexpr (L == kTaped) {
    if (medium.albedo_field >= 0) {
      beta.multiply(medium.factor(sigma_t));
      beta.multiply_recorded(albedo, position, medium.albedo_field);
      return;
    }
  }
  beta.multiply(medium.factor(sigma_t * Color<PathScalar<L>>(albedo)));
}

/// The way along a ray through media that vary in space, by null collisions: the ray is stopped at
/// the rate of a constant majorant, and the difference to the media's own extinction is a collision
/// that changes nothing. Where a parameter is ticked the majorant is loose, for the derivative of a
/// null collision must not be dropped where its value is 0.
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
    return majorant_ > 0 ? -std::log1p(-u) / majorant_ : std::numeric_limits<float>::infinity();
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
    beta.multiply(left * scale, parts.data(), count_, -scale);
  }

  Vec3f origin_, direction_;
  std::array<const PreparedMaterial<L>*, kMost> media_{};
  int count_ = 0;
  float majorant_ = 0;
};

}  // namespace selenite
