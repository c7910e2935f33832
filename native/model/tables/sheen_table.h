// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace selenite {

/// The sheen lobe's two coefficients a, b and its albedo (see sheen.h), as rendered by Cycles, over
/// roughness and the viewer's cosine, both uniform on [0, 1]. All 0: no lobe.
extern const float kSheenTable[3][32][32];

}  // namespace selenite
