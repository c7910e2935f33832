// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/working/weighted_rows.h"

#include <algorithm>
#include <cmath>

#include "image/file_error.h"
#include "image/limits.h"

namespace selenite {
namespace {

constexpr float kMaskTop = 65535;  // a mask is kept in 16 bits

/// Equal up to one pixel of the smaller picture, since sizes are whole numbers; no icon is a mask.
bool same_shape(const PictureInfo& a, const PictureInfo& b) {
  const double ratio =
      static_cast<double>(a.width) * b.height / (static_cast<double>(a.height) * b.width);
  constexpr double kMost = 0.05;
  const int least = std::min({a.width, a.height, b.width, b.height});
  return std::abs(ratio - 1) <= std::min(kMost, 1.0 / least);
}

}  // namespace

PhotoMask::PhotoMask(const std::string& path, const PictureInfo& photo, MaskKind kind) {
  const PhotoRows rows(path, false);
  info_ = rows.info();
  const int width = info_.width, height = info_.height;
  if (!same_shape(info_, photo))
    refuse(path,
           "is a mask of " + size_text(width, height) + " pixels for a photo of " +
               size_text(photo.width, photo.height),
           "give a mask of the photo's shape");
  across_ = area_spans(width, photo.width);
  down_ = area_spans(height, photo.height);
  values_.reserve(static_cast<std::size_t>(width) * height);
  std::vector<float> rgb(3 * static_cast<std::size_t>(width)), alpha(rgb.size() / 3);
  std::vector<PixelUse> use(alpha.size());
  std::int64_t above = 0;
  for (int y = 0; y < height; ++y) {
    rows.convert(y, rgb.data(), alpha.data(), use.data());
    for (std::size_t x = 0; x < use.size(); ++x) {
      counts_.add(use[x]);
      const float mean = (rgb[3 * x] + rgb[3 * x + 1] + rgb[3 * x + 2]) / 3;
      above += mean > 1;
      float value = use[x] == PixelUse::kCounts ? std::clamp(mean, 0.f, 1.f) : 0;
      if (kind == MaskKind::kExclude)
        value = use[x] == PixelUse::kCounts && mean < 0.5f ? 1.f : 0.f;
      values_.push_back(static_cast<std::uint16_t>(std::lround(value * kMaskTop)));
    }
  }
  for (std::string& text : rows.remarks(counts_, UnusedShares::of(counts_)))
    info_.warnings.push_back(std::move(text));
  if (above > 0)
    info_.warnings.push_back(std::to_string(above) + " of its pixels are above 1 and count as 1");
}

void PhotoMask::row(int y, float* out) const {
  const AreaSpan& rows = down_[static_cast<std::size_t>(y)];
  for (const AreaSpan& columns : across_) {
    double sum = 0;
    bool whole = true;
    for (std::size_t j = 0; j < rows.weights.size(); ++j) {
      const std::uint16_t* in =
          values_.data() + (static_cast<std::size_t>(rows.first) + j) * info_.width + columns.first;
      for (std::size_t i = 0; i < columns.weights.size(); ++i) {
        whole = whole && in[i] > 0;
        sum += rows.weights[j] * columns.weights[i] * in[i];
      }
    }
    *out++ = whole ? static_cast<float>(sum) / kMaskTop : 0;
  }
}

const WeightedRows::Row& WeightedRows::at(int y) {
  const auto [found, is_new] = rows_.try_emplace(y);
  Row& row = found->second;
  if (!is_new) return row;
  const std::size_t width = static_cast<std::size_t>(info().width);
  row.rgb.resize(3 * width);
  row.weight.resize(width);
  row.inside.resize(width);
  row.counts.resize(width);
  row.use.resize(width);
  photo_.convert(y, row.rgb.data(), row.weight.data(), row.use.data());
  std::vector<float> mask(width);
  for (const PhotoMask& part : masks_) {
    part.row(y, mask.data());
    for (std::size_t x = 0; x < width; ++x) row.weight[x] *= mask[x];
  }
  const float* weight = row.weight.data();
  const PixelUse* use = row.use.data();
  std::uint8_t *inside = row.inside.data(), *counts = row.counts.data();
  PixelCounts of_row;
  for (std::size_t x = 0; x < width; ++x) of_row.add(use[x]);
  counts_.add(of_row);
  for (std::size_t x = 0; x < width; ++x) {
    const bool is_inside = weight[x] > 0;
    inside[x] = is_inside;
    counts[x] = is_inside && use[x] == PixelUse::kCounts;
  }
  isolated_.add(y, row.rgb.data(), row.inside.data());
  return row;
}

}  // namespace selenite
