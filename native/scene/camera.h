// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
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

/// The photo that a picture is a smaller form of, which a render of the picture's size then equals:
/// widths and heights are whole, so the shapes differ by up to half a pixel, and where one pixel of
/// the photo lies in two of the picture, both have their share of all of it. Default: no photo.
struct PhotoFrame {
  double aspect = 0;          ///< of what the camera takes, width / height in pixels
  int width = 0, height = 0;  ///< of the photo

  /// Throws InvalidArgument.
  void check() const;
};

/// A camera for one picture size: continuous pixel position -> ray.
class PixelCamera {
 public:
  PixelCamera(const Camera& camera, int width, int height, const PhotoFrame& frame = {});
  /// (px, py) in pixels from the top left corner; pixel i spans [i, i + 1).
  Ray ray(float px, float py) const {
    const Camera& c = camera_;
    const double x = px * aspect_x_ * unit_ + left_;
    const double y = top_ - py * c.pixel_aspect_y * unit_;
    if (c.orthographic)
      return {Vec3f(c.to_world.point({x, y, 0})), Vec3f(-c.to_world.column(2)),
              static_cast<float>(c.clip_start), static_cast<float>(c.clip_end)};
    // The clip planes are perpendicular to the axis: this has depth 1.
    const Vec3d towards{x, y, -1};
    const double stretch = length(towards);
    return {eye_, Vec3f(c.to_world.vector(towards / stretch)),
            static_cast<float>(c.clip_start * stretch), static_cast<float>(c.clip_end * stretch)};
  }
  /// A point uniform in the photo's pixel that holds (px, py); u, v in [0, 1). Of a point that is
  /// uniform in a pixel of the picture it makes one whose mean radiance is what an area filter
  /// leaves of the photo there.
  Vec2<float> in_photo(float px, float py, float u, float v) const {
    return {in_photo(px, photo_across_, u), in_photo(py, photo_down_, v)};
  }
  /// Whether `in_photo` does anything: where every pixel of the photo lies in one of the picture, it
  /// need not be asked.
  bool cuts_photo() const { return photo_across_ > 0 || photo_down_ > 0; }
  /// Inverse of `ray`: where a world point appears, in pixels. Behind the camera: NaN.
  Vec2<double> project(const Vec3d& point) const;

 private:
  static float in_photo(float p, float scale, float u) {
    return scale > 0 ? (std::floor(p * scale) + u) / scale : p;
  }

  const Camera& camera_;
  float photo_across_ = 0, photo_down_ = 0;  ///< the photo's pixels a pixel; 0: a whole number
  double aspect_x_;                          ///< of a pixel
  double width_, height_;                    ///< aspect-corrected
  double fit_;                               ///< fitted dimension, aspect-corrected pixels
  double focal_;       ///< pixels per unit slope (perspective) or per world unit (orthographic)
  double unit_;        ///< 1 / focal
  double left_, top_;  ///< edges of the picture, in the units of `unit`
  Vec3f eye_;          ///< where perspective rays start
};

}  // namespace selenite
