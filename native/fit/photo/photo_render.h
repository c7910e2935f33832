// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>

#include "fit/photo/photo.h"
#include "render/driver/progress.h"
#include "render/driver/render.h"
#include "render/film/film.h"

namespace selenite {

/// How a photo is rendered beside what it says itself; as in `RenderSettings`.
struct Sampling {
  int spp = 1;
  std::uint64_t seed = 0;
  int depth = 0;
  int threads = 0;
  int lanes = 0;
};

/// Of a picture with the photo's size, frame and pixels.
RenderSettings render_settings(const Photo& photo, const Sampling& how);

/// Every pixel of a picture.
void scale(Picture& picture, const Colorf& by);
/// What was rendered, times a gain. `slot`: of the derivative by the gain, which is the picture
/// without it.
void apply_gain(const Colorf& gain, Film& film, std::optional<std::size_t> slot = {});

/// What the photo shows of a scene: under its lights, from its camera as aligned, times its gain.
/// Throws Cancelled, UnknownName (no such camera or lamp), InvalidArgument.
Film render_photo(const Scene& scene, const Photo& photo, const SlotLayout& layout,
                  const Sampling& how, Progress* progress = nullptr);

}  // namespace selenite
