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
/// Neighbours whose values differ by less than this share are alike but for rounding of floats.
constexpr double kAlike = 1e-5;
/// Of neighbours at the top of one channel, the share in which another one changes, from which on
/// the light went on. In an even area none does; steps of eight bits hide most of a flat slope.
constexpr double kChangingShare = 0.1;
constexpr double kBackgroundShare = 0.2;  // of the picture's border that a background takes

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

/// What the numbers of one channel say.
struct Top {
  double value = std::numeric_limits<double>::infinity();  ///< its maximum
  ClippingLevel level;
  /// The level comes from the shape of areas alone, of which an even one can have ends as soft
  bool is_by_shape = false;

  bool holds(double stored) const { return stored >= value * (1 - kAlike); }
};

template <class T>
Top top_of(const Plane<T>& plane) {
  LargestValues largest;
  Top top;
  if constexpr (std::is_integral_v<T>) {
    const std::vector<std::int64_t> counts = histogram(plane);
    for (std::size_t value = 0; value < counts.size(); ++value)
      if (counts[value] > 0) largest.add(static_cast<double>(value), counts[value]);
    if (const double own = top_of_integers(counts, largest); own > 0) {
      top.value = top.level.from = own;
      top.level.maximum = largest.maximum();
      return top;
    }
  } else {
    for (int y = 0; y < plane.height; ++y)
      for (int x = 0; x < plane.width; ++x) largest.add(plane.at(x, y));
  }
  if (largest.empty() || !(largest.maximum() > 0)) return top;
  top.value = top.level.maximum = largest.maximum();
  const bool is_white = std::is_floating_point_v<T> && top.value == 1;
  const bool piles_up = largest.at_maximum() >= kFewest &&
                        static_cast<double>(largest.at_maximum()) >= kPile * largest.below();
  if (!is_white && (!piles_up || largest.below() == 0)) return top;
  const Ends ends = ends_of_areas(plane, top.value, largest.step());
  const double slopes = ends.all > 0 ? static_cast<double>(ends.slopes) / ends.all : 0;
  if (is_white) {
    top.level.is_even_white = piles_up && ends.all >= kEnds && slopes < kEdgeShare;
    if (!top.level.is_even_white) top.level.from = top.value;
    top.level.is_guessed = !top.level.is_even_white;
  } else if (ends.all >= kEnds && slopes >= kSlopeShare) {
    top.level.from = top.value;
    top.level.is_guessed = top.is_by_shape = true;
  }
  return top;
}

/// What the other channels do where one is at its top.
enum class Others { kGoOn, kAreEven, kAreAtTheirTop };

template <class T>
Others others_at_top(const std::array<Plane<T>, 3>& planes, const std::array<Top, 3>& tops,
                     std::size_t channel) {
  int pairs = 0, changes = 0;
  const auto judge_pair = [&](int x, int y, int dx, int dy) {
    if (!tops[channel].holds(planes[channel].at(x + dx, y + dy))) return;
    for (std::size_t other = 0; other < 3; ++other) {
      const double first = planes[other].at(x, y), second = planes[other].at(x + dx, y + dy);
      if (!(first > 0 && second > 0) || tops[other].holds(first) || tops[other].holds(second))
        continue;
      ++pairs;
      changes += std::abs(first - second) > kAlike * first;
    }
  };
  for (int y = 0; y < planes[0].height; ++y)
    for (int x = 0; x < planes[0].width; ++x) {
      if (!tops[channel].holds(planes[channel].at(x, y))) continue;
      if (x + 1 < planes[0].width) judge_pair(x, y, 1, 0);
      if (y + 1 < planes[0].height) judge_pair(x, y, 0, 1);
    }
  if (pairs < kEnds) return Others::kAreAtTheirTop;
  return changes >= kChangingShare * pairs ? Others::kGoOn : Others::kAreEven;
}

/// Whether the top of a channel takes so much of the border that it is what stands behind.
template <class T>
bool is_background(const Plane<T>& plane, const Top& top) {
  int all = 0, held = 0;
  const auto count = [&](int x, int y) {
    ++all;
    held += top.holds(plane.at(x, y));
  };
  for (int x = 0; x < plane.width; ++x) {
    count(x, 0);
    count(x, plane.height - 1);
  }
  for (int y = 0; y < plane.height; ++y) {
    count(0, y);
    count(plane.width - 1, y);
  }
  return held >= kBackgroundShare * all;
}

/// Takes back levels that an even area feigns: a clear sky or a backdrop whose ends are soft.
template <class T>
void keep_even_areas(const std::array<Plane<T>, 3>& planes, std::array<Top, 3>& tops, bool grey) {
  std::array<Others, 3> others{};
  bool any_goes_on = false;
  for (std::size_t c = 0; c < 3; ++c) {
    if (!tops[c].is_by_shape) continue;
    others[c] = others_at_top(planes, tops, c);
    any_goes_on |= others[c] == Others::kGoOn;
  }
  const auto [lowest, highest] = std::minmax({tops[0].value, tops[1].value, tops[2].value});
  const bool is_coloured = !grey && highest - lowest > kAlike * highest;
  for (std::size_t c = 0; c < 3; ++c) {
    if (!tops[c].is_by_shape || others[c] == Others::kGoOn) continue;
    const bool is_even = others[c] == Others::kAreEven ||
                         (!any_goes_on && (is_coloured || is_background(planes[c], tops[c])));
    if (is_even) tops[c].level = {.maximum = tops[c].value};
  }
}

}  // namespace

std::array<ClippingLevel, 3> clipping_levels(const Samples& samples) {
  std::array<ClippingLevel, 3> levels;
  std::visit(
      [&](const auto& values) {
        using T = typename std::decay_t<decltype(values)>::value_type;
        std::array<Plane<T>, 3> planes{};
        std::array<Top, 3> tops;
        for (std::size_t c = 0; c < 3; ++c) {
          planes[c] = {values.data() + samples.color[c],
                       static_cast<std::ptrdiff_t>(samples.channels), samples.width,
                       samples.height};
          tops[c] = c > 0 && samples.grey() ? tops[0] : top_of(planes[c]);
        }
        keep_even_areas(planes, tops, samples.grey());
        for (std::size_t c = 0; c < 3; ++c) levels[c] = tops[c].level;
      },
      samples.values);
  return levels;
}

}  // namespace selenite
