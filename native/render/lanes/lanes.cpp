// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/lanes/lanes.h"

#include <set>
#include <tuple>
#include <type_traits>

#include "math/instruction_set.h"
#include "math/processor.h"
#include "render/lanes/lane_textures.h"

namespace selenite {
namespace {

/// What the first lobe of `TopLobes` that a material has is seen as; null: it has none.
template <class Values, class Acts, class... Top>
const char* top_lobe(const Values& values, const Acts& acts,
                     std::type_identity<std::tuple<Top...>>) {
  const char* found = nullptr;
  ((found = !found && acts(Top::share(values)) ? Top::kSeenAs : found), ...);
  return found;
}

/// What of a material alone is in the way; null if nothing is.
template <int L>
const char* obstacle(const PreparedMaterial<L>& m) {
  const auto acts = [](const auto& x) { return value_of(x) != 0 || has_slope(x); };
  if (m.shader) return "is a graph of closures";
  if (!m.maps->empty() && !colours_diffuse_alone(m)) return "has textures";
  if (m.transparent) return "lets rays pass straight through (alpha)";
  if (m.emissive) return "emits light";
  if (acts(m.values.subsurface_weight)) return "scatters light under its surface";
  if (const char* top = top_lobe(m.values, acts, std::type_identity<TopLobes<PathScalar<L>>>()))
    return top;
  if (!m.has_medium) return nullptr;
  if (m.density_grid || m.albedo_grid) return "has a medium that varies";
  if (!m.sealed) return "has a medium into which light may be seen (a lamp near it, or an opening)";
  return nullptr;
}

}  // namespace

bool has_lanes() {
#if defined(SELENITE_LANES)
  static const bool supported = has_avx2() && !avx2_is_forbidden();
  return supported;
#else
  return false;
#endif
}

template <int L>
std::string lanes_obstacle(const Prepared<L>& prepared) {
  if (std::string hidden = prepared.visibility.lanes_obstacle(); !hidden.empty()) return hidden;
  const auto& materials = prepared.materials;
  for (std::size_t i = 0; i < materials.size(); ++i)
    if (const char* what = obstacle(materials[i]))
      return "material '" + prepared.scene.appearance.materials[i].name + "' " + what;
  if (prepared.emitted.is_rotation_ticked()) return "the rotation of the world is differentiated";
  if (!prepared.boundaries.empty()) return "a small lamp shines through a surface on a medium";
  std::set<std::pair<std::size_t, int>> media;  // objects and materials
  const auto& instances = prepared.geometry.instances();
  for (std::size_t i = 0; i < instances.size(); ++i)
    for (const int m : instances[i].materials)
      if (materials[m].has_medium) media.emplace(i, m);
  if (media.size() > 1) return "there is more than one body with a medium";
  return {};
}

std::string lanes_obstacle(const Scene& scene) {
  if (!has_lanes()) return "this processor or this build has no AVX2";
  return lanes_obstacle(Prepared<0>(scene, SlotLayout()));
}

template std::string lanes_obstacle(const Prepared<0>&);
template std::string lanes_obstacle(const Prepared<2>&);
template std::string lanes_obstacle(const Prepared<4>&);
template std::string lanes_obstacle(const Prepared<8>&);

}  // namespace selenite
