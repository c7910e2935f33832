// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/camera.h"

#include <limits>

#include "math/error.h"

namespace selenite {
namespace {

void require(bool good, const Camera& camera, const char* what, double value, const char* range) {
  if (!good)
    throw InvalidArgument("Camera '" + camera.name + "': " + what + " = " + std::to_string(value) +
                          " is not permitted; set it to " + range);
}

}  // namespace

void Camera::check() {
  require(lens_mm > 0 && std::isfinite(lens_mm), *this, "focal length", lens_mm, "more than 0 mm");
  require(sensor_width_mm > 0 && std::isfinite(sensor_width_mm), *this, "sensor width",
          sensor_width_mm, "more than 0 mm");
  require(sensor_height_mm > 0 && std::isfinite(sensor_height_mm), *this, "sensor height",
          sensor_height_mm, "more than 0 mm");
  require(!orthographic || (ortho_scale > 0 && std::isfinite(ortho_scale)), *this,
          "orthographic scale", ortho_scale, "more than 0");
  require(std::isfinite(shift_x), *this, "shift x", shift_x, "a finite number");
  require(std::isfinite(shift_y), *this, "shift y", shift_y, "a finite number");
  require(clip_start > 0, *this, "clip start", clip_start, "more than 0");
  require(clip_end > clip_start, *this, "clip end", clip_end, "more than clip start");
  require(pixel_aspect_x > 0 && std::isfinite(pixel_aspect_x), *this, "pixel aspect x",
          pixel_aspect_x, "more than 0");
  require(pixel_aspect_y > 0 && std::isfinite(pixel_aspect_y), *this, "pixel aspect y",
          pixel_aspect_y, "more than 0");
  for (const auto& row : to_world.m)
    require(std::isfinite(row[3]), *this, "location", row[3], "a finite number");
  for (int j = 0; j < 3; ++j) {
    const double size = length(to_world.column(j));
    require(size > 0 && std::isfinite(size), *this, "scale", size, "more than 0");
    for (int i = 0; i < 3; ++i) to_world.m[i][j] /= size;
  }
}

PixelCamera::PixelCamera(const Camera& camera, int width, int height)
    : camera_(camera),
      width_(width * camera.pixel_aspect_x),
      height_(height * camera.pixel_aspect_y) {
  const bool vertical = camera.sensor_fit == SensorFit::kVertical;
  const bool horizontal = camera.sensor_fit == SensorFit::kHorizontal;
  fit_ = vertical ? height_ : (horizontal || width_ > height_ ? width_ : height_);
  // AUTO fits the larger side but always reads the sensor's width.
  const double sensor = vertical ? camera.sensor_height_mm : camera.sensor_width_mm;
  focal_ = camera.orthographic ? fit_ / camera.ortho_scale : camera.lens_mm / sensor * fit_;
  unit_ = 1 / focal_;
  left_ = (camera.shift_x * fit_ - width_ / 2) * unit_;
  top_ = (camera.shift_y * fit_ + height_ / 2) * unit_;
  eye_ = Vec3f(camera.to_world.translation());
}

Ray PixelCamera::ray(float px, float py) const {
  const Camera& c = camera_;
  const double x = px * c.pixel_aspect_x * unit_ + left_;
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

Vec2<double> PixelCamera::project(const Vec3d& point) const {
  const Camera& c = camera_;
  const Vec3d d = point - c.to_world.translation();
  const double x = dot(d, c.to_world.column(0)), y = dot(d, c.to_world.column(1));
  const double depth = -dot(d, c.to_world.column(2));
  if (!c.orthographic && !(depth > 0))
    return {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()};
  const double divisor = c.orthographic ? 1 : depth;
  return {(width_ / 2 + focal_ * x / divisor - c.shift_x * fit_) / c.pixel_aspect_x,
          (height_ / 2 - (focal_ * y / divisor - c.shift_y * fit_)) / c.pixel_aspect_y};
}

}  // namespace selenite
