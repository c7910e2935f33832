// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/column_sums.h"

#include <algorithm>

namespace selenite {
namespace {

using Channel = Eigen::InnerStride<3>;

}  // namespace

void ColumnSums::add(Eigen::Index k, float factor, const Eigen::Ref<const Eigen::VectorXf>& column,
                     int channel) {
  columns_.resize(std::max(columns_.size(), static_cast<std::size_t>(k) + 1));
  Column& to = columns_[static_cast<std::size_t>(k)];
  const Eigen::Index size = channel < 0 ? column.size() : column.size() / 3;
  if (to.sum.size() == 0) {
    to.channel = channel;
    to.sum.setZero(size);
  }
  if (channel < 0)
    to.sum += factor * column;
  else
    to.sum += factor * Eigen::Map<const Eigen::VectorXf, 0, Channel>(column.data() + channel, size);
}

void ColumnSums::scale(float factor) {
  for (Column& one : columns_) one.sum *= factor;
}

void ColumnSums::clear(Eigen::Index k) {
  if (find(k)) columns_[static_cast<std::size_t>(k)] = {};
}

Eigen::VectorXf ColumnSums::column(Eigen::Index k, Eigen::Index rows) const {
  const Column* const one = find(k);
  if (!one) return Eigen::VectorXf::Zero(rows);
  if (one->channel < 0) return one->sum;
  Eigen::VectorXf whole = Eigen::VectorXf::Zero(rows);
  Eigen::Map<Eigen::VectorXf, 0, Channel>(whole.data() + one->channel, one->sum.size()) = one->sum;
  return whole;
}

bool ColumnSums::is_zero(Eigen::Index k) const {
  const Column* const one = find(k);
  return !one || (one->sum.array() == 0).all();
}

/// Null: nothing has been added to it.
const ColumnSums::Column* ColumnSums::find(Eigen::Index k) const {
  const auto i = static_cast<std::size_t>(k);
  return i < columns_.size() && columns_[i].sum.size() > 0 ? &columns_[i] : nullptr;
}

}  // namespace selenite
