// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/field_numbers.h"

#include <algorithm>
#include <cmath>

namespace selenite {
namespace {

/// The vector of a colour, and back.
Eigen::Vector3d decoded(const Eigen::Vector3d& color) { return (2 * color).array() - 1; }
Eigen::Vector3d encoded(const Eigen::Vector3d& vector) { return (vector.array() + 1) / 2; }

}  // namespace

FieldNumbers::FieldNumbers(const Fields& fields, std::ptrdiff_t most_texels) {
  std::ptrdiff_t texels = 0;
  for (std::size_t f = 0; f < fields.refs().size(); ++f)
    if (const Texture* const image = fields.image(f)) texels += std::ssize(image->pixels());
  int factor = 1;
  while (texels / (static_cast<std::ptrdiff_t>(factor) * factor) > most_texels) factor *= 2;
  bool together = false;
  Eigen::Index places = 0;
  for (std::size_t f = 0; f < fields.refs().size(); ++f) {
    Lattice one;
    one.count = fields.start()[f].size();
    one.channels = fields.channels(f);
    taps_.emplace_back();
    if (const Texture* const image = fields.image(f)) {
      one.factor = std::min({factor, image->width(), image->height()});
      one.width = (image->width() + one.factor - 1) / one.factor;
      one.height = (image->height() + one.factor - 1) / one.factor;
      one.repeats = image->extension() == Extension::kRepeat;
      one.count = static_cast<Eigen::Index>(one.width) * one.height * one.channels;
      one.normals = fields.encodes_normals(f);
      one.by_channel = fields.acts_by_channel(f);
      one.places = one.by_channel ? 1 : one.channels;
      if (one.factor > 1) taps_.back() = Taps(one, image->width(), image->height());
    }
    together = together || !one.by_channel;
    minimum_.push_back(fields.wanted()[f].minimum);
    maximum_.push_back(fields.wanted()[f].maximum);
    lattices_.push_back(one);
    first_places_.push_back(static_cast<std::uint32_t>(places));
    places += one.place_count();
    size_ += one.count;
  }
  if (!together) {
    for (int c = 0; c < 3; ++c)
      parts_.push_back({c, 1, Eigen::seqN(Eigen::Index{c}, size_ / 3, Eigen::Index{3})});
    return;
  }
  parts_.push_back({0, 3, Eigen::seqN(Eigen::Index{0}, size_, Eigen::Index{1})});
  Eigen::Index first = 0;
  for (Lattice& one : lattices_) {
    one.columns = one.channels;
    for (Eigen::Index place = 0; place < one.place_count(); ++place) {
      by_place_.push_back({first, one.by_channel});
      first += one.by_channel ? 3 : 1;
    }
  }
}

Eigen::VectorXd FieldNumbers::of(const FieldValues& values) const {
  Eigen::VectorXd all(size_);
  Eigen::Index at = 0;
  for (std::size_t f = 0; f < values.size(); ++f) {
    const Lattice& one = lattices_[f];
    auto mine = all.segment(at, one.count);
    at += one.count;
    if (one.factor == 1) {
      mine = values[f];
      continue;
    }
    mine.setZero();
    Eigen::VectorXd sums = Eigen::VectorXd::Zero(one.count / one.channels);
    for (Eigen::Index texel = 0; texel < values[f].size() / one.channels; ++texel)
      for (const Tap& tap : taps_[f].of(static_cast<std::uint32_t>(texel))) {
        sums[tap.point] += static_cast<double>(tap.weight);
        mine.segment(static_cast<Eigen::Index>(tap.point) * one.channels, one.channels) +=
            static_cast<double>(tap.weight) * values[f].segment(texel * one.channels, one.channels);
      }
    for (Eigen::Index point = 0; point < sums.size(); ++point)
      mine.segment(point * one.channels, one.channels) /= sums[point];
  }
  return all;
}

void FieldNumbers::add(const Eigen::VectorXd& step, FieldValues& values) const {
  Eigen::Index at = 0;
  for (std::size_t f = 0; f < values.size(); ++f) {
    const Lattice& one = lattices_[f];
    const auto mine = step.segment(at, one.count);
    at += one.count;
    if (one.factor == 1)
      values[f] += mine;
    else
      for (Eigen::Index texel = 0; texel < values[f].size() / one.channels; ++texel) {
        auto value = values[f].segment(texel * one.channels, one.channels);
        for (const Tap& tap : taps_[f].of(static_cast<std::uint32_t>(texel)))
          value += static_cast<double>(tap.weight) *
                   mine.segment(static_cast<Eigen::Index>(tap.point) * one.channels, one.channels);
        value = value.cwiseMax(minimum_[f]).cwiseMin(maximum_[f]);
      }
    if (!one.normals) continue;
    for (Eigen::Index texel = 0; texel < values[f].size(); texel += 3) {
      auto value = values[f].segment<3>(texel);
      value =
          encoded(decoded(value).stableNormalized()).cwiseMax(minimum_[f]).cwiseMin(maximum_[f]);
    }
  }
}

void FieldNumbers::keep_lengths(const Eigen::VectorXd& values, Eigen::VectorXd& step) const {
  Eigen::Index at = 0;
  for (const Lattice& one : lattices_) {
    if (one.normals)
      for (Eigen::Index k = at; k < at + one.count; k += 3) {
        const Eigen::Vector3d along = decoded(values.segment<3>(k)).stableNormalized();
        step.segment<3>(k) -= along.dot(step.segment<3>(k)) * along;
      }
    at += one.count;
  }
}

FieldNumbers::Taps::Taps(const Lattice& lattice, int width, int height)
    : points_(lattice.width),
      columns_(along(width, lattice.width, lattice.factor, lattice.repeats)),
      rows_(along(height, lattice.height, lattice.factor, lattice.repeats)) {}

std::vector<FieldNumbers::Taps::Between> FieldNumbers::Taps::along(int texels, int points,
                                                                   int factor, bool repeats) {
  std::vector<Between> all;
  for (int i = 0; i < texels; ++i) {
    const float at = (static_cast<float>(i) + 0.5f) / static_cast<float>(factor) - 0.5f;
    const float below = std::floor(at);
    const int first = static_cast<int>(below);
    const auto inside = [&](int point) {
      return repeats ? (point + points) % points : std::clamp(point, 0, points - 1);
    };
    all.push_back({inside(first), inside(first + 1), at - below});
  }
  return all;
}

std::array<FieldNumbers::Tap, 4> FieldNumbers::Taps::of(std::uint32_t texel) const {
  const Between& column = columns_[texel % columns_.size()];
  const Between& row = rows_[texel / columns_.size()];
  const auto tap = [&](int y, int x, float weight) {
    return Tap{static_cast<std::uint32_t>(y * points_ + x), weight};
  };
  return {tap(row.first, column.first, (1 - row.share) * (1 - column.share)),
          tap(row.first, column.second, (1 - row.share) * column.share),
          tap(row.second, column.first, row.share * (1 - column.share)),
          tap(row.second, column.second, row.share * column.share)};
}

}  // namespace selenite
