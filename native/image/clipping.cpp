// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/clipping.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <type_traits>

namespace selenite {
namespace {

// The rule above; the tests count its false alarms.
constexpr std::int64_t kFewest = 16;      // pixels that share the maximum
constexpr double kPile = 8;               // times as many as share a value below
constexpr std::size_t kValuesBelow = 32;  // that are compared with
constexpr double kSlopeShare = 0.5;       // of the ends of areas that fall away as a slope
constexpr double kEdgeShare = 0.25;       // of them in an even area, which has edges
constexpr int kEnds = 8;                  // needed to judge
constexpr int kReach = 4;                 // pixels that an end is judged by
/// A slope falls evenly: of what is lost over four pixels, the last two steps lose this share. At an
/// edge, which a camera or a pixel filter blurs over two pixels, they lose nearly nothing.
constexpr double kSteadyShare = 0.3;
/// A cut top would have risen by as many steps of the stored numbers; rounding alone makes one or two.
constexpr double kOvershoot = 8;
/// Noise on a cut slope leaves gaps between pixels at the top, which are less deep than this share
/// of it; a thin object in front of an even area makes deeper ones.
constexpr double kShallowGap = 0.15;

/// One channel of a picture.
template <class T>
struct Plane {
  const T* first;
  std::ptrdiff_t step;
  int width, height;

  double at(int x, int y) const {
    return first[(static_cast<std::ptrdiff_t>(y) * width + x) * step];
  }
};

/// How often the maximum and the values next to it occur.
class LargestValues {
 public:
  void add(double value, std::int64_t count = 1) {
    if (!std::isfinite(value)) return;
    if (counts_.size() > kValuesBelow && value < counts_.begin()->first) return;
    counts_[value] += count;
    if (counts_.size() > kValuesBelow + 1) counts_.erase(counts_.begin());
  }
  bool empty() const { return counts_.empty(); }
  double maximum() const { return counts_.rbegin()->first; }
  std::int64_t at_maximum() const { return counts_.rbegin()->second; }
  /// Mean number of pixels that share a value below the maximum; 0 if there is no other value.
  double below() const {
    std::int64_t sum = 0;
    for (auto item = counts_.begin(); item != std::prev(counts_.end()); ++item) sum += item->second;
    return counts_.size() > 1 ? static_cast<double>(sum) / static_cast<double>(counts_.size() - 1)
                              : 0;
  }
  /// Smallest difference of neighbouring values.
  double step() const {
    double smallest = std::numeric_limits<double>::infinity();
    for (auto item = std::next(counts_.begin()); item != counts_.end(); ++item)
      smallest = std::min(smallest, item->first - std::prev(item)->first);
    return smallest;
  }

 private:
  std::map<double, std::int64_t> counts_;  // of the largest values
};

/// How areas of the maximum end along rows and columns.
struct Ends {
  int slopes = 0, all = 0;
};

/// An area of `length` pixels at `top` ends, and `values` follow.
void judge(double top, int length, const std::array<double, kReach>& values, double step,
           Ends& ends) {
  for (const double value : values)
    if (!std::isfinite(value) || value >= top) return;
  ++ends.all;
  const double lost = top - values[3], last_steps = values[1] - values[3];
  const bool is_steady = last_steps >= kSteadyShare * lost;
  const double overshoot = last_steps / 2 * length / 2;
  if (is_steady && overshoot >= kOvershoot * step) ++ends.slopes;
}

/// A gap between two areas on one line, down to `lowest`.
void judge_gap(double top, double lowest, double step, Ends& ends) {
  const double depth = top - lowest;
  if (!(depth >= kOvershoot * step && depth <= kShallowGap * top)) return;
  ++ends.all;
  ++ends.slopes;
}

/// `value(i)` along a line of `count` pixels.
template <class Value>
void judge_line(const Value& value, int count, double top, double step, Ends& ends) {
  for (int i = 0; i < count; ++i) {
    if (value(i) != top) continue;
    const int begin = i;
    while (i + 1 < count && value(i + 1) == top) ++i;
    const int length = i - begin + 1;
    std::array<double, kReach> outside{};
    if (begin >= kReach) {
      for (int k = 0; k < kReach; ++k) outside[static_cast<std::size_t>(k)] = value(begin - 1 - k);
      judge(top, length, outside, step, ends);
    }
    double lowest = top;
    for (int k = 1; k <= kReach && i + k < count; ++k) {
      if (value(i + k) == top) {
        judge_gap(top, lowest, step, ends);
        break;
      }
      lowest = std::min(lowest, value(i + k));
    }
    if (i + kReach < count) {
      for (int k = 0; k < kReach; ++k) outside[static_cast<std::size_t>(k)] = value(i + 1 + k);
      judge(top, length, outside, step, ends);
    }
  }
}

template <class T>
Ends ends_of_areas(const Plane<T>& plane, double top, double step) {
  Ends ends;
  for (int y = 0; y < plane.height; ++y)
    judge_line([&](int x) { return plane.at(x, y); }, plane.width, top, step, ends);
  for (int x = 0; x < plane.width; ++x)
    judge_line([&](int y) { return plane.at(x, y); }, plane.height, top, step, ends);
  return ends;
}

/// How often each integer occurs.
template <class T>
std::vector<std::int64_t> histogram(const Plane<T>& plane) {
  std::vector<std::int64_t> counts(std::size_t{std::numeric_limits<T>::max()} + 1);
  const std::ptrdiff_t end = plane.step * plane.width * plane.height;
  for (std::ptrdiff_t at = 0; at < end; at += plane.step) ++counts[plane.first[at]];
  return counts;
}

/// The top that integers have by themselves; 0 if the maximum is below it.
double top_of_integers(const std::vector<std::int64_t>& counts, const LargestValues& largest) {
  const auto top = static_cast<unsigned>(counts.size() - 1);
  if (largest.maximum() >= top - 1) return top - 1;
  if (top <= std::numeric_limits<std::uint8_t>::max()) return 0;
  unsigned bits = 0;  // that are set in any value
  for (unsigned value = 0; value <= top; ++value)
    if (counts[value] > 0) bits |= value;
  constexpr int kMostShift = 8;  // 8 bits in 16
  const int shift = std::countr_zero(bits);
  if (shift >= 1 && shift <= kMostShift && largest.maximum() == (top >> shift << shift))
    return largest.maximum();
  for (const unsigned own : {1023u, 4095u, 16383u})
    if (largest.maximum() == own && largest.at_maximum() >= kFewest) return own;
  return 0;
}

template <class T>
ClippingLevel level_of(const Plane<T>& plane) {
  LargestValues largest;
  ClippingLevel level;
  if constexpr (std::is_integral_v<T>) {
    const std::vector<std::int64_t> counts = histogram(plane);
    for (std::size_t value = 0; value < counts.size(); ++value)
      if (counts[value] > 0) largest.add(static_cast<double>(value), counts[value]);
    if (const double top = top_of_integers(counts, largest); top > 0) {
      level.from = top;
      return level;
    }
  } else {
    for (int y = 0; y < plane.height; ++y)
      for (int x = 0; x < plane.width; ++x) largest.add(plane.at(x, y));
  }
  if (largest.empty() || !(largest.maximum() > 0)) return level;
  const double top = largest.maximum();
  const bool is_white = std::is_floating_point_v<T> && top == 1;
  const bool piles_up = largest.at_maximum() >= kFewest &&
                        static_cast<double>(largest.at_maximum()) >= kPile * largest.below();
  if (!is_white && (!piles_up || largest.below() == 0)) return level;
  const Ends ends = ends_of_areas(plane, top, largest.step());
  const double slopes = ends.all > 0 ? static_cast<double>(ends.slopes) / ends.all : 0;
  if (is_white) {
    level.is_even_white = piles_up && ends.all >= kEnds && slopes < kEdgeShare;
    if (!level.is_even_white) level.from = top;
  } else if (ends.all >= kEnds && slopes >= kSlopeShare) {
    level.from = top;
  }
  return level;
}

}  // namespace

std::array<ClippingLevel, 3> clipping_levels(const Samples& samples) {
  std::array<ClippingLevel, 3> levels;
  std::visit(
      [&](const auto& values) {
        using T = typename std::decay_t<decltype(values)>::value_type;
        for (std::size_t c = 0; c < 3; ++c) {
          if (c > 0 && samples.grey()) {
            levels[c] = levels[0];
            continue;
          }
          levels[c] = level_of(Plane<T>{values.data() + samples.color[c],
                                        static_cast<std::ptrdiff_t>(samples.channels),
                                        samples.width, samples.height});
        }
      },
      samples.values);
  return levels;
}

}  // namespace selenite
