// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/evaluate/rendered_pixels.h"

#include <algorithm>

namespace selenite {
namespace {

/// Sets what lies within `kFilterReach` of a set entry of a line.
void widen(const std::uint8_t* from, std::uint8_t* to, int count, int stride) {
  int last = -kFilterReach - 1;  // set entry so far
  for (int i = 0; i < count + kFilterReach; ++i) {
    if (i < count && from[i * stride]) last = i;
    const int middle = i - kFilterReach;  // whose neighbourhood ends here
    if (middle >= 0 && last >= middle - kFilterReach) to[middle * stride] = 1;
  }
}

}  // namespace

std::shared_ptr<const PixelMask> rendered_pixels(const Photo& photo) {
  const auto counts = [](float weight) { return weight > 0; };
  if (photo.pixels || photo.weight.size() != photo.size() ||
      std::ranges::all_of(photo.weight, counts))
    return photo.pixels;
  PixelMask mask(photo.size()), wide(photo.size()), all(photo.size());
  std::ranges::transform(photo.weight, mask.begin(), counts);
  for (int y = 0; y < photo.height; ++y)
    widen(&mask[static_cast<std::size_t>(y) * photo.width],
          &wide[static_cast<std::size_t>(y) * photo.width], photo.width, 1);
  for (int x = 0; x < photo.width; ++x) widen(&wide[x], &all[x], photo.height, photo.width);
  return std::make_shared<const PixelMask>(std::move(all));
}

double rendered_count(const Photo& photo) {
  const auto pixels = rendered_pixels(photo);
  if (!pixels) return static_cast<double>(photo.width) * photo.height;
  return static_cast<double>(std::ranges::count_if(*pixels, [](auto one) { return one != 0; }));
}

}  // namespace selenite
