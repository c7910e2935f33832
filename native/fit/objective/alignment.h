// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "fit/photo/photo.h"
#include "fit/problem/saved_state.h"
#include "render/film/film.h"
#include "scene/camera.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "AlignmentOptions".
struct AlignmentOptions {
  double most = 4;       ///< pixels of the picture, either way; of a roll at the farthest corner
  double deviation = 2;  ///< standard deviation in pixels before any photo
  /// Standard deviation in pixels by which it may differ from render to render: so long as values move,
  /// shading that is still wrong moves it too.
  double drift = 0.05;
};
inline constexpr AlignmentOptions kAlignment;

/// What all renders so far tell of it.
struct AlignmentEstimate {
  Alignment at{};
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of x, y and roll
  void members(SavedState& state) {
    state(at);
    for (double& one : covariance.reshaped()) state(one);
  }
};

/// What the photo changes by where its camera moves by a pixel to the right, a pixel down, and rolls by
/// a radian: by the photo's own gradient. A column each, 3 numbers a pixel; 0 where a neighbour does not
/// count.
using AlignmentSlopes = Eigen::Matrix<float, Eigen::Dynamic, 3>;
AlignmentSlopes alignment_slopes(const Photo& photo);

/// Normal equations of a photo's alignment, with its prior. `weights` as of `closed_form_gain`. Both
/// must outlive it.
class AlignmentEquations {
 public:
  AlignmentEquations(const Photo& photo, const Eigen::VectorXf& weights);
  /// Before the first render.
  AlignmentEstimate prior() const;
  /// After a render with the present one: a step of least squares, within bounds, by the share that its
  /// noise leaves it (Kalman 1960).
  AlignmentEstimate improved(const AlignmentEstimate& present, const Film& film) const;
  /// Takes from a column of derivatives what a change of the alignment makes of the picture, as
  /// `eliminate_gain` does for the gain.
  void eliminate(Eigen::Ref<Eigen::VectorXf> column) const;

 private:
  Eigen::Matrix3d spread(double deviation) const;
  /// By which the three explain `column`.
  Eigen::Vector3d solve(const Eigen::VectorXf& column) const;

  const Photo& photo_;
  const Eigen::VectorXf& weights_;
  AlignmentSlopes slopes_;
  Eigen::LDLT<Eigen::Matrix3d> normal_;
};

}  // namespace selenite
