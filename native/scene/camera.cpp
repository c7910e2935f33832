// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/camera.h"

#include <limits>

#include "math/fault.h"

namespace selenite {
namespace {

void require(bool good, const Camera& camera, const char* what, double value, const char* range) {
  if (!good)
    throw Refused("Camera '" + camera.name + "'",
                  std::string(what) + " = " + std::to_string(value) + " is not permitted",
                  std::string("set it to ") + range);
}

/// Pixels of a photo in one of a picture where that is no whole number, else 0.
float cut_pixels(int photo, int picture) {
  return photo % picture == 0 ? 0 : static_cast<float>(photo) / static_cast<float>(picture);
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

void PhotoFrame::check() const {
  if (!(aspect >= 0) || !std::isfinite(aspect))
    throw Refused("Photo frame", "aspect = " + std::to_string(aspect) + " is not permitted",
                  "set it to width / height, or 0 (no photo)");
  if (width < 0 || height < 0)
    throw Refused("Photo frame",
                  "photo of " + std::to_string(width) + " x " + std::to_string(height) +
                      " pixels is not permitted",
                  "set both to at least 1, or 0 (no photo)");
  const auto inside = [](double low, double high) { return low >= 0 && low < high && high <= 1; };
  if (!inside(window.left, window.right) || !inside(window.top, window.bottom))
    throw Refused("Photo frame",
                  "window (" + std::to_string(window.left) + ", " + std::to_string(window.top) +
                      ", " + std::to_string(window.right) + ", " + std::to_string(window.bottom) +
                      ") is not permitted",
                  "set left < right and top < bottom in [0, 1]");
}

PixelCamera::PixelCamera(const Camera& camera, int width, int height, const PhotoFrame& frame)
    : camera_(camera),
      photo_across_(cut_pixels(frame.width, width)),
      photo_down_(cut_pixels(frame.height, height)) {
  // Pixels of all that the camera takes, of which the picture may be a part.
  const FrameWindow& window = frame.window;
  const double columns = width / (window.right - window.left);
  const double rows = height / (window.bottom - window.top);
  aspect_x_ = camera.pixel_aspect_x * (frame.aspect > 0 ? frame.aspect * rows / columns : 1);
  const double all_across = columns * aspect_x_, all_down = rows * camera.pixel_aspect_y;
  const bool vertical = camera.sensor_fit == SensorFit::kVertical;
  const bool horizontal = camera.sensor_fit == SensorFit::kHorizontal;
  const double fit =
      vertical ? all_down : (horizontal || all_across > all_down ? all_across : all_down);
  // AUTO fits the larger side but always reads the sensor's width.
  const double sensor = vertical ? camera.sensor_height_mm : camera.sensor_width_mm;
  focal_ = camera.orthographic ? fit / camera.ortho_scale : camera.lens_mm / sensor * fit;
  unit_ = 1 / focal_;
  left_ = (camera.shift_x * fit - all_across / 2 + window.left * all_across) * unit_;
  top_ = (camera.shift_y * fit + all_down / 2 - window.top * all_down) * unit_;
  eye_ = Vec3f(camera.to_world.translation());
}

Vec2<double> PixelCamera::project(const Vec3d& point) const {
  const Camera& c = camera_;
  const Vec3d d = point - c.to_world.translation();
  const double x = dot(d, c.to_world.column(0)), y = dot(d, c.to_world.column(1));
  const double depth = -dot(d, c.to_world.column(2));
  if (!c.orthographic && !(depth > 0))
    return {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()};
  const double divisor = c.orthographic ? 1 : depth;
  return {(x / divisor - left_) * focal_ / aspect_x_,
          (top_ - y / divisor) * focal_ / c.pixel_aspect_y};
}

}  // namespace selenite
