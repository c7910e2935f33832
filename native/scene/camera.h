// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "math/vec.h"
#include "scene/transform.h"

namespace selenite {

struct Ray {
  Vec3f origin;
  Vec3f direction;  ///< unit
  float t_min = 0;
  float t_max = 0;
};

enum class SensorFit { kAuto, kHorizontal, kVertical };

/// Pinhole or orthographic camera as Blender describes it: looks along its local -Z, +Y up.
/// Source: facts sheet "cycles", section 4 (measured on both versions to 0.06 px).
struct Camera {
  std::string name;
  bool orthographic = false;
  double lens_mm = 50;
  double sensor_width_mm = 36, sensor_height_mm = 24;
  SensorFit sensor_fit = SensorFit::kAuto;
  double shift_x = 0, shift_y = 0;  ///< fraction of the fitted dimension
  double ortho_scale = 6;           ///< width of the fitted dimension in world units
  double clip_start = 0.1, clip_end = 1000;
  double pixel_aspect_x = 1, pixel_aspect_y = 1;
  Transform to_world;  ///< rotation and translation; scale of the object is removed by `check`

  /// Throws InvalidArgument naming the camera and the value; removes scale from `to_world`.
  void check();
};

/// A camera for one picture size: continuous pixel position -> ray.
class PixelCamera {
 public:
  PixelCamera(const Camera& camera, int width, int height);
  /// (px, py) in pixels from the top left corner; pixel i spans [i, i + 1).
  Ray ray(float px, float py) const;
  /// Inverse of `ray`: where a world point appears, in pixels. Behind the camera: NaN.
  Vec2<double> project(const Vec3d& point) const;

 private:
  const Camera& camera_;
  double width_, height_;  ///< aspect-corrected
  double fit_;             ///< fitted dimension, aspect-corrected pixels
  double focal_;           ///< pixels per unit slope (perspective) or per world unit (orthographic)
  double unit_;            ///< 1 / focal
  double left_, top_;      ///< edges of the picture, in the units of `unit`
  Vec3f eye_;              ///< where perspective rays start
};

}  // namespace selenite
