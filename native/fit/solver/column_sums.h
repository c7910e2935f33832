// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "fit/problem/saved_state.h"

namespace selenite {

/// Sums of a Jacobian's columns, 3 numbers a pixel. A column takes no memory until something is added to it.
/// The derivative by a colour differs from 0 in a single channel, and takes one number a pixel.
class ColumnSums {
 public:
  /// `channel`: the only one in which `column` differs from 0; -1: any. The same at each call for k.
  void add(Eigen::Index k, float factor, const Eigen::Ref<const Eigen::VectorXf>& column,
           int channel);
  void scale(float factor);
  void clear(Eigen::Index k);
  /// 0 where nothing has been added. `rows` in all.
  Eigen::VectorXf column(Eigen::Index k, Eigen::Index rows) const;
  bool is_zero(Eigen::Index k) const;
  void members(SavedState& state) { state(columns_); }

 private:
  struct Column {
    int channel = -1;
    Eigen::VectorXf sum{};
    void members(SavedState& state) { state(channel, sum); }
  };
  const Column* find(Eigen::Index k) const;

  std::vector<Column> columns_;
};

}  // namespace selenite
