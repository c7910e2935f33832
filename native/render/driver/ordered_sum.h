// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <map>
#include <mutex>
#include <utility>
#include <vector>

#include "render/derivatives/sparse_gradient.h"

namespace selenite {

/// Adds the gradients of tiles in tile order, whichever is finished first.
class OrderedSum {
 public:
  /// `channels`: of each gradient, numbers a place.
  OrderedSum(std::vector<int> channels, std::vector<std::vector<double>>& sums)
      : channels_(std::move(channels)), sums_(sums) {}

  void add(int tile, std::vector<SparseGradient> gradients) {
    const std::scoped_lock lock(mutex_);
    waiting_.emplace(tile, std::move(gradients));
    while (!waiting_.empty() && waiting_.begin()->first == next_) {
      for (std::size_t f = 0; f < channels_.size(); ++f)
        waiting_.begin()->second[f].add_to(sums_[f].data(), channels_[f]);
      waiting_.erase(waiting_.begin());
      ++next_;
    }
  }

 private:
  std::vector<int> channels_;
  std::vector<std::vector<double>>& sums_;
  std::mutex mutex_;
  std::map<int, std::vector<SparseGradient>> waiting_;
  int next_ = 0;
};

}  // namespace selenite
