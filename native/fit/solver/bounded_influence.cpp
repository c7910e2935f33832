// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/bounded_influence.h"

#include <algorithm>
#include <vector>

namespace selenite {

Eigen::ArrayXf bounded_influence(const Eigen::ArrayXf& strength, int columns,
                                 const BoundedInfluenceOptions& options) {
  Eigen::ArrayXf factors = Eigen::ArrayXf::Ones(strength.size());
  const int rows = static_cast<int>(strength.size()) / columns;
  std::vector<float> around;
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) {
      const Eigen::Index here = static_cast<Eigen::Index>(y) * columns + x;
      if (strength[here] <= 0) continue;
      around.clear();
      for (int q = std::max(y - options.radius, 0); q <= std::min(y + options.radius, rows - 1);
           ++q)
        for (int p = std::max(x - options.radius, 0);
             p <= std::min(x + options.radius, columns - 1); ++p) {
          const float one = strength[static_cast<Eigen::Index>(q) * columns + p];
          if (one > 0) around.push_back(one);
        }
      const auto middle = around.begin() + (std::ssize(around) - 1) / 2;
      std::nth_element(around.begin(), middle, around.end());
      factors[here] = std::min(1.f, static_cast<float>(options.most) * *middle / strength[here]);
    }
  return factors;
}

}  // namespace selenite
