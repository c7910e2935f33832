// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/working_size.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "image/file_error.h"
#include "image/limits.h"
#include "image/photo_rows.h"
#include "image/resize.h"
#include "math/error.h"

namespace selenite {
namespace {

constexpr float kMaskTop = 65535;  // a mask is kept in 16 bits

/// Mean of the channels in [0, 1]; 0 where the mask cannot be used.
std::vector<std::uint16_t> read_mask(const std::string& path, const PictureInfo& photo,
                                     WorkingPhoto& result) {
  const PhotoRows rows(path, false);
  result.mask_info = rows.info();
  const int width = rows.info().width, height = rows.info().height;
  if (width != photo.width || height != photo.height)
    refuse(path, "is a mask of " + size_text(width, height) + " pixels for a photo of " +
                     size_text(photo.width, photo.height) + "; give a mask of the photo's size");
  std::vector<std::uint16_t> mask;
  mask.reserve(static_cast<std::size_t>(width) * height);
  std::vector<float> rgb(3 * static_cast<std::size_t>(width)), alpha(rgb.size() / 3);
  std::vector<PixelUse> use(alpha.size());
  std::int64_t above = 0;
  for (int y = 0; y < height; ++y) {
    rows.convert(y, rgb.data(), alpha.data(), use.data());
    for (std::size_t x = 0; x < use.size(); ++x) {
      result.mask_counts.add(use[x]);
      const float mean = (rgb[3 * x] + rgb[3 * x + 1] + rgb[3 * x + 2]) / 3;
      above += mean > 1;
      const float value = use[x] == PixelUse::kCounts ? std::clamp(mean, 0.f, 1.f) : 0;
      mask.push_back(static_cast<std::uint16_t>(std::lround(value * kMaskTop)));
    }
  }
  for (std::string& text : rows.counted(result.mask_counts))
    result.mask_info.warnings.push_back(std::move(text));
  if (above > 0)
    result.mask_info.warnings.push_back(std::to_string(above) +
                                        " of its pixels are above 1 and count as 1");
  return mask;
}

/// One row of the photo, filtered across: red, green, blue, weight, and the share that is unusable.
constexpr std::size_t kPlanes = 5;

class FilteredRows {
 public:
  FilteredRows(const PhotoRows& rows, const std::vector<std::uint16_t>& mask, int width,
               PixelCounts& counts)
      : rows_(rows),
        mask_(mask),
        spans_(area_spans(rows.info().width, width)),
        counts_(counts),
        rgb_(3 * static_cast<std::size_t>(rows.info().width)),
        alpha_(rgb_.size() / 3),
        use_(alpha_.size()),
        row_(kPlanes * static_cast<std::size_t>(width)) {}

  /// Rows are asked for in order; each may be asked for again until the next.
  const std::vector<double>& at(int y) {
    if (y == current_) return row_;
    current_ = y;
    rows_.convert(y, rgb_.data(), alpha_.data(), use_.data());
    for (const PixelUse use : use_) counts_.add(use);
    std::fill(row_.begin(), row_.end(), 0.0);
    double* out = row_.data();
    for (const AreaSpan& span : spans_) {
      for (std::size_t i = 0; i < span.weights.size(); ++i)
        add(y, static_cast<std::size_t>(span.first) + i, span.weights[i], out);
      out += kPlanes;
    }
    return row_;
  }

 private:
  void add(int y, std::size_t x, double share, double* out) const {
    double weight = alpha_[x];
    if (!mask_.empty()) weight *= mask_[static_cast<std::size_t>(y) * use_.size() + x] / kMaskTop;
    for (std::size_t c = 0; c < 3; ++c) out[c] += share * rgb_[3 * x + c];
    out[3] += share * weight;
    if (use_[x] != PixelUse::kCounts || !(weight > 0)) out[4] += share;
  }

  const PhotoRows& rows_;
  const std::vector<std::uint16_t>& mask_;
  std::vector<AreaSpan> spans_;
  PixelCounts& counts_;
  int current_ = -1;
  std::vector<float> rgb_, alpha_;
  std::vector<PixelUse> use_;
  std::vector<double> row_;
};

}  // namespace

WorkingPhoto read_at_size(const std::string& path, const std::string& mask_path, int width,
                          int height) {
  WorkingPhoto result;
  std::vector<std::uint16_t> mask;
  if (!mask_path.empty()) {
    const PictureInfo photo = probe_photo(path);
    with_memory(mask_path, [&] { mask = read_mask(mask_path, photo, result); });
  }
  with_memory(path, [&] {
    const PhotoRows rows(path, true);
    result.info = rows.info();
    if (width < 1 || height < 1 || width > result.info.width || height > result.info.height)
      throw InvalidArgument("'" + path + "': size " + size_text(width, height) +
                            " must be at least 1 x 1 and at most that of the photo, " +
                            size_text(result.info.width, result.info.height));
    FilteredRows filtered(rows, mask, width, result.counts);
    std::vector<double> sum(kPlanes * static_cast<std::size_t>(width));
    for (const AreaSpan& span : area_spans(result.info.height, height)) {
      std::fill(sum.begin(), sum.end(), 0.0);
      for (std::size_t i = 0; i < span.weights.size(); ++i) {
        const std::vector<double>& row = filtered.at(span.first + static_cast<int>(i));
        for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += span.weights[i] * row[k];
      }
      for (std::size_t at = 0; at < sum.size(); at += kPlanes) {
        for (std::size_t c = 0; c < 3; ++c)
          result.reference.push_back(static_cast<float>(sum[at + c]));
        const bool counts = sum[at + 4] == 0;  // a sum of shares, none of which is below 0
        result.weight.push_back(counts ? static_cast<float>(sum[at + 3]) : 0.f);
      }
    }
    for (std::string& text : rows.counted(result.counts))
      result.info.warnings.push_back(std::move(text));
  });
  return result;
}

}  // namespace selenite
