// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/photo/photo_render.h"

#include <utility>

namespace selenite {

void scale(Picture& picture, const Colorf& by) {
  for (Colorf& pixel : picture) pixel *= by;
}

RenderSettings render_settings(const Photo& photo, const Sampling& how) {
  RenderSettings settings{photo.width, photo.height, how.spp,     how.seed,
                          how.depth,   how.threads,  photo.frame, how.lanes};
  settings.pixels = photo.pixels;
  return settings;
}

void apply_gain(const Colorf& gain, Film& film, std::optional<std::size_t> slot) {
  SlotFilm by_gain;
  if (slot) {
    // The film without the gain, and its covariance with the film that has it.
    by_gain = {film.mean, film.half_a, film.variance, film.variance, {}, {}, {}};
    scale(by_gain.covariance, gain);
  }
  if (gain != Colorf(1)) {
    const Colorf square = gain * gain;
    scale(film.mean, gain);
    scale(film.half_a, gain);
    scale(film.variance, square);
    for (SlotFilm& one : film.slots) {
      scale(one.mean, gain);
      scale(one.half_a, gain);
      scale(one.direct, gain);
      scale(one.direct_half_a, gain);
      scale(one.variance, square);
      scale(one.covariance, square);
    }
  }
  if (slot) film.slots[*slot] = std::move(by_gain);
}

Film render_photo(const Scene& scene, const Photo& photo, const SlotLayout& layout,
                  const Sampling& how, Progress* progress) {
  photo.lights.check(scene, "Photo '" + photo.id + "'");
  Film film = render(photo.lights.applied_to(scene), photo.camera_in(scene), layout,
                     render_settings(photo, how), progress);
  apply_gain(Colorf(photo.values.gain), film);
  return film;
}

}  // namespace selenite
