// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/working/outline.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace selenite {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

bool Outline::finite() const {
  return std::all_of(corners_.begin(), corners_.begin() + count_,
                     [](const Corner& c) { return std::isfinite(c.x) && std::isfinite(c.y); });
}

double Outline::area() const {
  double twice = 0;
  for (std::size_t i = 2; i < count_; ++i) {
    const Corner &a = corners_[0], &b = corners_[i - 1], &c = corners_[i];
    twice += (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
  }
  return std::abs(twice) / 2;
}

double Outline::extreme(double Corner::*side, bool most) const {
  double found = corners_[0].*side;
  for (std::size_t i = 1; i < count_; ++i)
    found = most ? std::max(found, corners_[i].*side) : std::min(found, corners_[i].*side);
  return found;
}

Outline Outline::between(double Corner::*side, double low) const {
  const double least = extreme(side, false), most = extreme(side, true);
  if (least >= low && most <= low + 1) return *this;
  if (side == &Corner::x) return clipped<&Corner::x>(low, 1).clipped<&Corner::x>(low + 1, -1);
  return clipped<&Corner::y>(low, 1).clipped<&Corner::y>(low + 1, -1);
}

template <double Corner::*kSide>
Outline Outline::clipped(double limit, double sign) const {
  Outline out;
  for (std::size_t i = 0; i < count_; ++i) {
    const Corner &a = corners_[i], &b = corners_[i + 1 < count_ ? i + 1 : 0];
    const double above_a = sign * (a.*kSide - limit), above_b = sign * (b.*kSide - limit);
    if (above_a >= 0) out.add(a);
    if ((above_a > 0 && above_b < 0) || (above_a < 0 && above_b > 0)) {
      const double share = above_a / (above_a - above_b);
      Corner cut{a.x + share * (b.x - a.x), a.y + share * (b.y - a.y)};
      cut.*kSide = limit;
      out.add(cut);
    }
  }
  return out;
}

std::pair<double, double> Outline::whole_columns(double y) const {
  double top[2] = {kInfinity, -kInfinity}, bottom[2] = {kInfinity, -kInfinity};
  for (std::size_t i = 0; i < count_; ++i) {
    const Corner& c = corners_[i];
    if (c.y != y && c.y != y + 1) return {kInfinity, -kInfinity};
    double* ends = c.y == y ? top : bottom;
    ends[0] = std::min(ends[0], c.x);
    ends[1] = std::max(ends[1], c.x);
  }
  return {std::max(top[0], bottom[0]), std::min(top[1], bottom[1])};
}

void Outline::add(const Corner& corner) {
  if (count_ < corners_.size()) corners_[count_++] = corner;  // more only if it is not convex
}

}  // namespace selenite
