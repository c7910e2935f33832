// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace selenite {

/// The Fourier transform of the eye's sensitivity to red, green and blue, over differences between
/// optical paths from 0 to kFilmReach nm, as rendered by Cycles (see devtools/measure_thin_film.py and
/// measure_film_of_5.py): magnitude and phase, or both parts. Beyond, the last one holds.
inline constexpr int kFilmNodes = 512;
inline constexpr double kFilmReach = 60000 / 6.283185307179586;
extern const float kFilmMagnitude[3][kFilmNodes], kFilmPhase[3][kFilmNodes];  // Blender 4
extern const float kFilmReal[3][kFilmNodes], kFilmImaginary[3][kFilmNodes];   // Blender 5

}  // namespace selenite
