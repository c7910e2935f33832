// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/problem/loss.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "fit/problem/pixel_weights.h"
#include "math/fault.h"

namespace selenite {
namespace {

/// Sums of a loss over pixels and channels.
struct Sums {
  double value = 0, noise = 0;  ///< noise: half curvature times variance
  double linear = 0;            ///< variance by the slope
  double square = 0;            ///< variance by the curvature
};

/// `pixel(i, c, curvature)` returns {value, slope} and may set the curvature that noise meets.
template <class Pixel>
LossResult sum_pixels(const Film& film, const Photo& photo, Pixel&& pixel) {
  LossResult result;
  result.slope.resize(film.size());
  result.curvature.resize(film.size());
  result.parts.resize(film.size());
  Sums sums;
  for (std::size_t i = 0; i < film.size(); ++i) {
    if (photo.weight[i] == 0) continue;
    // The channels of a pixel come from the same paths: they vary together.
    double together = 0, apart = 0, bias = 0, part = 0;
    for (int c = 0; c < 3; ++c) {
      double curvature = 0;
      const auto [value, slope] = pixel(i, c, curvature);
      const double variance = std::max(film.variance[i][c], 0.f);  // rounding may go below 0
      result.slope[i][c] = static_cast<float>(slope);
      result.curvature[i][c] = static_cast<float>(curvature);
      part += value;
      together += slope * std::sqrt(variance);
      apart += slope * slope * variance;
      bias += curvature * variance / 2;
    }
    result.parts[i] = static_cast<float>(part - bias);
    sums.value += part;
    sums.noise += bias;
    sums.linear += std::max(together * together, apart);
    sums.square += 2 * bias * bias;
  }
  result.value = sums.value;
  result.unbiased = sums.value - sums.noise;
  // slope^2 Var holds the noise of the slope itself, which is twice the second-order term.
  result.standard_error = std::sqrt(std::max(sums.linear - sums.square, sums.square));
  return result;
}

using Weights = Eigen::VectorXf;

struct Term {
  double value, slope;
};

LossResult squared(const Film& film, const Photo& photo) {
  return sum_pixels(film, photo, [&](std::size_t i, int c, double& curvature) {
    const double share = photo.share(i), residual = film.mean[i][c] - photo.reference[i][c];
    curvature = 2 * share;
    return Term{share * residual * residual, 2 * share * residual};
  });
}

LossResult mse(const Film& film, const Photo& photo, const Weights&) {
  LossResult result = squared(film, photo);
  result.curvature.clear();  // the plain loss keeps its bias: that is its definition
  return result;
}

LossResult without_bias(LossResult result) {
  result.value = result.unbiased;
  return result;
}

LossResult dual_buffer(const Film& film, const Photo& photo, const Weights&) {
  return without_bias(squared(film, photo));
}

LossResult mae(const Film& film, const Photo& photo, const Weights&) {
  return sum_pixels(film, photo, [&](std::size_t i, int c, double&) {
    const double share = photo.share(i), residual = film.mean[i][c] - photo.reference[i][c];
    const double sign = residual > 0 ? 1 : residual < 0 ? -1 : 0;
    return Term{share * std::abs(residual), share * sign};
  });
}

/// Mean of a picture over weighted pixels and all channels.
double mean_of(const Picture& picture, const Photo& photo) {
  double sum = 0;
  for (std::size_t i = 0; i < picture.size(); ++i)
    if (photo.weight[i] > 0)
      for (int c = 0; c < 3; ++c) sum += photo.share(i) * picture[i][c];
  return sum;
}

void require_brightness(const Photo& photo) {
  if (!(mean_of(photo.reference, photo) > 0))
    throw Refused("Photo '" + photo.id + "'",
                  "it is black, and brightness-independent-mse divides by its mean",
                  "choose loss = 'dual-buffer' or a brighter photo");
}

LossResult brightness_independent_mse(const Film& film, const Photo& photo, const Weights&) {
  require_brightness(photo);
  const double render_mean = mean_of(film.mean, photo);
  const double photo_mean = mean_of(photo.reference, photo);
  // A black render has no brightness to divide by. The floor keeps the slope finite and pointing
  // up.
  const double mean = std::max(render_mean, 1e-6 * photo_mean);
  const auto difference = [&](std::size_t i, int c) {
    return film.mean[i][c] / mean - photo.reference[i][c] / photo_mean;
  };
  double through_mean =
      0;  // sum of share * difference * I: what every pixel does by way of the mean
  for (std::size_t i = 0; i < film.size(); ++i)
    if (photo.weight[i] > 0)
      for (int c = 0; c < 3; ++c)
        through_mean += photo.share(i) * difference(i, c) * film.mean[i][c];
  if (mean > render_mean) through_mean = 0;
  return without_bias(sum_pixels(film, photo, [&](std::size_t i, int c, double& curvature) {
    const double share = photo.share(i), d = difference(i, c);
    curvature = 2 * share / (mean * mean);
    return Term{share * d * d, 2 * share * (d / mean - through_mean / (mean * mean))};
  }));
}

LossResult mean_bias_error(const Film& film, const Photo& photo, const Weights&) {
  const Color<double> bias = mean_bias(film, photo);
  return without_bias(sum_pixels(film, photo, [&](std::size_t i, int c, double& curvature) {
    const double share = 3 * photo.share(i);  // of its own channel
    curvature = 2 * share * share / 3;
    const double residual = film.mean[i][c] - photo.reference[i][c];
    return Term{bias[c] * share * residual / 3, 2 * bias[c] * share / 3};
  }));
}

LossResult robust(const Film& film, const Photo& photo, const Weights& weights) {
  return without_bias(sum_pixels(film, photo, [&](std::size_t i, int c, double& curvature) {
    const double weight = weights[static_cast<Eigen::Index>(3 * i) + c];
    const double residual = film.mean[i][c] - photo.reference[i][c];
    curvature = 2 * weight;
    return Term{weight * residual * residual, 2 * weight * residual};
  }));
}

constexpr std::array kLosses{
    Loss{
        "dual-buffer", "Dual Buffer",
        "Mean squared error without the bias of noise: the mean over all pairs of different "
        "samples "
        "of a pixel of (I1 - photo)(I2 - photo). Value and gradient are unbiased; the value may be "
        "below 0. Needs 2 samples",
        2, true, true, false, dual_buffer},
    Loss{"mse", "Mean Squared Error",
         "Mean squared error. Noise adds its variance to the value and pulls the gradient towards "
         "parameters that render with less noise; use the dual buffer unless samples are many",
         1, true, true, false, mse},
    Loss{"brightness-independent-mse", "Brightness Independent",
         "Mean squared error after each image is divided by its own mean; the render's mean is "
         "differentiated too. Bias of noise is removed up to the noise of that mean",
         1, false, false, false, brightness_independent_mse, require_brightness},
    Loss{"mae", "Mean Absolute Error",
         "Mean absolute error: less drawn by outliers, such as misaligned edges. Biased by noise, "
         "as "
         "no exact correction exists; use 16 samples or more",
         1, false, true, false, mae},
    Loss{"mean-bias-error", "Mean Bias Error",
         "Square of the mean of render minus photo, per channel: matches overall brightness and "
         "colour only. Unbiased from 2 samples on",
         1, false, false, false, mean_bias_error},
    Loss{"robust", "Robust",
         "Squares relative to what each pixel is known by: noise of the render, and the error of "
         "the "
         "model that the residuals show. Outliers count less. Without the bias of noise; needs 2 "
         "samples",
         2, true, true, true, robust},
};

}  // namespace

LossResult Loss::evaluate(const Film& film, const Photo& photo) const {
  return evaluate_by(film, photo, weighted ? relative_weights(photo, 1) : Weights());
}

std::span<const Loss> losses() { return kLosses; }

const Loss& find_loss(std::string_view name) {
  std::string names;
  for (const Loss& loss : kLosses) {
    if (loss.name == name) return loss;
    names += (names.empty() ? "" : ", ") + std::string(loss.name);
  }
  throw Refused("", "loss = '" + std::string(name) + "' is unknown", "choose one of " + names);
}

Vector loss_gradient(const SlotLayout& layout, const Film& film, const LossResult& loss) {
  // Per slot and channel first: the three rows of a colour share one pass over its picture.
  std::vector<Color<double>> sums(film.slots.size());
  for (std::size_t s = 0; s < film.slots.size(); ++s) {
    const SlotFilm& slot = film.slots[s];
    for (std::size_t i = 0; i < film.size(); ++i)
      sums[s] += Color<double>(loss.slope[i]) * Color<double>(slot.mean[i]);
    if (loss.curvature.empty()) continue;
    Color<double> bias;
    for (std::size_t i = 0; i < film.size(); ++i)
      bias += Color<double>(loss.curvature[i]) * Color<double>(slot.covariance[i]);
    sums[s] = sums[s] - bias;
  }
  Vector gradient(static_cast<Eigen::Index>(layout.rows.size()));
  for (std::size_t k = 0; k < layout.rows.size(); ++k) {
    const UnknownRow& row = layout.rows[k];
    const Color<double>& sum = sums[static_cast<std::size_t>(row.slot)];
    gradient[static_cast<Eigen::Index>(k)] =
        row.channel < 0 ? sum.r + sum.g + sum.b : sum[row.channel];
  }
  return gradient;
}

Color<double> mean_bias(const Film& film, const Photo& photo) {
  Color<double> bias;
  for (std::size_t i = 0; i < film.size(); ++i)
    if (photo.weight[i] > 0)
      bias +=
          (Color<double>(film.mean[i]) - Color<double>(photo.reference[i])) * (3 * photo.share(i));
  return bias;
}

}  // namespace selenite
