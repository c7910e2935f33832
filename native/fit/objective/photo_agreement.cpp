// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/objective/photo_agreement.h"

#include <algorithm>
#include <utility>

#include "fit/problem/saved_state.h"
#include "math/scalar.h"

namespace selenite {

PhotoAgreement::PhotoAgreement(const Fields& fields, const PhotoAgreementOptions& options)
    : options_(options), fields_(fields.refs().size()) {
  for (std::size_t f = 0; f < fields_.size(); ++f) {
    OfField& one = fields_[f];
    one.channels = static_cast<std::size_t>(fields.channels(f));
    if (!fields.on_surface(f)) continue;
    const std::size_t places = static_cast<std::size_t>(fields.start()[f].size()) / one.channels;
    std::size_t blocks = places;
    std::vector<int> block;
    block.reserve(places);
    if (const Texture* const image = fields.image(f)) {
      const int columns = std::min(image->width(), options_.along);
      const int rows = std::min(image->height(), options_.along);
      for (int y = 0; y < image->height(); ++y)
        for (int x = 0; x < image->width(); ++x)
          block.push_back(y * rows / image->height() * columns + x * columns / image->width());
      blocks = static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns);
    } else {
      for (std::size_t i = 0; i < places; ++i) block.push_back(static_cast<int>(i));
    }
    one.block = std::make_shared<const std::vector<int>>(std::move(block));
    one.sum.resize(blocks * one.channels);
    one.squares.resize(blocks);
    one.photos.resize(blocks);
  }
}

void PhotoAgreement::add(const std::vector<std::vector<double>>& gradients) {
  for (std::size_t f = 0; f < fields_.size(); ++f) {
    OfField& one = fields_[f];
    if (!one.block) continue;
    std::vector<double> of_photo(one.sum.size());
    for (std::size_t i = 0; i < gradients[f].size(); ++i)
      of_photo[static_cast<std::size_t>((*one.block)[i / one.channels]) * one.channels +
               i % one.channels] += gradients[f][i];
    for (std::size_t b = 0; b < one.squares.size(); ++b) {
      double square_sum = 0;
      for (std::size_t k = b * one.channels; k < (b + 1) * one.channels; ++k) {
        one.sum[k] += of_photo[k];
        square_sum += square(of_photo[k]);
      }
      if (!(square_sum > 0)) continue;
      one.squares[b] += square_sum;
      ++one.photos[b];
    }
  }
}

/// With n photos of a block, (sum of gradients)^2 - sum of squares holds n (n - 1) products of two photos.
void PhotoAgreement::end_round() {
  for (OfField& one : fields_) {
    double agreed = 0, all = 0;
    for (std::size_t b = 0; b < one.squares.size(); ++b) {
      if (one.photos[b] < 2) continue;
      double of_sum = 0;
      for (std::size_t k = b * one.channels; k < (b + 1) * one.channels; ++k)
        of_sum += square(one.sum[k]);
      agreed += (of_sum - one.squares[b]) / (one.photos[b] - 1);
      all += one.squares[b];
    }
    one.agreed = options_.kept * one.agreed + agreed;
    one.all = options_.kept * one.all + all;
    std::ranges::fill(one.sum, 0);
    std::ranges::fill(one.squares, 0);
    std::ranges::fill(one.photos, 0);
  }
}

double PhotoAgreement::share(std::size_t field) const {
  const OfField& one = fields_[field];
  return one.all > 0 ? std::clamp(one.agreed / one.all, 0.0, 1.0) : 0;
}

void PhotoAgreement::OfField::members(SavedState& state) { state(agreed, all); }

void PhotoAgreement::members(SavedState& state) {
  for (OfField& one : fields_) state(one);
}

}  // namespace selenite
