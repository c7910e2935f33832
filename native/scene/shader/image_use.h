// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace selenite {

struct Shader;

/// Whether a texture of a shader is the colour of Normal Map nodes and nothing else: it encodes unit vectors.
bool encodes_normals(const Shader& shader, int texture);

}  // namespace selenite
