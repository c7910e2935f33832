// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

#include "scene/scene.h"

namespace selenite {

/// Gives a material the shader that a dict describes. Registers are numbered through: `constants`,
/// `literals`, then a result for each entry of `code`.
///
/// constants: [{name, value: 1 or 3 numbers, and the rest of a row of `parameters`}]
/// literals: [(r, g, b)]; names: [str], of attributes; textures: [index of add_texture]
/// tables: [{values: (257, 3), low, high}]
/// code: [{op, in: [register], mode: name or number, flags: [name], item, shift, width}]
/// closures: [{kind, inputs: {parameter: register}, weight, normal, tangent, distribution, flavour,
///             subsurface, physical_refraction}]
/// images: [{name, texture: of `textures`, attribute: UV map, uv: (2, 3), channels: 1 or 3}], those that
///   can be unknown; may be left out
///
/// KeyError: a name that is none of the known ones. ValueError: a number that does not fit.
void set_shader(Material& material, const std::vector<std::shared_ptr<const Texture>>& textures,
                const pybind11::dict& values);

Flavour make_flavour(bool multi_ggx, const std::string& version, const std::string& subsurface);

}  // namespace selenite
