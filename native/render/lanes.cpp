// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/lanes.h"

namespace selenite {
namespace {

template <int L>
bool suits_lanes(const Prepared<L>& prepared, int index) {
  const PreparedMaterial<L>& m = prepared.materials[index];
  const auto absent = [](const auto& x) { return value_of(x) == 0 && !has_slope(x); };
  return m.maps->empty() && !m.transparent && !(m.emitter_density > 0) &&
         absent(m.values.subsurface_weight) && absent(m.values.sheen_weight) && !m.albedo_grid &&
         !m.density_grid && (!m.has_medium || m.sealed);
}

/// Of bodies with a medium and their materials.
template <int L>
int count_media(const Prepared<L>& prepared) {
  int count = 0;
  for (const Instance& instance : prepared.geometry.instances()) {
    std::vector<int> found;
    for (const int m : instance.materials)
      if (prepared.materials[m].has_medium &&
          std::find(found.begin(), found.end(), m) == found.end())
        found.push_back(m);
    count += static_cast<int>(found.size());
  }
  return count;
}

}  // namespace

bool has_lanes() {
#if defined(SELENITE_LANES)
  static const bool supported = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  return supported;
#else
  return false;
#endif
}

template <int L>
bool suits_lanes(const Prepared<L>& prepared) {
  for (int i = 0; i < static_cast<int>(prepared.materials.size()); ++i)
    if (!suits_lanes(prepared, i)) return false;
  return count_media(prepared) <= 1;
}

template bool suits_lanes(const Prepared<0>&);
template bool suits_lanes(const Prepared<2>&);
template bool suits_lanes(const Prepared<4>&);
template bool suits_lanes(const Prepared<8>&);

}  // namespace selenite
