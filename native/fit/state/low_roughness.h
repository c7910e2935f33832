// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/evaluate/validation.h"

namespace selenite {

/// With every roughness lowered to where reflections and refractions look perfectly sharp.
Vector at_low_roughness(const Unknowns& unknowns, Vector x);
bool is_low_roughness(const Unknowns& unknowns, const Vector& x);

/// Whether `one` explains the photos about as well as `other`: within the standard error of its validation
/// and that of their difference. The noise of a validation alone would hide a gloss that shows pixel against
/// pixel; that of the difference alone is as large as the difference where all of it is one mirrored lamp
/// in one pixel.
///
/// Errors of texels and voxels look like roughness, so that of two that are about as good the one of low
/// roughness is nearer to the truth.
bool explains_as_well(const Validation& one, const Validation& other);

}  // namespace selenite
