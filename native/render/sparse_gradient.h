// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "math/color.h"

namespace selenite {

/// Derivatives by the voxels or texels that the paths of one tile have met. Sums are made in the order of the
/// samples, so that they are the same bytes whichever thread makes them.
class SparseGradient {
 public:
  void add(std::uint32_t place, const Colorf& derivative) {
    entries_.push_back({place, Color<double>(derivative)});
    if (entries_.size() >= most_) compress();
  }

  /// Adds everything to `dense`, three numbers a place or their sum.
  void add_to(std::vector<double>& dense, int channels) {
    compress();
    for (const Entry& entry : entries_) {
      double* to = dense.data() + static_cast<std::size_t>(entry.place) * channels;
      if (channels == 1)
        *to += entry.value.r + entry.value.g + entry.value.b;
      else
        for (int c = 0; c < 3; ++c) to[c] += entry.value[c];
    }
  }

  /// One entry a place.
  void compress() {
    std::stable_sort(entries_.begin(), entries_.end(),
                     [](const Entry& a, const Entry& b) { return a.place < b.place; });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      if (kept > 0 && entries_[kept - 1].place == entries_[i].place)
        entries_[kept - 1].value += entries_[i].value;
      else
        entries_[kept++] = entries_[i];
    }
    entries_.resize(kept);
    most_ = std::max(kLeast, 2 * kept);
  }

 private:
  struct Entry {
    std::uint32_t place;
    Color<double> value;
  };
  static constexpr std::size_t kLeast = 1 << 14;
  std::vector<Entry> entries_;
  std::size_t most_ = kLeast;
};

}  // namespace selenite
