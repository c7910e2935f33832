// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <utility>

namespace selenite {

struct Corner {
  double x, y;
};

/// A convex polygon: the outline of a pixel in a photo, or what is left of it between lines.
class Outline {
 public:
  Outline(const Corner& a, const Corner& b, const Corner& c, const Corner& d)
      : corners_{a, b, c, d}, count_(4) {}

  bool empty() const { return count_ == 0; }
  bool finite() const;
  double area() const;
  double least_x() const { return extreme(&Corner::x, false); }
  double most_x() const { return extreme(&Corner::x, true); }
  double least_y() const { return extreme(&Corner::y, false); }
  double most_y() const { return extreme(&Corner::y, true); }
  /// What lies between x and x + 1, or y and y + 1.
  Outline in_column(double x) const { return between(&Corner::x, x); }
  Outline in_row(double y) const { return between(&Corner::y, y); }
  /// Of what `in_row` returned for the same y: the x between which it is as high as the row. Where it
  /// has a corner within the row, nowhere: the first is larger than the second.
  std::pair<double, double> whole_columns(double y) const;

 private:
  Outline() = default;
  void add(const Corner& corner);
  double extreme(double Corner::*side, bool most) const;
  Outline between(double Corner::*side, double low) const;
  /// What lies above `limit`, for a sign of 1, or below it, for -1 (Sutherland and Hodgman).
  template <double Corner::*kSide>
  Outline clipped(double limit, double sign) const;

  std::array<Corner, 8> corners_{};  // each of four lines adds one to the four at most
  std::size_t count_ = 0;
};

}  // namespace selenite
