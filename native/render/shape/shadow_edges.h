// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "render/film/pixel_sums.h"
#include "render/film/render_settings.h"
#include "render/path/path_tracer.h"
#include "render/shape/mesh_edges.h"
#include "render/shape/scattering.h"

namespace selenite {

/// The derivative of a picture by the shadows of the moved mesh, where the camera sees them: on other
/// objects and on itself. Light grazes an edge on its way from a lamp or the world to a point that is
/// seen; a sample starts from the edge and finds both.
///
/// Source: Zhang, Miller, Yan, Gkioulekas, Zhao 2020, "Path-Space Differentiable Rendering" (boundary
/// paths from their middle).
class ShadowEdges {
 public:
  ShadowEdges(const Prepared<0>& prepared, const PixelCamera& camera,
              const RenderSettings& settings, const MovedMesh& mesh,
              const std::vector<MeshEdge>& edges, const std::vector<Colorf>& weights);

  /// Adds sample `i` of `count` for each kind of light.
  void add(int i, int count, VertexSums& sums) const;

 private:
  /// A lamp and the edges that may hide a part of it.
  struct OfLamp {
    int lamp;
    EdgeChoice choice;
  };
  /// Light that grazes a point of an edge.
  struct Grazing {
    const MeshEdge& edge;
    float along;      ///< share of the edge's end in the point
    Vec3f direction;  ///< towards the light
    float distance;   ///< of the light
    Colorf light;     ///< its radiance over the density of the sample
    const LinkedSets& links;
  };
  void add_of_lamp(const OfLamp& lamp, const Random& random, double u, int count,
                   VertexSums& sums) const;
  void add_of_world(const Random& random, double u, int count, VertexSums& sums) const;
  void add(const Grazing& grazing, const Random& random, VertexSums& sums) const;

  const Prepared<0>& p_;
  const PixelCamera& camera_;
  const RenderSettings& settings_;
  const MovedMesh& mesh_;
  const std::vector<MeshEdge>& edges_;
  const std::vector<Colorf>& weights_;
  CameraPlace place_;
  DirectLight<0> direct_;
  std::vector<OfLamp> lamps_;
  EdgeChoice world_;
};

}  // namespace selenite
