// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <span>

#include "math/vec.h"

namespace selenite {

/// Whether the side behind a surface is the inside of something: every edge has one face on each
/// side, and every connected piece faces outwards, or into a hollow of the others. Then a line from
/// any point of it, begun behind it, meets it again.
bool encloses(std::span<const Vec3f> positions, std::span<const std::array<int, 3>> triangles);

}  // namespace selenite
