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
/// Source: docs/method/rendering.md, "Camera" (measured on Blender 3.4 and 4.5 to 0.06 px).
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

/// Part of what a camera takes, as fractions of its width and height from the top left corner.
struct FrameWindow {
  double left = 0, top = 0, right = 1, bottom = 1;
};

/// The photo that a picture is a smaller form of, which a render of the picture's size then equals:
/// widths and heights are whole, so the shapes differ by up to half a pixel, and where one pixel of
/// the photo lies in two of the picture, both have their share of all of it. Default: no photo.
struct PhotoFrame {
  double aspect = 0;          ///< of all that the camera takes, width / height in pixels
  int width = 0, height = 0;  ///< of the photo
  FrameWindow window{};       ///< what the photo shows of it: a crop

  /// Throws InvalidArgument.
  void check() const;
};

/// A camera for one picture size: continuous pixel position -> ray.
class PixelCamera {
 public:
  PixelCamera(const Camera& camera, int width, int height, const PhotoFrame& frame = {});
  /// (px, py) in pixels from the top left corner; pixel i spans [i, i + 1).
  Ray ray(float px, float py) const {
    Ray ray;
    this->ray<double>(px, py, ray.origin, ray.direction, ray.t_min, ray.t_max);
    return ray;
  }
  /// The same of one position or of eight: S is float or lanes, D the same in double.
  template <class D, class S>
  void ray(const S& px, const S& py, Vec3<S>& origin, Vec3<S>& direction, S& t_min,
           S& t_max) const {
    using std::sqrt;
    const Camera& c = camera_;
    const D x = D(px) * (aspect_x_ * unit_) + left_;
    const D y = top_ - D(py) * (c.pixel_aspect_y * unit_);
    if (c.orthographic) {
      origin = Vec3<S>(c.to_world.point(Vec3<D>{x, y, 0}));
      direction = Vec3<S>(Vec3f(-c.to_world.column(2)));
      t_min = S(static_cast<float>(c.clip_start));
      t_max = S(static_cast<float>(c.clip_end));
      return;
    }
    // The clip planes are perpendicular to the axis: this has depth 1.
    const D stretch = sqrt(x * x + y * y + D(1)), inverse = D(1) / stretch;
    origin = Vec3<S>(eye_);
    direction = Vec3<S>(c.to_world.vector(Vec3<D>{x * inverse, y * inverse, -inverse}));
    t_min = S(stretch * D(c.clip_start));
    t_max = S(stretch * D(c.clip_end));
  }
  /// A point uniform in the photo's pixel that holds (px, py); u, v in [0, 1). Of a point that is
  /// uniform in a pixel of the picture it makes one whose mean radiance is what an area filter
  /// leaves of the photo there.
  template <class S>
  Vec2<S> in_photo(const S& px, const S& py, const S& u, const S& v) const {
    return {in_photo(px, photo_across_, u), in_photo(py, photo_down_, v)};
  }
  /// Whether `in_photo` does anything: where every pixel of the photo lies in one of the picture, it
  /// need not be asked.
  bool cuts_photo() const { return photo_across_ > 0 || photo_down_ > 0; }
  const Camera& camera() const { return camera_; }
  /// Inverse of `ray`: where a world point appears, in pixels. Behind the camera: NaN.
  Vec2<double> project(const Vec3d& point) const;

 private:
  template <class S>
  static S in_photo(const S& p, float scale, const S& u) {
    using std::floor;
    return scale > 0 ? (floor(p * scale) + u) / scale : p;
  }

  const Camera& camera_;
  float photo_across_ = 0, photo_down_ = 0;  ///< the photo's pixels a pixel; 0: a whole number
  double aspect_x_;                          ///< of a pixel
  double focal_;       ///< pixels per unit slope (perspective) or per world unit (orthographic)
  double unit_;        ///< 1 / focal
  double left_, top_;  ///< edges of the picture, in the units of `unit`
  Vec3f eye_;          ///< where perspective rays start
};

}  // namespace selenite
