// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/texture.h"

#include <algorithm>

#include "math/error.h"

namespace selenite {
namespace {

float decode_srgb(float x) {
  if (x <= 0.04045f) return x < 0 ? 0 : x / 12.92f;
  return std::pow((x + 0.055f) / 1.055f, 2.4f);
}

/// Index of a texel after the extension rule; -1 where there is none.
int wrap(int i, int n, Extension extension) {
  switch (extension) {
    case Extension::kRepeat:
      return ((i % n) + n) % n;
    case Extension::kExtend:
      return std::clamp(i, 0, n - 1);
    case Extension::kMirror: {
      const int j = ((i % (2 * n)) + 2 * n) % (2 * n);
      return j < n ? j : 2 * n - 1 - j;
    }
    default:
      return i >= 0 && i < n ? i : -1;
  }
}

}  // namespace

Texture::Texture(std::string name, int width, int height, std::vector<Colorf> pixels, bool encoded,
                 Extension extension, bool interpolate)
    : name_(std::move(name)),
      width_(width),
      height_(height),
      pixels_(std::move(pixels)),
      encoded_(encoded),
      extension_(extension),
      interpolate_(interpolate) {
  if (width < 1 || height < 1 || pixels_.size() != static_cast<std::size_t>(width) * height)
    throw InvalidArgument("Image '" + name_ + "': " + std::to_string(width) + " x " +
                          std::to_string(height) +
                          " pixels do not match the data; give an image of at least 1 x 1 pixel");
  for (const Colorf& c : pixels_)
    if (!std::isfinite(c.r) || !std::isfinite(c.g) || !std::isfinite(c.b))
      throw InvalidArgument("Image '" + name_ +
                            "': a pixel is infinite or not a number; repair the file");
}

Colorf Texture::texel(int x, int y) const {
  const int i = wrap(x, width_, extension_), j = wrap(y, height_, extension_);
  if (i < 0 || j < 0) return {};
  return pixels_[static_cast<std::size_t>(height_ - 1 - j) * width_ + i];
}

Colorf Texture::at(const Vec2f& uv) const {
  if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) return {};
  // Far outside, the fraction of a repeated coordinate is all that matters (and an int can hold).
  const bool periodic = extension_ == Extension::kRepeat || extension_ == Extension::kMirror;
  const auto inside = [&](float t) {
    return periodic ? t - 2 * std::floor(t / 2) : clamp(t, -2.0f, 3.0f);
  };
  float x = inside(uv.x) * static_cast<float>(width_);
  float y = inside(uv.y) * static_cast<float>(height_);
  Colorf c;
  if (interpolate_) {
    x -= 0.5f;
    y -= 0.5f;
    const float fx = std::floor(x), fy = std::floor(y), a = x - fx, b = y - fy;
    const int i = static_cast<int>(fx), j = static_cast<int>(fy);
    c = (texel(i, j) * (1 - a) + texel(i + 1, j) * a) * (1 - b) +
        (texel(i, j + 1) * (1 - a) + texel(i + 1, j + 1) * a) * b;
  } else {
    c = texel(static_cast<int>(std::floor(x)), static_cast<int>(std::floor(y)));
  }
  return encoded_ ? map(c, decode_srgb) : c;
}

}  // namespace selenite
