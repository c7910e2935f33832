// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "render/shape/shape_gradient.h"

namespace selenite {

/// Whether an image or colours lie on the surface of an object.
bool has_image(const Scene& scene, int instance);

/// As `render_shape_gradient`, for shading normals that stay as they are on each ray, and direct light.
/// What normals shade has nearly all the noise of a derivative, and an image that is fitted, too, takes
/// it up. Outlines, shadows and the image itself still say where the surface is.
ShapeGradient render_fixed_normals_gradient(const Scene& scene, const Camera& camera, int instance,
                                            const VertexNormals& normals,
                                            const RenderSettings& settings, const PictureLoss& loss,
                                            Progress* progress = nullptr);

}  // namespace selenite
