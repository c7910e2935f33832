// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "image/photo_rows.h"
#include "image/resize.h"
#include "image/working/isolated_light.h"

namespace selenite {

/// What a mask's white means: what counts, or what does not.
enum class MaskKind { kInclude, kExclude };

/// A mask of any size, laid over a photo of the same shape. A pixel of the photo has the mean of the
/// mask where it lies, and 0 if any of that is 0. One that excludes is 0 where its picture is at
/// least half white.
class PhotoMask {
 public:
  /// Throws FileError: unreadable, or of another shape than the photo.
  PhotoMask(const std::string& path, const PictureInfo& photo, MaskKind kind = MaskKind::kInclude);

  /// Of the photo's row `y`, as many as the photo is wide.
  void row(int y, float* out) const;
  const PictureInfo& info() const { return info_; }
  const PixelCounts& counts() const { return counts_; }

 private:
  PictureInfo info_;
  PixelCounts counts_;
  std::vector<std::uint16_t> values_;
  std::vector<AreaSpan> across_, down_;
};

/// A photo's rows with their weights, alpha times masks, converted when they are asked for.
class WeightedRows {
 public:
  struct Row {
    std::vector<float> rgb;            ///< (width, 3)
    std::vector<float> weight;         ///< (width)
    std::vector<std::uint8_t> inside;  ///< (width): the weight is above 0
    std::vector<std::uint8_t> counts;  ///< (width): inside, and the pixel can be used
    std::vector<PixelUse> use;         ///< (width)
  };

  WeightedRows(const PhotoRows& photo, const std::vector<PhotoMask>& masks)
      : photo_(photo), masks_(masks), isolated_(photo.info().width, photo.info().height) {}
  /// Valid until `forget_before`.
  const Row& at(int y);
  /// Rows above `y` will not be asked for again.
  void forget_before(int y) { rows_.erase(rows_.begin(), rows_.lower_bound(y)); }
  const PictureInfo& info() const { return photo_.info(); }
  /// Of the rows that were asked for.
  const PixelCounts& counts() const { return counts_; }
  const IsolatedLight& isolated() const { return isolated_; }

 private:
  const PhotoRows& photo_;
  const std::vector<PhotoMask>& masks_;
  std::map<int, Row> rows_;
  PixelCounts counts_;
  IsolatedLight isolated_;
};

}  // namespace selenite
