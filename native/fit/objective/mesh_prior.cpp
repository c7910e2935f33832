// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/objective/mesh_prior.h"

#include <algorithm>

#include "math/scalar.h"

namespace selenite {

void add_mesh_prior(const MeshGraph& graph, const Vector& values, const Vector& moving,
                    const PriorScale& scale, Eigen::Ref<Vector> gradient,
                    const MeshPriorOptions& options) {
  if (scale.loss <= 0) return;
  const Eigen::Index channels = values.size() / graph.size();
  for (Eigen::Index c = 0; c < channels; ++c) {
    const auto channel = Eigen::seqN(c, graph.size(), channels);
    const double shown = moving(channel).sum();
    const double mean = values(channel).dot(moving(channel)) / std::max(shown, 1.0);
    if (mean <= 0) continue;
    const double grain = std::min(1.0, scale.count / 3 / shown);  // pixels a value
    const double strength =
        2 * scale.loss / scale.count * grain / square(options.difference * mean);
    for (const auto& [a, b] : graph.edges()) {
      const Eigen::Index i = channels * a + c, j = channels * b + c;
      const double pull = strength * moving[i] * moving[j] * (values[i] - values[j]);
      gradient[i] += pull;
      gradient[j] -= pull;
    }
  }
}

}  // namespace selenite
