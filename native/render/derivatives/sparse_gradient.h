// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <vector>

#include "math/color.h"

namespace selenite {

/// Derivatives by the voxels or texels that the paths of one tile have met. Sums are made in the order
/// of the samples, so that they are the same bytes whichever thread makes them.
class SparseGradient {
 public:
  void add(std::uint32_t place, const Colorf& derivative) {
    if (2 * entries_.size() >= numbers_.size()) grow();
    std::uint32_t& number = number_of(place);
    if (number == 0) {
      entries_.push_back({place, {}});
      number = static_cast<std::uint32_t>(entries_.size());
    }
    entries_[number - 1].value += Color<double>(derivative);
  }

  /// Calls `sink(place, derivative)` for each place, in the order in which they were met.
  template <class Sink>
  void each(Sink&& sink) const {
    for (const Entry& entry : entries_) sink(entry.place, entry.value);
  }

  /// Adds everything to `dense`, three numbers a place or their sum.
  template <class T>
  void add_to(T* dense, int channels) const {
    for (const Entry& entry : entries_) {
      T* to = dense + static_cast<std::size_t>(entry.place) * channels;
      if (channels == 1)
        *to += static_cast<T>(entry.value.r + entry.value.g + entry.value.b);
      else
        for (int c = 0; c < 3; ++c) to[c] += static_cast<T>(entry.value[c]);
    }
  }

 private:
  struct Entry {
    std::uint32_t place;
    Color<double> value;
  };

  /// That of the place's entry, counted from 1, or the 0 that is to become it.
  std::uint32_t& number_of(std::uint32_t place) {
    const std::size_t mask = numbers_.size() - 1;
    // Fibonacci hashing: neighbours lie far apart.
    std::size_t at = (place * 0x9E3779B97F4A7C15ull) >> shift_;
    while (numbers_[at] != 0 && entries_[numbers_[at] - 1].place != place) at = (at + 1) & mask;
    return numbers_[at];
  }
  void grow() {
    const std::size_t size = std::max<std::size_t>(kLeast, 2 * numbers_.size());
    shift_ = 64 - std::countr_zero(size);
    numbers_.assign(size, 0);
    for (std::size_t i = 0; i < entries_.size(); ++i)
      number_of(entries_[i].place) = static_cast<std::uint32_t>(i + 1);
  }

  static constexpr std::size_t kLeast = 1 << 6;
  std::vector<Entry> entries_;  ///< one a place, in the order in which they were met
  /// Hash table of entries by place: a power of two, at least half empty.
  std::vector<std::uint32_t> numbers_;
  int shift_ = 0;
};

}  // namespace selenite
