// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

#include "render/film/film.h"
#include "render/film/render_settings.h"

namespace selenite {

/// A film as bytes, without a loss: of each picture the pixels of the mask alone, where all others are the
/// same. `pixels`: what was rendered; null: all.
std::string packed(const Film& film, const PixelMask* pixels);
/// The film again. InvalidArgument: the bytes are damaged, or of another mask.
Film unpacked_film(std::string_view bytes, const PixelMask* pixels);

}  // namespace selenite
