// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace selenite {

/// Magnitude and phase of the Fourier transform of the eye's sensitivity to red, green and blue, over
/// differences between optical paths from 0 to kFilmReach nm, as rendered by Cycles (see
/// devtools/measure_thin_film.py). Beyond, the last one holds.
inline constexpr int kFilmNodes = 512;
inline constexpr double kFilmReach = 60000 / 6.283185307179586;
extern const float kFilmMagnitude[3][kFilmNodes], kFilmPhase[3][kFilmNodes];

}  // namespace selenite
