// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

#include "render/film/film.h"
#include "render/film/render_settings.h"

namespace selenite {

/// A film as bytes, without a loss: of each picture the pixels of the mask alone, where all others are the
/// same, and a bit for each black one, where there are many. `pixels`: what was rendered; null: all.
std::string packed(const Film& film, const PixelMask* pixels);
/// The film again. InvalidArgument: the bytes are damaged, or of another mask.
Film unpacked_film(std::string_view bytes, const PixelMask* pixels);

/// Eight pixels of a mask in a byte, and the mask again. InvalidArgument: the bits are of another count.
std::string bits_of(const PixelMask& mask);
PixelMask mask_of(const std::string& bits, std::size_t count);

}  // namespace selenite
