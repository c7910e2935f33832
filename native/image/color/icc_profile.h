// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <string>

#include "image/color/primaries.h"
#include "image/color/transfer_curve.h"

namespace selenite {

/// An ICC profile of the matrix/TRC or grey kind, with colours relative to its white.
struct IccProfile {
  std::string name;
  bool grey = false;
  std::array<TransferCurve, 3> curves;  ///< a grey profile repeats its one
  Matrix3 to_rec709 = kIdentity3;
};

/// Throws FileError about `path` unless all that the profile's table names lies inside it.
void check_icc_layout(const std::string& path, const std::string& bytes);

/// Reads a profile with Little CMS. Throws FileError about `path` when it is damaged, or maps
/// colours by a table, or is of other spaces than RGB, grey and XYZ, which are not converted here.
IccProfile read_icc_profile(const std::string& path, const std::string& bytes);

}  // namespace selenite
