// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/working/isolated_light.h"

#include <algorithm>
#include <numeric>

namespace selenite {
namespace {

constexpr float kTimes = 3;  // as bright as the neighbours

}  // namespace

void IsolatedLight::add(int y, const float* rgb, const std::uint8_t* inside) {
  Row row;
  row.level.resize(static_cast<std::size_t>(width_));
  float* levels = row.level.data();
  double light = light_;  // in a register: `inside` might point to the member
  for (std::size_t x = 0; x < static_cast<std::size_t>(width_); ++x) {
    const float level = (rgb[3 * x] + rgb[3 * x + 1] + rgb[3 * x + 2]) / 3;
    levels[x] = inside[x] != 0 ? std::max(level, 0.f) : -1;
    if (inside[x] != 0) light += static_cast<double>(level);
  }
  light_ = light;
  for (int middle = y - 1; middle <= y + 1; ++middle) row.uses += judged(middle) ? 1 : 0;
  if (row.uses == 0) return;
  rows_.emplace(y, std::move(row));
  const auto here = [&](int at) { return rows_.count(at) > 0; };
  for (int middle = y - 1; middle <= y + 1; ++middle)
    if (judged(middle) && here(middle - 1) && here(middle) && here(middle + 1)) judge(middle);
}

/// Between the rows beside it; what no other row needs is forgotten.
void IsolatedLight::judge(int y) {
  std::array<const float*, 3> rows{};
  for (std::size_t i = 0; i < 3; ++i) rows[i] = rows_.at(y - 1 + static_cast<int>(i)).level.data();
  for (std::size_t x = 1; x + 1 < static_cast<std::size_t>(width_); ++x) {
    const float level = rows[1][x];
    if (level <= kTimes * std::min(rows[1][x - 1], rows[1][x + 1])) continue;  // most are not
    float first = -1, second = -1, least = level;                              // of the neighbours
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t at = x - 1; at <= x + 1; ++at) {
        if (i == 1 && at == x) continue;
        const float other = rows[i][at];
        least = std::min(least, other);
        second = std::max(second, std::min(first, other));
        first = std::max(first, other);
      }
    if (least < 0 || !(level > kTimes * second)) continue;
    ++count_;
    const double more = static_cast<double>(level) - static_cast<double>(second);
    beyond_ += more;
    const auto dimmest = std::min_element(brightest_.begin(), brightest_.end());
    *dimmest = std::max(*dimmest, more);
  }
  for (int at = y - 1; at <= y + 1; ++at)
    if (--rows_.at(at).uses == 0) rows_.erase(at);
}

double IsolatedLight::share() const {
  const double left_out = std::accumulate(brightest_.begin(), brightest_.end(), 0.0);
  return light_ > 0 ? std::max(beyond_ - left_out, 0.0) / light_ : 0;
}

}  // namespace selenite
