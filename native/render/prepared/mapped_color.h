// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "scene/geometry.h"
#include "scene/texture.h"
#include "scene/vertex_colors.h"

namespace selenite {

/// What an image or a colour attribute of a material holds at a hit.
Colorf mapped_color(const FieldMap& map, const Geometry& geometry, const MeshColors& mesh_colors,
                    const Hit& hit);

}  // namespace selenite
