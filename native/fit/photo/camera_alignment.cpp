// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/photo/camera_alignment.h"

#include <cmath>

namespace selenite {
namespace {

/// By how much the shifts of a camera change where its picture moves by a pixel.
Vec2<double> shift_of_pixel(Camera camera, int width, int height, const PhotoFrame& frame) {
  const Vec3d ahead = camera.to_world.translation() - camera.to_world.column(2);
  const Vec2<double> before = PixelCamera(camera, width, height, frame).project(ahead);
  camera.shift_x += 1;
  camera.shift_y += 1;
  const Vec2<double> after = PixelCamera(camera, width, height, frame).project(ahead);
  return {1 / (before.x - after.x), 1 / (after.y - before.y)};
}

}  // namespace

Camera Alignment::apply(Camera camera, int width, int height, const PhotoFrame& frame) const {
  if (x == 0 && y == 0 && roll == 0) return camera;
  const Vec2<double> unit = shift_of_pixel(camera, width, height, frame);
  camera.shift_x += x * unit.x;
  camera.shift_y -= y * unit.y;
  const double c = std::cos(roll), s = std::sin(roll);
  for (auto& row : camera.to_world.m) {
    const double right = row[0], up = row[1];
    row[0] = c * right + s * up;
    row[1] = -s * right + c * up;
  }
  return camera;
}

}  // namespace selenite
