// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "math/color.h"
#include "math/vec.h"
#include "scene/transform.h"

namespace selenite {

/// The eight voxels around a point and their trilinear weights, which add up to 1. At an edge of the
/// grid one voxel may be there more than once.
struct GridTaps {
  std::array<std::uint32_t, 8> voxel{};
  std::array<float, 8> weight{};
};

/// Numbers (one channel) or colours (three) on a regular lattice over the unit cube: voxel i of n
/// has its centre at (i + 1/2) / n. Trilinear between centres; outside of them the nearest value on
/// the lattice's edge. Immutable, shared.
class Grid {
 public:
  static constexpr int kMostPerAxis = 4096;
  static constexpr std::int64_t kMostNumbers = std::int64_t{1} << 28;

  /// `values`: x runs fastest, then y, then z; the channels of a voxel lie together.
  /// InvalidArgument: a size outside [1, 4096], channels other than 1 and 3, more numbers than
  /// `kMostNumbers`, values that do not fit the size, or one that is negative or not finite.
  Grid(std::string name, std::array<int, 3> size, int channels, std::vector<float> values);

  /// `u` in the unit cube; a number is given as a grey colour.
  Colorf at(const Vec3d& u) const;
  GridTaps taps(const Vec3d& u) const;

  const std::string& name() const { return name_; }
  const std::array<int, 3>& size() const { return size_; }
  int channels() const { return channels_; }
  std::size_t voxels() const { return values_.size() / static_cast<std::size_t>(channels_); }
  const std::vector<float>& values() const { return values_; }
  float maximum() const { return maximum_; }
  float mean() const { return mean_; }
  /// The same lattice with other values; the same errors.
  Grid with(std::vector<float> values) const {
    return {name_, size_, channels_, std::move(values)};
  }

 private:
  Colorf voxel(std::size_t i) const {
    return channels_ == 1 ? Colorf(values_[i])
                          : Colorf(values_[3 * i], values_[3 * i + 1], values_[3 * i + 2]);
  }

  std::string name_;
  std::array<int, 3> size_;
  int channels_;
  std::vector<float> values_;
  float maximum_ = 0, mean_ = 0;
};

/// A grid and its place in a scene; no grid: a constant takes its place.
struct PlacedGrid {
  std::shared_ptr<const Grid> grid;
  Transform to_unit;  ///< scene coordinates to the unit cube

  explicit operator bool() const { return grid != nullptr; }
  Colorf at(const Vec3f& p) const { return grid->at(to_unit.point(Vec3d(p))); }
  GridTaps taps(const Vec3f& p) const { return grid->taps(to_unit.point(Vec3d(p))); }
  /// Calls `sink(voxel, derivative)` for the voxels that make up the value at p, where `derivative` is
  /// by that value: by theirs.
  template <class Sink>
  void spread(const Vec3f& p, const Colorf& derivative, Sink&& sink) const {
    const GridTaps found = taps(p);
    for (std::size_t k = 0; k < found.voxel.size(); ++k)
      if (found.weight[k] > 0) sink(found.voxel[k], derivative * found.weight[k]);
  }
  /// Follows a move of the scene's origin to `origin`.
  void move_origin(const Vec3d& origin) { to_unit.translate(to_unit.vector(origin)); }
};

}  // namespace selenite
