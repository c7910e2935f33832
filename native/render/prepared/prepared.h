// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <vector>

#include "render/prepared/light_radiance.h"
#include "render/prepared/light_sampler.h"
#include "render/prepared/media_bounds.h"
#include "render/prepared/prepared_material.h"
#include "render/prepared/refraction_spread.h"
#include "render/prepared/visibility.h"

namespace selenite {

/// Everything that one render reads, worked out once from scene and layout: seeded materials, what
/// lights emit and how they are chosen.
template <int L>
struct Prepared {
  /// `fields`: grids and images that are unknown; in the kernel that keeps a tape, without `layout`.
  Prepared(const Scene& scene, const SlotLayout& layout, std::span<const FieldRef> fields = {});
  Prepared(const Prepared&) = delete;  // members refer to `scene`
  Prepared& operator=(const Prepared&) = delete;

  const Scene scene;  ///< with the world's rotation in its `to_map`
  const Geometry& geometry;
  std::vector<PreparedMaterial<L>> materials;
  Visibility visibility;
  PreparedMaterial<L>
      exit;  ///< white and Lambertian: where light leaves after subsurface scattering
  LightRadiance<L> emitted;  ///< by lamps and the world
  LightSampler lights;
  std::vector<int>
      lamps;  ///< those that are on, by their numbers in the scene: no ray asks for others
  /// How the surfaces of bodies with a medium refract light out of them, by the constants of their
  /// materials: one each of these, eta 0 for others. None where there is no lamp to aim at.
  std::vector<RefractionSpread> boundaries;
  /// The lamps that paths inside these bodies aim at, with the probability of each; see RefractedLight.
  std::vector<int> aims;
  int environment_field;  ///< the number of the world's image among the fields of unknowns
  int slots;
  int slot_room;  ///< that many with what is added behind the last one
  /// How much a derivative counts beside the value when Russian roulette decides. Measured: a tenth
  /// gives the least variance times time; more keeps paths for derivatives that few of them feel.
  SlotScales roulette_scales{};
  bool any_transparent = false, any_medium = false;
  bool any_bump = false;  ///< a shader asks how large a pixel is on the surface
  MediaBounds media_bounds;
};

}  // namespace selenite
