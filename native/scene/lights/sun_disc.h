// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "math/color.h"
#include "math/vec.h"

namespace selenite {

/// The disc of a sun in a sky, far smaller than a pixel of the sky's image: a picture of its own on the
/// plane across its axis. Black beyond the circle inside that picture.
class SunDisc {
 public:
  /// Discs with a larger radius than this (radians) fit into the image of the sky.
  static constexpr double kLargest = 0.5;

  /// axis: to its middle, up: to the top of the picture; both in the frame of the sky's image. radius:
  /// that of the circle, radians. pixels: size x size, row 0 at the top. InvalidArgument: a radius
  /// outside (0, kLargest], a pixel that is not finite, another count of pixels, an axis along `up`.
  SunDisc(const Vec3d& axis, const Vec3d& up, double radius, int size, std::vector<Colorf> pixels);

  Colorf radiance(const Vec3f& direction) const;
  float density(const Vec3f& direction) const;  ///< of `sample`, per solid angle; 0 outside
  Vec3f sample(float u1, float u2) const;       ///< all directions inside alike
  double flux() const { return flux_; }         ///< luminance times solid angle

 private:
  /// Where the direction meets the plane, in radii; false outside the circle.
  bool place(const Vec3f& direction, float& x, float& y) const;

  Vec3f axis_, right_, up_;
  float sine2_;   // of the radius, squared
  float height_;  // 1 - cosine of the radius
  float tangent_;
  int size_;
  std::vector<Colorf> pixels_;
  double flux_ = 0;
};

}  // namespace selenite
