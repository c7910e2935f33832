// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/damping_control.h"

#include <algorithm>
#include <cmath>

#include "fit/problem/saved_state.h"

namespace selenite {

bool DampingControl::rejects(const NoisyLoss& loss) {
  if (!best_ || last_step_ <= options_.large_step || rejected_ >= options_.most_rejections)
    return false;
  const double noise = std::sqrt(loss.variance + best_->loss.variance);
  const double best = best_->loss.value;
  if (!(loss.value > best + options_.worse_sigmas * noise + options_.worse_by * std::abs(best)))
    return false;
  ++rejected_;
  damping_ *= options_.increase;
  last_step_ = 0;  // back to where the sums were made
  return true;
}

void DampingControl::accept(double least) {
  if (rejected_ == 0) damping_ *= options_.decrease;
  raise_to(least);
  rejected_ = 0;
}

void DampingControl::raise_to(double least) { damping_ = std::max(damping_, least); }

double DampingControl::kept() const {
  return std::max(options_.least_kept, std::exp(-std::pow(last_step_ / options_.forget_at, 2)));
}

void DampingControl::note_loss(const NoisyLoss& loss, const Vector& u) {
  if (!best_ || loss.value < best_->loss.value) best_ = {loss, u};
}

void DampingControl::reset() { *this = DampingControl(options_); }

void DampingControl::Best::members(SavedState& state) { state(loss, u); }

void DampingControl::members(SavedState& state) { state(damping_, last_step_, rejected_, best_); }

}  // namespace selenite
