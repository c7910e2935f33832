// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <limits>

#include "math/sampling.h"

namespace selenite {

/// Points along a ray drawn by the angle under which a lamp sees them: as many where the inverse
/// square of the distance peaks as it asks for. Source: Kulla and Fajardo, Importance sampling
/// techniques for path tracing in participating media, 2012, section 4.
class Equiangular {
 public:
  /// The stretch from `origin` along the unit `direction` over `length` (may be infinite).
  Equiangular(const Vec3f& origin, const Vec3f& direction, float length, const Vec3f& lamp) {
    const Vec3f to_lamp = lamp - origin;
    nearest_ = dot(to_lamp, direction);
    height_ = selenite::length(to_lamp - direction * nearest_);
    if (!(height_ > 0)) return;  // the lamp lies on the ray: no density
    begin_ = std::atan(-nearest_ / height_);
    const float end =
        std::isinf(length) ? 0.5f * kPi<float> : std::atan((length - nearest_) / height_);
    span_ = end - begin_;
    length_ = length;
  }

  /// Whether a distance can be drawn at all.
  explicit operator bool() const { return span_ > 0; }

  /// Distance from the origin for a uniform number.
  float sample(float u) const {
    const float t = nearest_ + height_ * std::tan(begin_ + u * span_);
    return std::fmin(std::fmax(t, 0.0f), length_);
  }
  /// Per length, of a distance on the stretch; 0 if nothing can be drawn.
  float density(float t) const {
    if (!(span_ > 0)) return 0;
    const float along = t - nearest_;
    return height_ / (span_ * (height_ * height_ + along * along));
  }

 private:
  float nearest_ = 0, height_ = 0, begin_ = 0, span_ = 0;
  float length_ = std::numeric_limits<float>::infinity();
};

}  // namespace selenite
