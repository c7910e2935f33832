// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "fit/photo/photo.h"
#include "fit/problem/unknowns.h"
#include "render/film/film.h"
#include "render/film/slots.h"

namespace selenite {

/// A loss at one film, with what its derivatives need.
///
/// I is the mean image of the film, a random number per pixel: E[I] is the true picture, Var[I] its
/// variance. A loss that curves in I has a biased value, by half its curvature times Var[I], and a
/// biased gradient, by its curvature times Cov[I, J]. Both are known from the samples of the pixel.
struct LossResult {
  double value = 0;           ///< as the loss is defined: see `Loss::help` for the bias of noise
  double unbiased = 0;        ///< without the bias of noise where that is known
  double standard_error = 0;  ///< of `unbiased`, to second order; pixels independent
  std::vector<float> parts;   ///< of each pixel in `unbiased`
  Picture slope;              ///< d value / d I
  Picture curvature;          ///< subtracted times Cov[I, J] in `loss_gradient`; empty: none
};

/// One loss. A new one is one more entry at the end of the table in loss.cpp: a .blend file keeps the
/// number of its entry. Tests, panel and command line read the list.
struct Loss {
  std::string_view name;
  std::string_view title;  ///< in the panel's menu
  std::string_view help;
  int least_spp;       ///< fewer samples are refused
  bool least_squares;  ///< its expectation is a weighted sum of squared residuals
  bool per_pixel;      ///< a sum over pixels: the slope of one needs no other
  /// Its residuals are weighed by what a fit learns of their variance; else all weigh alike.
  bool weighted;
  /// `weights`: of the residuals, 3 numbers a pixel, as `PhotoWeights::of_loss` gives them; without a
  /// meaning unless `weighted`.
  LossResult (*evaluate_by)(const Film& film, const Photo& photo, const Eigen::VectorXf& weights);
  /// InvalidArgument where a photo cannot be compared by this loss; null: every photo can.
  void (*check)(const Photo& photo) = nullptr;

  /// By the weights that hold before anything has been learned.
  LossResult evaluate(const Film& film, const Photo& photo) const;
};

std::span<const Loss> losses();
/// InvalidArgument lists the names there are.
const Loss& find_loss(std::string_view name);

/// d loss / d unknowns: sum over pixels of slope J - curvature Cov[I, J], in double and in pixel
/// order. For a squared loss this equals the form over all pairs of samples i != j,
/// [(sum I)(sum J) - sum I J] / (n (n - 1)), and is unbiased.
/// `film.slots` are those of `layout`.
Vector loss_gradient(const SlotLayout& layout, const Film& film, const LossResult& loss);

/// Weighted mean of render minus photo, per channel: above 0 the render is too bright.
Color<double> mean_bias(const Film& film, const Photo& photo);

}  // namespace selenite
