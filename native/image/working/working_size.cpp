// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/working/working_size.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "image/file_error.h"
#include "image/limits.h"
#include "image/photo_rows.h"
#include "image/resize.h"
#include "image/working/outline.h"
#include "image/working/weighted_rows.h"
#include "math/fault.h"

namespace selenite {
namespace {

/// Sums over the part of a photo below a pixel: red, green, blue, weight, the share that does not
/// count, the share that is not inside, and of what is inside the shares that are clipped and too
/// dark.
constexpr std::size_t kPlanes = 8;
using Sums = std::array<double, kPlanes>;

void add_pixel(const WeightedRows::Row& row, std::size_t x, double share, double* out) {
  for (std::size_t c = 0; c < 3; ++c) out[c] += share * row.rgb[3 * x + c];
  out[3] += share * row.weight[x];
  if (row.counts[x]) return;
  out[4] += share;
  if (!row.inside[x]) {
    out[5] += share;
  } else if (row.use[x] == PixelUse::kClipped) {
    out[6] += share;
  } else if (row.use[x] == PixelUse::kTooDark) {
    out[7] += share;
  }
}

/// Takes in the pixels of the result, and how much of what could count is clipped or too dark.
class Taken {
 public:
  Taken(const std::vector<std::uint8_t>& within, WorkingPhoto& result)
      : within_(within), result_(result) {}
  void append(const double* sums);
  UnusedShares unused() const {
    const double inside = std::max(inside_, 1e-12);
    return {clipped_ / inside, too_dark_ / inside};
  }

 private:
  const std::vector<std::uint8_t>& within_;
  WorkingPhoto& result_;
  double inside_ = 0, clipped_ = 0, too_dark_ = 0;
};

void Taken::append(const double* sums) {
  WorkingPhoto& result = result_;
  if (within_.empty() || within_[result.inside.size()] != 0) {
    inside_ += 1 - std::min(sums[5], 1.0);
    clipped_ += sums[6];
    too_dark_ += sums[7];
  }
  for (std::size_t c = 0; c < 3; ++c) result.reference.push_back(static_cast<float>(sums[c]));
  // Sums of shares, none of which is below 0.
  result.weight.push_back(sums[4] == 0 ? static_cast<float>(sums[3]) : 0.f);
  // Rounding makes no pixel whole.
  const auto share = static_cast<float>(1 - std::min(sums[5], 1.0));
  result.inside.push_back(sums[5] == 0 ? 1 : std::min(share, std::nextafter(1.f, 0.f)));
}

/// One row of the photo, filtered across.
class FilteredRows {
 public:
  FilteredRows(WeightedRows& rows, int width)
      : rows_(rows),
        spans_(area_spans(rows.info().width, width)),
        row_(kPlanes * static_cast<std::size_t>(width)) {}

  /// Rows are asked for in order; each may be asked for again until the next.
  const std::vector<double>& at(int y) {
    if (y == current_) return row_;
    current_ = y;
    rows_.forget_before(y);
    const WeightedRows::Row& row = rows_.at(y);
    std::fill(row_.begin(), row_.end(), 0.0);
    double* out = row_.data();
    for (const AreaSpan& span : spans_) {
      for (std::size_t i = 0; i < span.weights.size(); ++i)
        add_pixel(row, static_cast<std::size_t>(span.first) + i, span.weights[i], out);
      out += kPlanes;
    }
    return row_;
  }

 private:
  WeightedRows& rows_;
  std::vector<AreaSpan> spans_;
  int current_ = -1;
  std::vector<double> row_;
};

void filter_evenly(WeightedRows& rows, int width, int height, Taken& result) {
  FilteredRows filtered(rows, width);
  std::vector<double> sum(kPlanes * static_cast<std::size_t>(width));
  for (const AreaSpan& span : area_spans(rows.info().height, height)) {
    std::fill(sum.begin(), sum.end(), 0.0);
    for (std::size_t i = 0; i < span.weights.size(); ++i) {
      const std::vector<double>& row = filtered.at(span.first + static_cast<int>(i));
      for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += span.weights[i] * row[k];
    }
    for (std::size_t at = 0; at < sum.size(); at += kPlanes) result.append(sum.data() + at);
  }
}

/// What rounding leaves of a pixel of the photo beside an outline, as a share of that.
constexpr double kSliver = 1e-7;

/// Mean over an outline: a pixel of the photo has the share of the area that both have.
Sums filter_outline(WeightedRows& rows, const Outline& outline) {
  Sums sums{};
  const double area = outline.finite() ? outline.area() : 0;
  if (!(area > 0)) {
    sums[4] = 1;
    return sums;
  }
  const auto first = [](double least) {
    return static_cast<int>(std::max(0.0, std::floor(least)));
  };
  const auto end = [](double most, int size) {
    return static_cast<int>(std::clamp(std::ceil(most), 0.0, static_cast<double>(size)));
  };
  double covered = 0;
  const int bottom = end(outline.most_y(), rows.info().height);
  for (int y = first(std::min(outline.least_y(), 1e9)); y < bottom; ++y) {
    const Outline strip = outline.in_row(y);
    if (strip.empty()) continue;
    const WeightedRows::Row& row = rows.at(y);
    const auto [from, to] = strip.whole_columns(y);
    const int right = end(strip.most_x(), rows.info().width);
    for (int x = first(std::min(strip.least_x(), 1e9)); x < right; ++x) {
      const bool whole = x >= from && x + 1 <= to;
      const double share = (whole ? 1 : strip.in_column(x).area()) / area;
      covered += share;
      if (share > kSliver) add_pixel(row, static_cast<std::size_t>(x), share, sums.data());
    }
  }
  if (covered < 1 - kSliver) sums[4] += 1 - covered;  // the rest is outside
  return sums;
}

/// The first row of the photo that each row of corners, or one below it, needs.
std::vector<int> first_rows(const std::vector<Corner>& corners, int width, int height, int rows) {
  std::vector<int> first(static_cast<std::size_t>(height) + 1);
  double least = rows;
  const std::size_t stride = static_cast<std::size_t>(width) + 1;
  for (std::size_t y = first.size(); y-- > 0;) {
    for (std::size_t x = 0; x < stride; ++x)
      if (const double at = corners[y * stride + x].y; at < least) least = std::max(at, 0.0);
    first[y] = static_cast<int>(least);
  }
  return first;
}

void filter_outlines(WeightedRows& rows, int width, int height, const std::vector<double>& numbers,
                     Taken& result) {
  std::vector<Corner> corners;
  for (std::size_t i = 0; i < numbers.size(); i += 2)
    corners.push_back({numbers[i], numbers[i + 1]});
  const std::vector<int> first = first_rows(corners, width, height, rows.info().height);
  const std::size_t stride = static_cast<std::size_t>(width) + 1;
  for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
    rows.forget_before(first[y]);
    for (std::size_t x = 0; x + 1 < stride; ++x) {
      const Corner* top = corners.data() + y * stride + x;
      const Outline outline(top[0], top[1], top[stride + 1], top[stride]);
      result.append(filter_outline(rows, outline).data());
    }
  }
}

void check_size(const std::string& path, int width, int height, const Reading& reading,
                const PictureInfo& photo) {
  if (width < 1 || height < 1 || width > photo.width || height > photo.height)
    throw Refused("'" + path + "'", "size " + size_text(width, height) +
                                        " must be at least 1 x 1 and at most that of the photo, " +
                                        size_text(photo.width, photo.height));
  const std::size_t corners =
      2 * (static_cast<std::size_t>(width) + 1) * (static_cast<std::size_t>(height) + 1);
  if (!reading.within.empty() &&
      reading.within.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
    throw Refused("'" + path + "'", std::to_string(reading.within.size()) +
                                        " values of what is within for " +
                                        size_text(width, height) + " pixels");
  if (!reading.corners.empty() && reading.corners.size() != corners)
    throw Refused("'" + path + "'", std::to_string(reading.corners.size()) +
                                        " numbers for the corners of " + size_text(width, height) +
                                        " pixels, which have " + std::to_string(corners));
}

void report_isolated(const IsolatedLight& isolated, WorkingPhoto& result) {
  constexpr double kWorthSaying = 0.01;
  if (!(isolated.share() > kWorthSaying)) return;
  result.isolated = isolated.share();
  std::array<char, 32> percent{};
  std::snprintf(percent.data(), percent.size(), "%.1f%%", 100 * result.isolated);
  result.info.warnings.push_back(
      std::string(percent.data()) + " of its light is in " + std::to_string(isolated.count()) +
      " isolated bright pixels, as in a render with too few samples: values may be wrong by more "
      "than their intervals say; render it with more samples or larger lamps");
}

}  // namespace

WorkingPhoto read_at_size(const std::string& path, int width, int height, const Reading& reading) {
  WorkingPhoto result;
  std::vector<PhotoMask> masks;
  for (const MaskFile& file : reading.masks) {
    const PictureInfo photo = probe_photo(path);
    with_memory(file.path, [&] { masks.emplace_back(file.path, photo, file.kind); });
    result.masks.push_back({masks.back().info(), masks.back().counts()});
  }
  with_memory(path, [&] {
    const PhotoRows photo(path, true, reading.response);
    result.info = photo.info();
    check_size(path, width, height, reading, result.info);
    WeightedRows rows(photo, masks);
    Taken taken(reading.within, result);
    if (reading.corners.empty()) {
      filter_evenly(rows, width, height, taken);
    } else {
      filter_outlines(rows, width, height, reading.corners, taken);
    }
    result.counts = rows.counts();
    for (std::string& text : photo.remarks(result.counts, taken.unused()))
      result.info.warnings.push_back(std::move(text));
    report_isolated(rows.isolated(), result);
  });
  return result;
}

}  // namespace selenite
