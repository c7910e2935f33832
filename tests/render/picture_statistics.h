// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "math/statistics.h"
#include "render/driver/render.h"

namespace selenite {

inline RenderSettings settings_of(int size, int spp, std::uint64_t seed = 1, int depth = 0) {
  RenderSettings s;
  s.width = s.height = size;
  s.spp = spp;
  s.seed = seed;
  s.depth = depth;
  s.threads = 1;
  return s;
}

inline Film render_view(const Scene& scene, const RenderSettings& settings,
                        const SlotLayout& layout = {}) {
  return render(scene, scene.cameras.at(0), layout, settings);
}

/// Mean of a channel over the picture; its error from the pixels' own variances.
inline Estimate mean_of(const Picture& mean, const Picture& variance, int channel = 0) {
  double sum = 0, error2 = 0;
  for (std::size_t i = 0; i < mean.size(); ++i) {
    sum += mean[i][channel];
    error2 += variance[i][channel];
  }
  const auto n = static_cast<double>(mean.size());
  return {sum / n, std::sqrt(std::max(error2, 0.0)) / n};
}
inline Estimate mean_of(const Film& film, int channel = 0) {
  return mean_of(film.mean, film.variance, channel);
}
inline Estimate slope_of(const Film& film, int slot, int channel = 0) {
  return mean_of(film.slots.at(slot).mean, film.slots.at(slot).variance, channel);
}

inline SlotLayout ticked(const Scene& scene,
                         const std::vector<std::pair<std::string, std::string>>& names) {
  std::vector<ParameterRef> refs;
  for (const auto& [owner, parameter] : names) refs.push_back(scene.find(owner, parameter));
  return SlotLayout(scene, refs);
}

/// Nothing was lost on the way: every test renders under this promise.
inline bool complete(const Film& film) { return film.dropped == 0 && film.truncated == 0; }

}  // namespace selenite
