// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/inference/fisher_information.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "fit/problem/pixel_weights.h"
#include "fit/solver/singular_directions.h"

namespace selenite {
namespace {

using Matrix = Eigen::MatrixXd;

Eigen::VectorXf near_variance(const Eigen::VectorXf& of_sample, const Photo& photo) {
  return box_blur(of_sample.cwiseMax(0.f), photo.width, photo.height, kPixelWeights.noise_radius);
}

/// Diagonal of Z^T w Z, one half times the other.
Vector strength(const InstrumentalVariables::Set& z, const Eigen::VectorXf& weight) {
  return (weight.asDiagonal() * z.a.filtered.cwiseProduct(z.b.filtered))
      .cast<double>()
      .colwise()
      .sum();
}

/// A filter shortens an instrument; what it lets through is made as long as the derivative is.
void scale_instruments(const Vector& strength, FisherInformation& found) {
  Vector scale = Vector::Ones(strength.size());
  for (Eigen::Index k = 0; k < strength.size(); ++k) {
    const double error = std::sqrt(found.normal_variance(k, k));
    const bool resolved = found.normal(k, k) > kConfidence.resolved * error;
    if (resolved && strength[k] > 0) scale[k] = found.normal(k, k) / strength[k];
  }
  found.normal = scale.asDiagonal() * found.normal;
  found.normal_variance = scale.cwiseAbs2().asDiagonal() * found.normal_variance;
  found.score_covariance = scale.asDiagonal() * found.score_covariance * scale.asDiagonal();
}

/// Directions of the normal matrix, its diagonal scaled to 1.
struct ScaledDirections {
  Vector scale;  ///< roots of the diagonal
  SingularDirections directions;
  Vector error;  ///< standard deviation of each value

  ScaledDirections(const Matrix& normal, const Matrix& variance)
      : scale(normal.diagonal().cwiseSqrt()),
        directions(scale.cwiseInverse().asDiagonal() * normal * scale.cwiseInverse().asDiagonal()) {
    const Vector inverse = scale.cwiseAbs2().cwiseInverse();
    const Matrix noise = inverse.asDiagonal() * variance * inverse.asDiagonal();
    error.resize(scale.size());
    for (Eigen::Index j = 0; j < error.size(); ++j)
      error[j] = std::sqrt(
          directions.out.col(j).cwiseAbs2().dot(noise * directions.in.col(j).cwiseAbs2()));
  }
};

}  // namespace

double FisherInformation::relative_uncertainty() const {
  double largest = 0;
  for (Eigen::Index k = 0; k < normal.rows(); ++k) {
    const double error = std::sqrt(normal_variance(k, k));
    if (error == 0) continue;  // exact, or not seen at all: no samples change that
    if (!(normal(k, k) > 0)) return std::numeric_limits<double>::infinity();
    largest = std::max(largest, error / normal(k, k));
  }
  return largest;
}

Matrix FisherInformation::precision(double resolved) const {
  Matrix result = Matrix::Zero(normal.rows(), normal.cols());
  std::vector<Eigen::Index> seen;
  for (Eigen::Index k = 0; k < normal.rows(); ++k)
    if (normal(k, k) > resolved * std::sqrt(normal_variance(k, k))) seen.push_back(k);
  if (seen.empty()) return result;
  const ScaledDirections all(normal(seen, seen), normal_variance(seen, seen));
  const auto& [out, in, values] = all.directions;
  std::vector<Eigen::Index> good;
  for (Eigen::Index j = 0; j < values.size(); ++j)
    if (values[j] > resolved * all.error[j]) good.push_back(j);
  if (good.empty()) return result;
  // H^T S^-1 H, with S in units of H: that keeps noise in S inside what it can be.
  const Vector root = values(good).cwiseSqrt();
  const Matrix across = all.scale.cwiseInverse().asDiagonal() * out(Eigen::all, good) *
                        root.cwiseInverse().asDiagonal();
  const Matrix ratio = across.transpose() * score_covariance(seen, seen) * across;
  const Eigen::SelfAdjointEigenSolver<Matrix> axes((ratio + ratio.transpose()) / 2);
  const Matrix rows =
      all.scale.asDiagonal() * in(Eigen::all, good) * root.asDiagonal() * axes.eigenvectors();
  const Vector inverse = axes.eigenvalues().cwiseMax(low).cwiseMin(high).cwiseInverse();
  result(seen, seen) = rows * inverse.asDiagonal() * rows.transpose();
  return result;
}

InstrumentalVariables instrumental_variables(const PhotoJacobian& seen) {
  InstrumentalVariables sums;
  for (const PhotoJacobian::Portion& one : seen.portions) sums.add(one.halves, 1, one.spp);
  return sums;
}

FisherInformation fisher_information(const PhotoJacobian& seen, const Photo& photo,
                                     const ResidualNoise& noise) {
  const Eigen::VectorXf variance = near_variance(seen.variance, photo);
  ModelError unexplained = noise.model;
  unexplained.shift /= std::sqrt(noise.pixels);
  const Eigen::VectorXf of_model = ErrorScales(photo).variance(unexplained);
  const Eigen::VectorXf weight =
      shares(photo, 1).cwiseQuotient(residual_variance(photo, variance) + of_model);
  const Eigen::VectorXf of_photo = brightness(photo) * static_cast<float>(noise.relative);
  const Eigen::VectorXf of_residual =
      (variance / static_cast<float>(noise.spp) + of_photo.cwiseAbs2()) /
          static_cast<float>(noise.pixels) +
      of_model;
  const InstrumentalVariables::Set z = instrumental_variables(seen).all(seen.layout, photo, weight);
  const Eigen::Index n = z.a.slopes.cols();
  const Matrix zero = Matrix::Zero(n, n);
  FisherInformation found{zero, zero, zero, std::numeric_limits<double>::infinity(), 0};
  Matrix noise_a(n, n), noise_b(n, n);
  Vector score_a(n), score_b(n);
  for (std::size_t p = 0; p < photo.size(); ++p) {
    if (photo.weight[p] == 0) continue;
    noise_a.setZero();
    noise_b.setZero();
    score_a.setZero();
    score_b.setZero();
    const auto i = static_cast<Eigen::Index>(3 * p);
    for (Eigen::Index j = i; j < i + 3; ++j) {
      const double w = weight[j], v = of_residual[j];
      const Vector a = w * z.a.filtered.row(j).cast<double>();
      const Vector b = w * z.b.filtered.row(j).cast<double>();
      found.normal.noalias() += a * z.b.slopes.row(j).cast<double>() / 2;
      found.normal.noalias() += b * z.a.slopes.row(j).cast<double>() / 2;
      noise_b.noalias() += a * z.b.noise.row(j).cast<double>() / 2;
      noise_a.noalias() += b * z.a.noise.row(j).cast<double>() / 2;
      score_a += a * std::sqrt(v);
      score_b += b * std::sqrt(v);
      found.low = std::min(found.low, w * v);
      found.high = std::max(found.high, 3 * w * v);
    }
    found.normal_variance += noise_a.cwiseAbs2() + noise_b.cwiseAbs2();
    found.score_covariance += (score_a * score_b.transpose() + score_b * score_a.transpose()) / 2;
  }
  scale_instruments(strength(z, weight), found);
  return found;
}

double weakest_direction(std::span<const FisherInformation> photos) {
  Matrix normal = photos.front().normal, variance = photos.front().normal_variance;
  for (const FisherInformation& one : photos.subspan(1)) {
    normal += one.normal;
    variance += one.normal_variance;
  }
  if (!(normal.diagonal().array() > 0).all()) return 0;
  const ScaledDirections all(normal, variance);
  double weakest = std::numeric_limits<double>::infinity();
  for (Eigen::Index j = 0; j < all.error.size(); ++j) {
    const double value = all.directions.values[j];
    if (all.error[j] > 0 || value <= 0)
      weakest = std::min(weakest, all.error[j] > 0 ? value / all.error[j] : 0.0);
  }
  return weakest;
}

Vector expected_errors(std::span<const Matrix> photos, const Vector& ranges) {
  const Vector width = kConfidence.prior * ranges.cwiseMin(kConfidence.decades);
  Matrix total = width.cwiseAbs2().cwiseInverse().asDiagonal();
  for (const Matrix& one : photos) total += one;
  // Scaled to a diagonal of 1: precisions differ by many orders of magnitude.
  const Vector inverse = total.diagonal().cwiseSqrt().cwiseInverse();
  const Matrix scaled = inverse.asDiagonal() * total * inverse.asDiagonal();
  return scaled.inverse().diagonal().cwiseSqrt().cwiseProduct(inverse);
}

std::vector<bool> determined(const Vector& errors, const Vector& ranges) {
  std::vector<bool> known;
  for (Eigen::Index k = 0; k < errors.size(); ++k)
    known.push_back(errors[k] <
                    kConfidence.undetermined * std::min(ranges[k], kConfidence.decades));
  return known;
}

double information_gain(const Vector& before, const Vector& after,
                        const std::vector<std::vector<int>>& groups) {
  double sum = 0;
  for (const std::vector<int>& group : groups) {
    double of_group = 0;
    for (const int k : group) of_group += std::log(before[k] / after[k]);
    sum += of_group / static_cast<double>(group.size());
  }
  return sum / static_cast<double>(groups.size());
}

double relative_misfit(const Film& film, const Photo& photo) {
  const Halves halves = residual_halves(film, photo);
  const Eigen::VectorXf of_sample = halves.variance * (static_cast<float>(film.spp) / 2);
  const Eigen::VectorXf weight = noise_weights(photo, 1, near_variance(of_sample, photo));
  const Eigen::VectorXf level = brightness(photo);
  double sum = 0, total = 0;
  for (Eigen::Index j = 0; j < weight.size(); ++j) {
    const double square = static_cast<double>(level[j]) * level[j];
    const double share = std::pow(weight[j] * square, 2);
    sum += share * halves.residual_a[j] * halves.residual_b[j] / square;
    total += share;
  }
  return sum / total;
}

}  // namespace selenite
