// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/objective/image_prior.h"
#include "fit/problem/mesh_graph.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "MeshPriorOptions".
struct MeshPriorOptions {
  /// Standard deviation of the difference between neighbours, relative to the mean of the mesh.
  double difference = 0.2;
};

/// Adds what is known of the colours of a mesh before any photo to the gradient of a mean square:
/// neighbours are alike. The prior is as strong beside the photos as their residuals are large, as that
/// of an image; see `add_image_prior`. Where a pixel shows several values, they share its deviation.
/// `moving`: 1 for numbers that a photo has shown, 0 for those that stay, which pull nothing.
void add_mesh_prior(const MeshGraph& graph, const Vector& values, const Vector& moving,
                    const PriorScale& scale, Eigen::Ref<Vector> gradient,
                    const MeshPriorOptions& options = {});

}  // namespace selenite
