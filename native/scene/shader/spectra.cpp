// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/shader/spectra.h"

namespace selenite::shading {

const BlackbodyPiece& blackbody_piece(double) {
  static const BlackbodyPiece k{};
  return k;
}

}  // namespace selenite::shading
