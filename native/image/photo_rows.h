// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "image/clipping.h"
#include "image/color/encoding.h"
#include "image/read.h"
#include "image/response.h"

namespace selenite {

/// Shares of a photo's pixels that do not count for their code values.
struct UnusedShares {
  double clipped = 0, too_dark = 0;

  /// Of all pixels.
  static UnusedShares of(const PixelCounts& counts);
};

/// A decoded picture, of which rows are converted to linear Rec. 709 when they are asked for.
class PhotoRows {
 public:
  /// Decodes the file. A mask (`as_linear` false) keeps its stored values, divided by the top of
  /// integers. Throws FileError.
  PhotoRows(const std::string& path, bool as_linear, const Response& response = {});

  /// What is known once all is decoded; `warnings` without those that `remarks` adds.
  const PictureInfo& info() const { return info_; }
  bool has_alpha() const { return samples_.alpha >= 0; }

  /// Row `y` of the frame: `rgb` (width, 3), `alpha` (width) and `use` (width). What is not
  /// finite is 0 in `rgb`, as are channels below 0. Noise around 0 in floats is kept.
  void convert(int y, float* rgb, float* alpha, PixelUse* use) const;

  /// Warnings of pixels that do not count; `counts` is of the whole frame, `unused` of what could
  /// count: what a mask leaves out is nothing to tell.
  std::vector<std::string> remarks(const PixelCounts& counts, const UnusedShares& unused) const;

 private:
  template <class T>
  void convert_values(const std::vector<T>& values, int y, float* rgb, float* alpha,
                      PixelUse* use) const;
  /// The same for a row that tables hold all of: integers that fill the frame, without alpha, of
  /// finite colours in Rec. 709.
  template <class T>
  void look_up(const T* in, float* rgb, float* alpha, PixelUse* use) const;
  int top() const;              ///< of stored values: of integers, or 1
  std::string clipped() const;  ///< in words, with its levels
  std::string clipping_cure() const;
  float decode(std::size_t channel, double stored) const;
  PixelUse counted(std::size_t channel, double stored) const;
  PixelUse finish(float* rgb) const;

  bool as_linear_;
  float below_zero_ = 0;  ///< how far noise around 0 goes below it, in stored values
  PictureInfo info_;
  Samples samples_;
  ColorEncoding encoding_;
  std::array<ClippingLevel, 3> clipping_;
  std::array<CodeRange, 3> counted_;           ///< as stored
  std::array<std::vector<float>, 3> tables_;   ///< of integers
  std::array<std::vector<PixelUse>, 3> uses_;  ///< of integers
  bool is_plain_ = false;                      ///< see `look_up`
};

}  // namespace selenite
