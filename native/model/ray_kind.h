// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

namespace selenite {

/// What a ray is to the objects and lights on its way, as Blender's ray visibility distinguishes rays: by
/// the scattering that it comes from. A ray that goes straight through a surface stays what it was.
enum RayKind : std::uint8_t {
  kCameraRay = 1,
  kDiffuseRay = 2,
  kGlossyRay = 4,  ///< reflected
  kTransmissionRay = 8,
  kScatterRay = 16,  ///< in a medium
  kShadowRay = 32    ///< from a point that is lit to the light
};

/// A set of them.
using RayKinds = std::uint8_t;
inline constexpr RayKinds kScatteredRays =
    kDiffuseRay | kGlossyRay | kTransmissionRay | kScatterRay;
inline constexpr RayKinds kAllRays = kCameraRay | kScatteredRays | kShadowRay;

}  // namespace selenite
