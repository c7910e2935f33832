// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/field_prior.h"

#include <algorithm>
#include <cmath>

#include "fit/problem/saved_state.h"
#include "math/scalar.h"

namespace selenite {
namespace {

Eigen::VectorXd of_channel(const Eigen::VectorXd& all, int channel) {
  return all(Eigen::seq(channel, Eigen::last, Eigen::fix<3>));
}

/// Of an equirectangular image: sum of the squared differences between neighbours, a pixel of 1
/// steradian each, in units of the mean of their scales.
Eigen::MatrixXd smoothness(int height, int width, const Eigen::ArrayXd& scale) {
  const Eigen::Index size = static_cast<Eigen::Index>(height) * width;
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(size, size);
  const auto join = [&](Eigen::Index a, Eigen::Index b, double weight) {
    if (a == b) return;
    weight /= square((scale[a] + scale[b]) / 2);
    sum(a, a) += weight;
    sum(b, b) += weight;
    sum(a, b) -= weight;
    sum(b, a) -= weight;
  };
  const double across = 2 * kPi<double> / width, down = kPi<double> / height;
  for (int y = 0; y < height; ++y) {
    const double sine = std::sin(kPi<double> * (y + 0.5) / height);
    const double below = std::sin(kPi<double> * (y + 1.0) / height);
    for (int x = 0; x < width; ++x) {
      const Eigen::Index here = static_cast<Eigen::Index>(y) * width + x;
      // The integral of the squared gradient over the sphere.
      join(here, static_cast<Eigen::Index>(y) * width + (x + 1) % width, down / (across * sine));
      if (y + 1 < height) join(here, here + width, across * below / down);
    }
  }
  return sum;
}

/// Of a grid of nz, ny, nx voxels: sum of the squared differences between neighbours.
Eigen::MatrixXd differences(const std::vector<std::ptrdiff_t>& shape) {
  const std::ptrdiff_t nz = shape[0], ny = shape[1], nx = shape[2];
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(nz * ny * nx, nz * ny * nx);
  const auto join = [&](Eigen::Index a, Eigen::Index b) {
    sum(a, a) += 1;
    sum(b, b) += 1;
    sum(a, b) -= 1;
    sum(b, a) -= 1;
  };
  for (std::ptrdiff_t z = 0; z < nz; ++z)
    for (std::ptrdiff_t y = 0; y < ny; ++y)
      for (std::ptrdiff_t x = 0; x < nx; ++x) {
        const Eigen::Index here = (z * ny + y) * nx + x;
        if (x + 1 < nx) join(here, here + 1);
        if (y + 1 < ny) join(here, here + nx);
        if (z + 1 < nz) join(here, here + nx * ny);
      }
  return sum;
}

}  // namespace

FieldPrior::FieldPrior(const Fields& fields, const FieldNumbers& numbers,
                       const FieldPriorOptions& options)
    : options_(options) {
  if (fields.image(0)) {
    images_ = numbers.lattices();
    return;
  }
  start_ = fields.start();
  for (std::size_t f = 0; f < start_.size(); ++f) {
    shapes_.push_back(fields.shape(f));
    is_environment_.push_back(fields.is_environment(f));
  }
}

bool FieldPrior::has_environment() const {
  return std::ranges::any_of(is_environment_, [](char one) { return one != 0; });
}

void FieldPrior::begin(const Eigen::VectorXd& values) {
  mean_ = values;
  Eigen::Index at = 0;
  for (std::size_t f = 0; f < shapes_.size(); ++f) {
    const Eigen::Index size = start_[f].size();
    if (is_environment_[f]) {
      const Eigen::VectorXd share = sphere_shares(shapes_[f]);
      const auto channel_mean = [&](const Eigen::VectorXd& all, int c) {
        return share.dot(of_channel(all, c));
      };
      double level = 0, before = 0;
      for (int c = 0; c < 3; ++c) {
        level += channel_mean(values.segment(at, size), c);
        before += channel_mean(start_[f], c);
      }
      for (int c = 0; c < 3; ++c)
        mean_(Eigen::seqN(at + c, size / 3, Eigen::fix<3>))
            .setConstant(before > 0 ? level * channel_mean(start_[f], c) / before : level / 3);
    }
    at += size;
  }
  set_levels();
}

void FieldPrior::set_levels() {
  level_ = Eigen::VectorXd::Ones(mean_.size());
  Eigen::Index at = 0;
  for (std::size_t f = 0; f < shapes_.size(); ++f) {
    const Eigen::Index size = start_[f].size();
    if (is_environment_[f]) level_.segment(at, size).setConstant(mean_.segment(at, size).mean());
    at += size;
  }
  scale_ = level_(Eigen::seq(0, Eigen::last, Eigen::fix<3>));
  set_precision();
}

/// The mean of each image is free.
Precision FieldPrior::of_images() const {
  Eigen::Index all = 0, levels = 0;
  for (const FieldNumbers::Lattice& one : images_) {
    all += one.count / one.channels * one.columns;
    levels += one.columns;
  }
  Precision found;
  found.level = Eigen::MatrixXd::Zero(all, levels);
  std::vector<Eigen::Triplet<double>> entries;
  double weight = 0;
  const auto join = [&](Eigen::Index a, Eigen::Index b) {
    if (a == b) return;
    entries.emplace_back(a, a, weight);
    entries.emplace_back(b, b, weight);
    entries.emplace_back(a, b, -weight);
    entries.emplace_back(b, a, -weight);
  };
  // Entries of 0 between all numbers of a texel and of its neighbours: photos couple these.
  const auto couple = [&](Eigen::Index first, const FieldNumbers::Lattice& one) {
    for (int y = 0; y < one.height; ++y)
      for (int x = 0; x < one.width; ++x) {
        const auto at = [&](int column, int row) {
          return first + (static_cast<Eigen::Index>(row) * one.width + column) * one.columns;
        };
        const auto between = [&](Eigen::Index a, Eigen::Index b) {
          for (int k = 0; k < one.columns; ++k)
            for (int l = 0; l < one.columns; ++l)
              if (k != l) {
                entries.emplace_back(a + k, b + l, 0.);
                if (a != b) entries.emplace_back(b + l, a + k, 0.);
              }
        };
        between(at(x, y), at(x, y));
        if (x + 1 < one.width || one.repeats) between(at(x, y), at((x + 1) % one.width, y));
        if (y + 1 < one.height || one.repeats) between(at(x, y), at(x, (y + 1) % one.height));
      }
  };
  Eigen::Index first = 0, level = 0;
  for (const FieldNumbers::Lattice& one : images_) {
    const int width = one.width, height = one.height, kinds = one.columns;
    const Eigen::Index count = static_cast<Eigen::Index>(width) * height;
    const double side = std::sqrt(static_cast<double>(count));
    const double fewer = std::max(1.0, options_.number_side / side);
    weight = 1 / square(one.by_channel ? options_.image_difference
                                       : std::min(options_.number_difference * fewer,
                                                  options_.image_difference));
    const double deviation = options_.image_deviation *
                             (one.by_channel ? 1 : std::max(1.0, side / options_.number_side));
    for (int k = 0; k < kinds; ++k, ++level) {
      const auto at = [&](int x, int y) {
        return first + (static_cast<Eigen::Index>(y) * width + x) * kinds + k;
      };
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
          const Eigen::Index here = at(x, y);
          entries.emplace_back(here, here, 1 / square(deviation));
          if (x + 1 < width || one.repeats) join(here, at((x + 1) % width, y));
          if (y + 1 < height || one.repeats) join(here, at(x, (y + 1) % height));
          found.level(here, level) = 1 / (deviation * side);
        }
    }
    if (!one.by_channel) couple(first, one);
    first += count * kinds;
  }
  found.sparse.resize(all, all);
  found.sparse.setFromTriplets(entries.begin(), entries.end());
  return found;
}

void FieldPrior::set_precision() {
  if (!images_.empty()) {
    if (!precision_) precision_ = std::make_shared<const Precision>(of_images());
    return;
  }
  const Eigen::Index all = scale_.size();
  Eigen::MatrixXd precision = Eigen::MatrixXd::Zero(all, all);
  Eigen::Index at = 0;
  for (std::size_t f = 0; f < shapes_.size(); ++f) {
    const Eigen::Index count = start_[f].size() / 3;
    auto block = precision.block(at, at, count, count);
    if (is_environment_[f]) {
      const Eigen::VectorXd share = sphere_shares(shapes_[f]);
      const Eigen::ArrayXd scale = scale_.segment(at, count);
      block = smoothness(static_cast<int>(shapes_[f][0]), static_cast<int>(shapes_[f][1]), scale) /
                  square(options_.environment_difference) +
              share * share.transpose() / square(options_.environment_level * level_[3 * at]);
      block.diagonal().array() += (options_.environment_deviation * scale).square().inverse();
    } else {
      const double along =
          static_cast<double>(std::max({shapes_[f][0], shapes_[f][1], shapes_[f][2]}));
      block = differences(shapes_[f]) / square(options_.difference * 16 / along);
      block.diagonal().array() += 1 / square(options_.deviation);
    }
    at += count;
  }
  precision_ = std::make_shared<const Precision>(Precision{std::move(precision), {}, {}});
}

void FieldPrior::adapt(const Eigen::VectorXd& values, const Eigen::VectorXd& photos) {
  if (!has_environment()) return;
  const Eigen::VectorXd even = level_(Eigen::seq(0, Eigen::last, Eigen::fix<3>));
  const Eigen::VectorXd brightness = values.reshaped(3, even.size()).colwise().mean();
  scale_ = brightness.cwiseMax(even);
  set_precision();
  const Eigen::ArrayXd alone = precision_->dense.diagonal();
  const Eigen::ArrayXd seen = 1 - alone / (photos.array() + alone);
  scale_ = (even.array() + seen * (scale_ - even).array()).matrix();
  set_precision();
}

Eigen::VectorXd FieldPrior::longest_steps(const Eigen::VectorXd& values) const {
  Eigen::VectorXd longest = Eigen::VectorXd::Constant(values.size(), options_.longest);
  Eigen::Index at = 0;
  for (std::size_t f = 0; f < start_.size(); ++f) {
    const Eigen::Index size = start_[f].size();
    if (is_environment_[f])
      longest.segment(at, size) =
          options_.longest_of_environment * (values.segment(at, size) + level_.segment(at, size));
    at += size;
  }
  return longest;
}

void FieldPrior::members(SavedState& state) {
  state(mean_);
  if (state.reading() && !empty()) set_levels();
}

}  // namespace selenite
