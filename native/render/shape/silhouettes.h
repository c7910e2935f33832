// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>

#include "render/film/pixel_sums.h"
#include "render/film/render_settings.h"
#include "render/path/path_tracer.h"
#include "render/shape/mesh_edges.h"

namespace selenite {

/// How many samples of edges there are: some for each sample a pixel and pixel along the sides.
int edge_samples(const RenderSettings& settings);

/// The derivative of a picture by where the edges of the moved mesh lie in it. Radiance jumps at its
/// outline and at creases, and at any edge where a face ends that lies in its own shadow, however smooth
/// it is shaded.
///
/// Source: Li, Aittala, Durand, Lehtinen 2018, "Differentiable Monte Carlo Ray Tracing through Edge
/// Sampling" (the edges seen by the camera).
class Silhouettes {
 public:
  /// `weights`: of the picture's pixels, row by row.
  Silhouettes(const Prepared<0>& prepared, const PixelCamera& camera,
              const RenderSettings& settings, const MovedMesh& mesh,
              const std::vector<MeshEdge>& edges, const std::vector<Colorf>& weights);

  /// What is seen along a camera ray that has met something, or nothing.
  using Seeing = std::function<Colorf(const Ray&, const std::optional<Hit>&, Random&)>;
  /// Adds sample `i` of `count`, stratified along the edges.
  void add(const Seeing& see, int i, int count, VertexSums& sums) const;

 private:
  /// An edge in the picture.
  struct Seen {
    int from, to;  ///< vertices
    Vec2<double> start, end;
    /// Of both ends: how far they move across the edge, by their position.
    Vec3f start_slope, end_slope;
    Vec2<double> across;  ///< unit, in pixels
    float nearest = 0;    ///< distance of the nearer end from the camera
    float share = 1;      ///< its length over its weight in the choice
  };
  /// What is seen at a place in the picture; sets whether something before the edge hides it.
  Colorf seen_at(const Seeing& see, const Vec2<double>& place, const Seen& edge, Random& random,
                 bool& hidden) const;

  const Prepared<0>& p_;
  const PixelCamera& camera_;
  const RenderSettings& settings_;
  const std::vector<Colorf>& weights_;
  std::vector<Seen> edges_;
  EdgeChoice choice_;
};

}  // namespace selenite
