// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "render/path/camera_samples.h"
#include "render/path/path_tracer.h"
#include "render/shape/moved_mesh.h"
#include "render/shape/scattering.h"

namespace selenite {

/// Paths whose points on the moved mesh move with it, and the derivatives of what they bring home
/// where nothing appears or disappears. Points after the first stay where they are on their triangles;
/// lamps and directions of the world stay as they are.
///
/// Source: Zhang, Miller, Yan, Gkioulekas, Zhao 2020, "Path-Space Differentiable Rendering"
/// (the interior integral). The boundaries are those of `Silhouettes` and `ShadowEdges`.
class MovedPaths {
 public:
  MovedPaths(const Prepared<0>& prepared, const PixelCamera& camera, int depth,
             const MovedMesh& mesh);
  MovedPaths(const MovedPaths&) = delete;  // members refer to `place_`
  MovedPaths& operator=(const MovedPaths&) = delete;

  /// Adds the derivatives of one sample of a pixel, whose radiance counts by `weight`.
  void add(CameraSamples::Sample& sample, const Colorf& weight, VertexSums& sums);

 private:
  /// A point of a path.
  struct Vertex {
    std::optional<Scattering> here;
    float distance = 0;  ///< from the point before
    PointSlopes slopes;  ///< by everything that has been found so far
    /// Of the factor towards the next point: how it changes, and what the path had found before.
    std::optional<ScatteringSlopes> onwards;
    Vec3f wo;
    Colorf before;
  };

  bool moves(int i) const { return mesh_.has(vertices_[i].here->hit); }
  /// Whether a factor at a point may change: it, the point before or the point after moves.
  bool matters(int i, bool next_moves) const {
    return moves(i) || next_moves || (i > 1 && moves(i - 1));
  }
  void add_light_sample(int i, const Path& path, const Random& random, const Colorf& weight,
                        const Colorf& beta, Colorf& total);
  /// A face hides from its points what lies below its own plane, however smooth it is shaded.
  void add_horizon(int i, const Path& path, const Random& random, const Colorf& weight,
                   VertexSums& sums);
  /// Of light from a direction in that plane, by the angle in it.
  void add_at_horizon(int i, const Path& path, const Random& random, const Vec3f& direction,
                      float distance, const Colorf& light, VertexSums& sums);
  /// By the directions at a point; `next` is the point that wo leads to, or none.
  void spread_directions(int i, const DirectionSlopes& slopes, const Vec3f& wo, Vertex* next);
  /// What the factors between points have brought about, and then all of it to the mesh.
  void finish(int count, const Colorf& weight, const Colorf& total, const Vec3f& direction,
              VertexSums& sums);

  const Prepared<0>& p_;
  int depth_;
  const MovedMesh& mesh_;
  CameraPlace place_;
  DirectLight<0> direct_;
  std::vector<Vertex> vertices_;
};

}  // namespace selenite
