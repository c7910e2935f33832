// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/texture.h"

#include <algorithm>
#include <array>

#include "math/fault.h"
#include "math/srgb.h"

namespace selenite {
namespace {

/// No light below 0.
float decoded(float x) { return x < 0 ? 0 : srgb_decode(x); }

/// Of `decoded`; at 0 that of the numbers above.
float srgb_slope(float x) {
  if (x <= 0.04045f) return x < 0 ? 0 : 1 / 12.92f;
  return 2.4f / 1.055f * std::pow((x + 0.055f) / 1.055f, 1.4f);
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

/// The texels along one axis that make up a value, with their weights.
struct Taps {
  int count = 0;
  std::array<int, 4> index{};  ///< -1: black
  std::array<float, 4> weight{};

  /// `x` in texels from the edge of the first one.
  Taps(float x, int n, Extension extension, Interpolation interpolation) {
    const float shifted = interpolation == Interpolation::kClosest ? x : x - 0.5f;
    const float low = std::floor(shifted), t = shifted - low;
    const int first = static_cast<int>(low);
    switch (interpolation) {
      case Interpolation::kClosest:
        set(first, {1, 0, 0, 0}, 1);
        break;
      case Interpolation::kLinear:
        set(first, {1 - t, t, 0, 0}, 2);
        break;
      case Interpolation::kCubic:
        set(first - 1,
            {((-t / 6 + 0.5f) * t - 0.5f) * t + 1.0f / 6, (0.5f * t - 1) * t * t + 2.0f / 3,
             ((-0.5f * t + 0.5f) * t + 0.5f) * t + 1.0f / 6, t * t * t / 6},
            4);
        break;
    }
    for (int k = 0; k < count; ++k) index[k] = wrap(index[k], n, extension);
  }

 private:
  void set(int first, const std::array<float, 4>& weights, int taps) {
    count = taps;
    weight = weights;
    for (int k = 0; k < taps; ++k) index[k] = first + k;
  }
};

}  // namespace

Texture::Texture(std::string name, int width, int height, std::vector<Colorf> pixels,
                 std::vector<float> alpha, bool encoded, Extension extension,
                 Interpolation interpolation)
    : name_(std::move(name)),
      width_(width),
      height_(height),
      pixels_(std::move(pixels)),
      alpha_(std::move(alpha)),
      encoded_(encoded),
      extension_(extension),
      interpolation_(interpolation) {
  const auto fits = [&](std::size_t count) {
    return count == static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  };
  if (width < 1 || height < 1 || !fits(pixels_.size()) || !(alpha_.empty() || fits(alpha_.size())))
    throw Refused(
        "Image '" + name_ + "'",
        std::to_string(width) + " x " + std::to_string(height) + " pixels do not match the data",
        "give an image of at least 1 x 1 pixel");
  const auto finite = [](float x) { return std::isfinite(x); };
  if (!std::all_of(pixels_.begin(), pixels_.end(),
                   [&](const Colorf& c) { return finite(c.r) && finite(c.g) && finite(c.b); }) ||
      !std::all_of(alpha_.begin(), alpha_.end(), finite))
    throw Refused("Image '" + name_ + "'", "a pixel is infinite or not a number",
                  "repair the file");
}

Texture::TexelTaps Texture::taps_at(const Vec2f& uv) const {
  TexelTaps found;
  if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) return found;
  // Far outside, the fraction of a repeated coordinate is all that matters (and an int can hold).
  const bool periodic = extension_ == Extension::kRepeat || extension_ == Extension::kMirror;
  const auto taps = [&](float t, int n) {
    const float inside = periodic ? t - 2 * std::floor(t / 2) : clamp(t, -4.0f, 5.0f);
    return Taps(inside * static_cast<float>(n), n, extension_, interpolation_);
  };
  const Taps across = taps(uv.x, width_), up = taps(uv.y, height_);
  for (int j = 0; j < up.count; ++j) {
    if (up.index[j] < 0) continue;
    const auto row = static_cast<std::uint32_t>(height_ - 1 - up.index[j]) * width_;
    for (int i = 0; i < across.count; ++i) {
      if (across.index[i] < 0) continue;
      found.texel[found.count] = row + static_cast<std::uint32_t>(across.index[i]);
      found.weight[found.count++] = up.weight[j] * across.weight[i];
    }
  }
  return found;
}

Colorf Texture::sum(const TexelTaps& taps) const {
  Colorf c;
  for (int k = 0; k < taps.count; ++k) c += pixels_[taps.texel[k]] * taps.weight[k];
  return c;
}

Colorf Texture::decoding_slope(const TexelTaps& taps) const { return map(sum(taps), srgb_slope); }

Colorf Texture::encode(const Colorf& linear) const {
  return encoded_ ? map(linear, srgb_encode) : linear;
}

Colorf Texture::decode(const Colorf& held) const { return encoded_ ? map(held, decoded) : held; }

Colorf Texture::at(const Vec2f& uv) const {
  const TexelTaps taps = taps_at(uv);
  Colorf c = sum(taps);
  if (has_alpha()) {
    float alpha = 0;
    for (int k = 0; k < taps.count; ++k) alpha += alpha_[taps.texel[k]] * taps.weight[k];
    if (alpha != 0) c = c / alpha;
  }
  return decode(c);
}

}  // namespace selenite
