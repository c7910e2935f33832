// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace selenite {

/// Which closure, in the order of the alternatives of Closure.
enum class ClosureKind {
  kPrincipled,
  kDiffuse,
  kGlossy,
  kGlass,
  kRefraction,
  kTranslucent,
  kTransparent,
  kEmission,
  kSubsurface,
  kSheen,
  kMetallic,
  kConductor
};

}  // namespace selenite
