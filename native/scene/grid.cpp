// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/grid.h"

#include <algorithm>
#include <cmath>

#include "math/problem_list.h"

namespace selenite {
namespace {

/// The two neighbours along one axis and how far the point is from the lower one.
struct Axis {
  std::size_t low, high;
  float t;

  Axis(double u, int n) {
    const double last = n - 1, x = u * n - 0.5;
    // The first comparison is false for NaN too.
    const double inside = !(x > 0) ? 0 : (x < last ? x : last);
    low = static_cast<std::size_t>(inside);
    high = std::min(low + 1, static_cast<std::size_t>(n - 1));
    t = static_cast<float>(inside - static_cast<double>(low));
  }
};

/// In this form equal ends give exactly that value.
Colorf mix(const Colorf& a, const Colorf& b, float t) { return a + (b - a) * t; }

[[noreturn]] void refuse(const std::string& name, const std::string& cause,
                         const std::string& cure) {
  throw Refused("Grid '" + name + "'", cause, cure);
}

}  // namespace

Grid::Grid(std::string name, std::array<int, 3> size, int channels, std::vector<float> values)
    : name_(std::move(name)), size_(size), channels_(channels), values_(std::move(values)) {
  if (channels != 1 && channels != 3)
    refuse(name_, joined(channels, " channels are given"), "give 1 (numbers) or 3 (colours)");
  std::int64_t numbers = channels;
  for (int i = 0; i < 3; ++i) {
    if (size[i] < 1 || size[i] > kMostPerAxis)
      refuse(name_, joined("its size along ", static_cast<char>('x' + i), " is ", size[i]),
             joined("it must lie in [1, ", kMostPerAxis, "]"));
    numbers *= size[i];
  }
  if (numbers > kMostNumbers)
    refuse(name_, joined("it holds ", numbers, " numbers"),
           joined("at most ", kMostNumbers, " are permitted: give a coarser one"));
  if (static_cast<std::int64_t>(values_.size()) != numbers)
    refuse(name_,
           joined(values_.size(), " numbers are given for ", size[0], " x ", size[1], " x ",
                  size[2], " voxels of ", channels, " channels"),
           joined("give ", numbers));
  double sum = 0;
  for (std::size_t i = 0; i < values_.size(); ++i) {
    if (!(values_[i] >= 0 && std::isfinite(values_[i])))
      refuse(name_, joined("number ", i, " is ", values_[i]),
             "every one must be finite and at least 0: repair the file");
    maximum_ = std::max(maximum_, values_[i]);
    sum += static_cast<double>(values_[i]);
  }
  mean_ = static_cast<float>(sum / static_cast<double>(numbers));
}

Colorf Grid::at(const Vec3d& u) const {
  const Axis x(u.x, size_[0]), y(u.y, size_[1]), z(u.z, size_[2]);
  const std::size_t row = static_cast<std::size_t>(size_[0]);
  const std::size_t slice = row * static_cast<std::size_t>(size_[1]);
  const auto line = [&](std::size_t j, std::size_t k) {
    const std::size_t start = k * slice + j * row;
    return mix(voxel(start + x.low), voxel(start + x.high), x.t);
  };
  return mix(mix(line(y.low, z.low), line(y.high, z.low), y.t),
             mix(line(y.low, z.high), line(y.high, z.high), y.t), z.t);
}

GridTaps Grid::taps(const Vec3d& u) const {
  const Axis axis[3] = {{u.x, size_[0]}, {u.y, size_[1]}, {u.z, size_[2]}};
  GridTaps taps;
  for (unsigned corner = 0; corner < 8; ++corner) {
    std::size_t index = 0;
    float weight = 1;
    for (int i = 2; i >= 0; --i) {
      const bool high = corner >> i & 1u;
      index = index * static_cast<std::size_t>(size_[i]) + (high ? axis[i].high : axis[i].low);
      weight *= high ? axis[i].t : 1 - axis[i].t;
    }
    taps.voxel[corner] = static_cast<std::uint32_t>(index);
    taps.weight[corner] = weight;
  }
  return taps;
}

}  // namespace selenite
