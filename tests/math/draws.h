// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <limits>
#include <random>

namespace selenite {

/// Normally distributed numbers for data that tests make up, by the polar method. Those of
/// std::normal_distribution differ from one C++ library to the other; these are the ones of GNU's, everywhere.
template <class T>
class Normal {
 public:
  explicit Normal(T mean = 0, T deviation = 1) : mean_(mean), deviation_(deviation) {}

  T operator()(std::mt19937& random) {
    if (has_next_) {
      has_next_ = false;
      return next_ * deviation_ + mean_;
    }
    T x, y, squares;
    do {
      x = 2 * unit(random) - 1;
      y = 2 * unit(random) - 1;
      squares = x * x + y * y;
    } while (squares > 1 || squares == 0);
    const T factor = std::sqrt(-2 * std::log(squares) / squares);
    next_ = x * factor;
    has_next_ = true;
    return y * factor * deviation_ + mean_;
  }

 private:
  static T unit(std::mt19937& random) {
    return std::generate_canonical<T, std::numeric_limits<T>::digits>(random);
  }

  T mean_, deviation_, next_ = 0;
  bool has_next_ = false;
};

}  // namespace selenite
