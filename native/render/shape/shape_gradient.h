// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <string_view>
#include <vector>

#include "render/driver/progress.h"
#include "render/film/film.h"
#include "render/film/render_settings.h"
#include "scene/scene.h"
#include "scene/vertex_normals.h"

namespace selenite {

/// The name of an object's vertices among its parameters.
inline constexpr const char* kVertexPositions = "vertex_positions";

/// The number of an object whose vertices can move, by its name. UnknownName: there is none.
/// InvalidArgument: it shares its mesh with another one.
int movable_object(const Scene& scene, std::string_view name);

/// The slope of a loss by each pixel of the mean picture.
using PictureLoss = std::function<Picture(const Film& film)>;

/// A picture, and the derivative of a loss by the vertices of one object.
struct ShapeGradient {
  Film film;
  std::vector<Vec3d> vertices;  ///< of the object's mesh, in the scene's coordinates
};

/// Renders, and differentiates a loss with respect to every vertex of an object, whose shading normals
/// follow from its vertices as `normals` says. The derivative is made of three integrals: of points that
/// move with the mesh, of its outline and creases in the picture, and of the shadows that it casts
/// (docs/method/shape.md says what is left out). It comes from other samples than the picture: for a
/// squared loss it is unbiased.
///
/// Equal settings give equal bytes whatever the number of threads. Throws Cancelled, InvalidArgument:
/// the object shares its mesh with another one.
ShapeGradient render_shape_gradient(const Scene& scene, const Camera& camera, int instance,
                                    const VertexNormals& normals, const RenderSettings& settings,
                                    const PictureLoss& loss, Progress* progress = nullptr);

/// This scene with other vertices of an object, in the scene's coordinates, and the normals that follow from them.
Scene with_vertices(const Scene& scene, int instance, const VertexNormals& normals,
                    const std::vector<Vec3f>& positions);

}  // namespace selenite
