// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <vector>

#include "fit/problem/fields.h"
#include "fit/solver/cell_matrix.h"
#include "fit/solver/field_numbers.h"

namespace selenite {

class SavedState;

/// Sources: docs/measurements/constants.md, "FieldPriorOptions".
struct FieldPriorOptions {
  /// Standard deviation of voxels before any photo, and of the difference of two across a sixteenth of
  /// the longest side.
  double deviation = 0.3, difference = 0.1;
  /// The same of the differences between neighbours in the world's image, a pixel of 1 steradian each, and
  /// of a pixel itself, in units of the brightness there. Then of a channel's mean over the sphere, in units
  /// of the mean before any photo, which is the least brightness too.
  double environment_difference = 3, environment_deviation = 30, environment_level = 0.2;
  /// Of a texel, as the image holds it, around the mean of its channel, and of the difference between two
  /// neighbours.
  double image_deviation = 0.3, image_difference = 0.15;
  /// The difference of numbers that act on all channels, such as a roughness or half of a vector. From
  /// so many texels along a side on, more of them hold a mean no more firmly.
  double number_difference = 0.07, number_side = 64;
  double longest = 0.25;  ///< step of a voxel or texel
  /// Of a pixel of the world's image, in units of itself and the mean that the image starts with.
  double longest_of_environment = 2;
};

/// What is known of the numbers of albedo grids, of images and of the world's image before any photo. A
/// voxel lies near its first value. A texel lies near the mean of its channel, whatever that is, and near
/// its neighbours. A pixel of the world lies near its neighbours, and the mean of a channel near
/// that of the values with which a fit begins, in the colour that the world has in the scene. The brighter
/// pixels are, the more neighbours differ: a lamp has an edge.
/// Its numbers are those of a part of `FieldNumbers`. Source: docs/method/fields.md, "Light of the world".
class FieldPrior {
 public:
  FieldPrior(const Fields& fields, const FieldNumbers& numbers,
             const FieldPriorOptions& options = {});

  bool has_environment() const;
  bool empty() const { return mean_.size() == 0; }
  /// The fit begins at these values.
  void begin(const Eigen::VectorXd& values);
  /// Expected values of all numbers, once begun.
  const Eigen::VectorXd& mean() const { return mean_; }
  /// Where the world is bright is seen from these values of all numbers, as far as the photos know them:
  /// `photos` is the precision that they give a number of a channel. What they do not see stays smooth.
  void adapt(const Eigen::VectorXd& values, const Eigen::VectorXd& photos);
  /// Of the numbers of a part, once begun.
  const std::shared_ptr<const Precision>& precision() const { return precision_; }
  /// Longest steps of all numbers from `values`, once begun.
  Eigen::VectorXd longest_steps(const Eigen::VectorXd& values) const;
  void members(SavedState& state);

 private:
  void set_levels();
  void set_precision();
  Precision of_images() const;

  FieldPriorOptions options_;
  std::vector<std::vector<std::ptrdiff_t>> shapes_;
  std::vector<char> is_environment_;
  std::vector<FieldNumbers::Lattice> images_;  ///< of a surface; empty: other fields
  FieldValues start_;                          ///< of the scene
  Eigen::VectorXd mean_;
  std::shared_ptr<const Precision> precision_;
  Eigen::VectorXd level_;  ///< of each number: the mean of its field in `mean_`, of a grid 1
  Eigen::VectorXd scale_;  ///< of each number of a part: in which its differences count
};

}  // namespace selenite
