// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

namespace selenite {

/// Sources: docs/measurements/constants.md, "LocalRegressionOptions".
struct LocalRegressionOptions {
  int radius = 6;       ///< of a window, in pixels
  float ridge = 1e-3f;  ///< on the normal equations of a window, their diagonal scaled to 1
  int strip = 64;       ///< rows that are in memory at once
};

/// Columns of numbers, three a pixel, in terms of a picture: in each window, by channel, a weighted least
/// squares fit of a column by a constant, the picture, its slopes across and down, and what a pixel
/// differs from its neighbours by. The mean of what all windows around a pixel say.
///
/// Most of what a parameter does to a picture moves, sharpens or scales what is there, by amounts that
/// change slowly. A window has far more pixels than coefficients, so it averages noise as widely as it
/// reaches, and keeps detail as fine as the picture's. Sources: He, Sun and Tang 2010 (windows), Rousselle,
/// Manzi and Zwicker 2013 (features of renders).
Eigen::MatrixXf local_regression(const Eigen::MatrixXf& columns, const Eigen::VectorXf& picture,
                                 const Eigen::VectorXf& weight, int width, int height,
                                 const LocalRegressionOptions& options = {});

}  // namespace selenite
