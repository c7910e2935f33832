// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/prepared/visibility.h"

#include <limits>

namespace selenite {

Visibility::Visibility(const Scene& scene, const std::vector<bool>& transparent) {
  const auto add = [this](RayKinds kinds, RayKinds wanted) {
    uneven = uneven || (kinds & wanted) != wanted;
  };
  constexpr int kNoLimit = std::numeric_limits<int>::max();
  const auto& [materials, lights, world, mesh_colors] = scene.appearance;
  for (const Instance& object : scene.geometry->instances()) {
    add(object.visible_to, kScatteredRays | kShadowRay);
    uneven = uneven || !object.links.are_all();
    hidden_media = hidden_media || !(object.visible_to & kShadowRay);
    holdouts = holdouts || object.holdout;
  }
  for (const Light& light : lights) {
    if (!light.on) continue;
    add(light.visible_to, kScatteredRays);
    uneven = uneven || !light.casts_shadows || !light.met_by_rays || light.max_bounces < kNoLimit ||
             !light.links.are_all();
    shadow_links = shadow_links || light.links.shading != LinkedSets::kAll;
    seen_lamps = seen_lamps || (light.visible_to & kCameraRay);
  }
  if (world.on) {
    add(world.visible_to, kScatteredRays);
    uneven = uneven || world.max_bounces < kNoLimit;
    for (const Backdrop& one : world.backdrops) uneven = uneven || one.seen_by != kCameraRay;
  }
  film_through_glass = world.transparent_film && world.film_roughness >= 0;
  for (std::size_t m = 0; m < materials.size(); ++m)
    uneven = uneven || (transparent[m] && !materials[m].transparent_shadows);
}

std::string Visibility::lanes_obstacle() const {
  if (uneven) return "an object or a light is hidden from some of the rays";
  if (holdouts) return "an object is a holdout";
  if (film_through_glass) return "the film is transparent behind glass";
  return {};
}

}  // namespace selenite
