// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/starts/alignment_start.h"

#include <algorithm>
#include <cmath>

#include "fit/evaluate/seeds.h"

namespace selenite {
namespace {

/// Pixels of a picture with so many on the longer side in one pixel of the photo; see `Photo::resized`.
double scale_to(int size, const Photo& photo) {
  return std::min(1.0, static_cast<double>(size) / std::max(photo.width, photo.height));
}

}  // namespace

std::unique_ptr<AlignmentStart> AlignmentStart::of(const std::vector<Photo>& photos,
                                                   std::uint64_t seed) {
  if (std::ranges::none_of(photos, [](const Photo& one) { return one.align; })) return nullptr;
  return std::unique_ptr<AlignmentStart>(new AlignmentStart(photos, seed));
}

bool AlignmentStart::step(PhotoEvaluator& evaluator, const Vector& x) {
  for (std::size_t i = 0; i < photos_->size(); ++i)
    if ((*photos_)[i].align)
      evaluator.evaluate({x}, (*photos_)[i],
                         {options_.spp, seed_of(seed_, done_, static_cast<int>(i))});
  return ++done_ < options_.passes;
}

bool AlignmentStart::moved(const PhotoEvaluator& evaluator, int size) const {
  return std::ranges::any_of(*photos_, [&](const Photo& one) {
    const Alignment found = evaluator.alignment(one);
    const double corner = std::abs(found.roll) * std::hypot(one.width, one.height) / 2;
    return (std::hypot(found.x, found.y) + corner) * scale_to(size, one) > options_.noticed;
  });
}

bool AlignmentStart::may_move(int size) const {
  return std::ranges::any_of(*photos_, [&](const Photo& one) {
    return one.align && kAlignment.most * scale_to(size, one) > options_.noticed;
  });
}

}  // namespace selenite
