// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/lights/sun_disc.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "math/fault.h"

namespace selenite {

SunDisc::SunDisc(const Vec3d& axis, const Vec3d& up, double radius, int size,
                 std::vector<Colorf> pixels)
    : size_(size), pixels_(std::move(pixels)) {
  if (!(radius > 0) || !(radius <= kLargest))
    throw Refused("World",
                  "the radius of its sun = " + std::to_string(radius) + " lies outside (0, " +
                      std::to_string(kLargest) + "] radians",
                  "set another size of the sun disc");
  if (size < 1 || pixels_.size() != static_cast<std::size_t>(size) * size)
    throw Refused("World",
                  "the picture of its sun has " + std::to_string(pixels_.size()) + " pixels, not " +
                      std::to_string(size) + " x " + std::to_string(size),
                  "give a square one");
  const Vec3d right = cross(axis, up);
  if (!(dot(right, right) > 0))
    throw Refused("World", "the axis of its sun and the top of its picture are parallel",
                  "give another top");
  axis_ = Vec3f(normalize(axis));
  right_ = Vec3f(normalize(right));
  up_ = Vec3f(normalize(cross(right, axis)));
  const double half = std::sin(radius / 2);
  sine2_ = static_cast<float>(std::sin(radius) * std::sin(radius));
  height_ = static_cast<float>(2 * half * half);
  tangent_ = static_cast<float>(std::tan(radius));
  const double side = 2 * std::tan(radius) / size;
  for (int row = 0; row < size; ++row)
    for (int column = 0; column < size; ++column) {
      const Colorf& c = pixels_[static_cast<std::size_t>(row) * size + column];
      for (int k = 0; k < 3; ++k)
        if (!std::isfinite(c[k]))
          throw Refused("World", "a pixel of its sun is not finite", "set another size of it");
      const double x = (column + 0.5) * side - std::tan(radius);
      const double y = (row + 0.5) * side - std::tan(radius);
      const double far = 1 + x * x + y * y;  // squared distance of the pixel, the plane at 1
      if (x * x + y * y < std::tan(radius) * std::tan(radius))
        flux_ += std::max(0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b, 0.0) * side * side /
                 std::pow(far, 1.5);
    }
}

bool SunDisc::place(const Vec3f& d, float& x, float& y) const {
  const float along = dot(d, axis_);
  x = dot(d, right_), y = dot(d, up_);
  if (!(along > 0) || !(x * x + y * y < sine2_)) return false;
  x /= along * tangent_;
  y /= along * tangent_;
  return true;
}

Colorf SunDisc::radiance(const Vec3f& d) const {
  float x = 0, y = 0;
  if (!place(d, x, y)) return {};
  const float column = (x + 1) * 0.5f * size_ - 0.5f, row = (1 - y) * 0.5f * size_ - 0.5f;
  const float left = std::floor(column), top = std::floor(row);
  const auto at = [&](float i, float j) {
    const int column_at = std::clamp(static_cast<int>(i), 0, size_ - 1);
    const int row_at = std::clamp(static_cast<int>(j), 0, size_ - 1);
    return pixels_[static_cast<std::size_t>(row_at) * size_ + column_at];
  };
  const float a = column - left, b = row - top;
  return (at(left, top) * (1 - a) + at(left + 1, top) * a) * (1 - b) +
         (at(left, top + 1) * (1 - a) + at(left + 1, top + 1) * a) * b;
}

float SunDisc::density(const Vec3f& d) const {
  float x = 0, y = 0;
  return place(d, x, y) ? 1 / (2 * kPi<float> * height_) : 0;
}

Vec3f SunDisc::sample(float u1, float u2) const {
  const float below = u1 * height_;  // 1 - cosine, which has digits where the sine is small
  const float sine = std::sqrt(below * (2 - below)), azimuth = 2 * kPi<float> * u2;
  return axis_ * (1 - below) + right_ * (sine * std::cos(azimuth)) +
         up_ * (sine * std::sin(azimuth));
}

}  // namespace selenite
