// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "math/color.h"
#include "math/vec.h"

namespace selenite {

/// Outside the unit square: again, the edge's texel, black, or again with every other one flipped.
enum class Extension { kRepeat, kExtend, kClip, kMirror };
/// Between texel centres: bilinear, the nearest, or a bicubic B-spline (which smooths).
enum class Interpolation { kLinear, kClosest, kCubic };

/// Image on a surface; texel centres at (i + 1/2) / N, origin bottom left.
///
/// An `encoded` image (in sRGB) is interpolated on its encoded values and decoded afterwards, as
/// Cycles does; any other is linear. Source:
/// docs/method/rendering.md, "Textures". Immutable, shared.
class Texture {
 public:
  /// Row 0 of `pixels` is the top. `alpha` is empty, or one number a pixel by which the colours were
  /// multiplied (encoded, if they are): they are divided by it after interpolation and before
  /// decoding. InvalidArgument: size, or a value that is not finite.
  Texture(std::string name, int width, int height, std::vector<Colorf> pixels,
          std::vector<float> alpha, bool encoded, Extension extension, Interpolation interpolation);
  Colorf at(const Vec2f& uv) const;

  /// Calls `sink(texel, derivative)` for the texels that make up the colour at uv, where `derivative`
  /// is by that colour: by the texel's own numbers, as the image holds them. Texel 0 is top left; they
  /// follow each other row by row. Only without alpha.
  template <class Sink>
  void spread(const Vec2f& uv, Colorf derivative, Sink&& sink) const {
    const TexelTaps taps = taps_at(uv);
    if (encoded_) derivative = derivative * decoding_slope(taps);
    for (int k = 0; k < taps.count; ++k) sink(taps.texel[k], derivative * taps.weight[k]);
  }

  const std::string& name() const { return name_; }
  int width() const { return width_; }
  int height() const { return height_; }
  bool has_alpha() const { return !alpha_.empty(); }
  bool encoded() const { return encoded_; }
  Extension extension() const { return extension_; }
  /// As the image holds them.
  const std::vector<Colorf>& pixels() const { return pixels_; }
  /// The same image with other colours; the same errors.
  Texture with(std::vector<Colorf> pixels) const {
    return {name_,  width_,   height_,    std::move(pixels),
            alpha_, encoded_, extension_, interpolation_};
  }
  /// A linear colour as the image would hold it, and back.
  Colorf encode(const Colorf& linear) const;
  Colorf decode(const Colorf& held) const;

 private:
  /// What makes up a value: at most 4 x 4 texels and their weights.
  struct TexelTaps {
    int count = 0;
    std::array<std::uint32_t, 16> texel;
    std::array<float, 16> weight;
  };
  TexelTaps taps_at(const Vec2f& uv) const;
  Colorf sum(const TexelTaps& taps) const;
  Colorf decoding_slope(const TexelTaps& taps) const;

  std::string name_;
  int width_, height_;
  std::vector<Colorf> pixels_;
  std::vector<float> alpha_;
  bool encoded_;
  Extension extension_;
  Interpolation interpolation_;
};

/// What a parameter of a material takes its value from instead of one constant.
struct FieldMap {
  int field = 0;                              ///< of Principled::fields
  std::shared_ptr<const Texture> texture;     ///< empty: the mesh's colour attribute itself
  std::string attribute;                      ///< UV map or colour attribute; empty: the first
  std::array<float, 6> uv{1, 0, 0, 0, 1, 0};  ///< 2x3, row-major: applied to (u, v, 1)

  Vec2f place(const Vec2f& at) const {
    return {uv[0] * at.x + uv[1] * at.y + uv[2], uv[3] * at.x + uv[4] * at.y + uv[5]};
  }
};

}  // namespace selenite
