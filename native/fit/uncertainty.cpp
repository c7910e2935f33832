// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/uncertainty.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "math/rng.h"

namespace selenite {
namespace {

constexpr double kQuantile90 = 1.6449;
constexpr int kMostPasses = 3;
constexpr double kSurprise = 3;  ///< standard deviations: the answer was not there yet
constexpr int kWarmUp = 100;     ///< purpose of their seeds
/// Residuals take most of the samples: the Jacobians of the iterations serve on.
constexpr int kDerivativeShare = 8;
constexpr int kWarmUps = 2;  ///< looks that gather instruments where the fit has none
/// Share of its range, in the coordinate of steps, beyond which a standard deviation says nothing
/// that the clamps have not said (an even spread over the range has 0.29).
constexpr double kUndetermined = 0.1;
constexpr double kPrior = 0.29;
/// An eigenvalue of the normal matrix counts from so many of its own standard deviations.
constexpr double kResolved = 3;
constexpr double kCorrelated = 0.8;
constexpr double kMisfitSigmas = 3;
constexpr double kDimShare = 0.3;

using Matrix = Eigen::MatrixXd;

/// How far a coordinate may go: at most a factor of ten either way for what spans decades.
double range_of(const Coordinates& coordinates, Eigen::Index k) {
  constexpr double kDecades = 4.6;
  return std::min(coordinates.maximum()[k] - coordinates.minimum()[k], kDecades);
}

}  // namespace

void Evidence::add(const Capture& capture, const GaussNewton::Equations& equations,
                   std::size_t captures) {
  const auto& [halves, z, weight] = equations;
  const Eigen::Index n = gradient.size(), pixels = weight.size() / 3;
  Matrix product(n, n);
  Vector term(n);
  for (Eigen::Index i = 0; i < pixels; ++i) {
    if (weight[3 * i] == 0 && weight[3 * i + 1] == 0 && weight[3 * i + 2] == 0) continue;
    product.setZero();
    term.setZero();
    for (Eigen::Index j = 3 * i; j < 3 * i + 3; ++j) {
      const double w = weight[j] / 2;
      const Vector only_a = z.only_a.row(j).cast<double>(), only_b = z.only_b.row(j).cast<double>();
      const Vector plain_a = z.plain_a.row(j).cast<double>();
      const Vector plain_b = z.plain_b.row(j).cast<double>();
      product.noalias() += w * only_a * plain_b.transpose();
      product.noalias() += w * only_b * plain_a.transpose();
      const double both = (halves.residual_a[j] + halves.residual_b[j]) / 2;
      term += w * both * (only_a + only_b);
      // Noise of a half is what the halves do not share.
      const Vector noise = (plain_a - plain_b).cwiseAbs2() / 2;
      const Vector size = only_a.cwiseAbs2() + only_b.cwiseAbs2();
      const Matrix mixed = size * noise.transpose();
      normal_variance += 2 * w * w * (mixed + mixed.transpose());
    }
    normal += (product + product.transpose()) / 2;
    gradient += term;
    spread.noalias() += term * term.transpose();
  }
  // A pixel's residual in one half times its neighbours' in the other: only what they share stays.
  double mean = 0;
  for (std::size_t i = 0; i < capture.size(); ++i)
    for (int c = 0; c < 3; ++c) mean += capture.share(i) * capture.reference[i][c];
  const auto at = [&](int x, int y) { return static_cast<std::size_t>(y) * capture.width + x; };
  for (int y = 0; y < capture.height; ++y)
    for (int x = 0; x < capture.width; ++x) {
      if (capture.weight[at(x, y)] == 0) continue;
      std::array<double, 3> around{};
      int count = 0;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          const int p = x + dx, q = y + dy;
          if ((dx == 0 && dy == 0) || p < 0 || q < 0 || p >= capture.width || q >= capture.height)
            continue;
          if (capture.weight[at(p, q)] == 0) continue;
          ++count;
          for (std::size_t c = 0; c < 3; ++c)
            around[c] += halves.residual_b[static_cast<Eigen::Index>(3 * at(p, q) + c)];
        }
      if (count == 0) continue;
      double part = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const double level = std::max<double>(capture.reference[at(x, y)][static_cast<int>(c)], 0) +
                             kDimShare * mean;
        if (!(level > 0)) continue;
        part += capture.share(at(x, y)) / static_cast<double>(captures) / (level * level) *
                halves.residual_a[static_cast<Eigen::Index>(3 * at(x, y) + c)] * around[c] / count;
      }
      misfit += part;
      misfit_variance += part * part;
    }
}

Estimate estimate(const Unknowns& unknowns, const Coordinates& coordinates, const Vector& u,
                  const Evidence& evidence) {
  const Eigen::Index n = u.size();
  Estimate result;
  result.step = Vector::Zero(n);
  result.components.resize(static_cast<std::size_t>(n));
  const Vector x = coordinates.to_values(u);
  std::vector<Eigen::Index> free;
  for (Eigen::Index k = 0; k < n; ++k) {
    Confidence& one = result.components[static_cast<std::size_t>(k)];
    one.standard_error = std::numeric_limits<double>::infinity();
    one.interval = {unknowns.minimum()[k], unknowns.maximum()[k]};
    const double own = evidence.normal(k, k);
    if (own > kResolved * std::sqrt(evidence.normal_variance(k, k)) && own > 0) free.push_back(k);
  }
  // Solved again without those that would leave at a bound: those stay there.
  std::vector<Eigen::Index> held;
  Matrix basis, covariance;
  Vector mean;
  while (!free.empty()) {
    const Vector inverse = evidence.normal.diagonal()(free).cwiseSqrt().cwiseInverse();
    const Matrix scaled = inverse.asDiagonal() * evidence.normal(free, free) * inverse.asDiagonal();
    const Matrix noise = inverse.asDiagonal() * evidence.spread(free, free) * inverse.asDiagonal();
    const Matrix doubt = inverse.cwiseAbs2().asDiagonal() * evidence.normal_variance(free, free) *
                         inverse.cwiseAbs2().asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Matrix> solver(scaled);
    basis = solver.eigenvectors();
    const Vector along = basis.transpose() * inverse.cwiseProduct(-evidence.gradient(free));
    const Matrix noise_along = basis.transpose() * noise * basis;
    Vector step = Vector::Zero(along.size());
    std::vector<bool> known;
    result.surprise = 0;
    for (Eigen::Index j = 0; j < along.size(); ++j) {
      const double value = solver.eigenvalues()[j];
      const Vector square = basis.col(j).cwiseAbs2();
      known.push_back(value > kResolved * std::sqrt(square.dot(doubt * square)));
      if (!known.back()) continue;
      step[j] = along[j] / value;
      const double error = std::sqrt(noise_along(j, j));
      if (std::abs(along[j]) > result.surprise * error)
        result.surprise = std::abs(along[j]) / error;
    }
    Matrix spread = Matrix::Zero(along.size(), along.size());
    for (Eigen::Index i = 0; i < along.size(); ++i) {
      for (Eigen::Index j = 0; j < along.size(); ++j)
        if (known[static_cast<std::size_t>(i)] && known[static_cast<std::size_t>(j)])
          spread(i, j) = noise_along(i, j) / (solver.eigenvalues()[i] * solver.eigenvalues()[j]);
      if (known[static_cast<std::size_t>(i)]) continue;
      double steepest = 0;  // as wide as the clamps leave it
      for (Eigen::Index k = 0; k < along.size(); ++k) {
        const double range = range_of(coordinates, free[static_cast<std::size_t>(k)]);
        steepest = std::max(steepest, std::abs(inverse[k] * basis(k, i)) / (kPrior * range));
      }
      spread(i, i) = 1 / (steepest * steepest);
    }
    mean = inverse.cwiseProduct(basis * step);
    covariance = inverse.asDiagonal() * (basis * spread * basis.transpose()) * inverse.asDiagonal();
    std::vector<Eigen::Index> kept;
    for (std::size_t i = 0; i < free.size(); ++i) {
      const Eigen::Index k = free[i];
      const double to = u[k] + mean[static_cast<Eigen::Index>(i)];
      const bool low = to <= coordinates.minimum()[k], high = to >= coordinates.maximum()[k];
      if (!low && !high) {
        kept.push_back(k);
        continue;
      }
      Confidence& one = result.components[static_cast<std::size_t>(k)];
      const double bound = low ? coordinates.minimum()[k] : coordinates.maximum()[k];
      const double error =
          std::sqrt(covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(i)));
      one.at_bound = low ? AtBound::kMinimum : AtBound::kMaximum;
      result.step[k] = bound - u[k];
      const double inner = low ? std::max(to + kQuantile90 * error, bound)
                               : std::min(to - kQuantile90 * error, bound);
      Vector end = u;
      end[k] = std::clamp(inner, coordinates.minimum()[k], coordinates.maximum()[k]);
      const double value = coordinates.to_values(end)[k];
      end[k] = bound;
      const double edge = coordinates.to_values(end)[k];
      one.standard_error = error * coordinates.slope(coordinates.to_values(end))[k];
      one.interval = {std::min(value, edge), std::max(value, edge)};
      one.determined = error < kUndetermined * range_of(coordinates, k);
      held.push_back(k);
    }
    if (kept.size() == free.size()) break;
    free = kept;
  }
  for (std::size_t i = 0; i < free.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const Eigen::Index k = free[i];
    Confidence& one = result.components[static_cast<std::size_t>(k)];
    const double error = std::sqrt(covariance(at, at));
    one.determined = error < kUndetermined * range_of(coordinates, k);
    result.step[k] = mean[at];
    Vector end = u;
    const auto value_at = [&](double offset) {
      end[k] =
          std::clamp(u[k] + mean[at] + offset, coordinates.minimum()[k], coordinates.maximum()[k]);
      return coordinates.to_values(end)[k];
    };
    one.interval = {value_at(-kQuantile90 * error), value_at(kQuantile90 * error)};
    (void)value_at(0);
    one.standard_error = error * coordinates.slope(coordinates.to_values(end))[k];
    double strongest = kCorrelated;
    for (std::size_t j = 0; j < free.size(); ++j) {
      const auto other = static_cast<Eigen::Index>(j);
      const double size = std::sqrt(covariance(other, other)) * error;
      if (j == i || !(size > 0)) continue;
      const double correlation = std::abs(covariance(at, other)) / size;
      if (correlation <= strongest) continue;
      strongest = correlation;
      one.correlated_with = static_cast<int>(free[j]);
    }
  }
  return result;
}

Verification::Verification(const Problem& problem, const Optimiser& optimiser, Vector x,
                           std::uint64_t seed, int spp, int iteration_spp)
    : problem_(&problem),
      evidence_(dynamic_cast<const GaussNewton*>(&optimiser)
                    ? dynamic_cast<const GaussNewton&>(optimiser)
                    : GaussNewton(problem)),
      has_instruments_(dynamic_cast<const GaussNewton*>(&optimiser) != nullptr),
      x_(std::move(x)),
      seed_(seed),
      spp_(spp),
      derivative_spp_(std::max(spp / kDerivativeShare, 2)),
      iteration_spp_(has_instruments_ ? iteration_spp : derivative_spp_) {}

std::uint64_t Verification::seed_for(int purpose, std::size_t capture) const {
  const std::uint64_t key = mix64(seed_ ^ static_cast<std::uint64_t>(purpose));
  return mix64(key ^ (static_cast<std::uint64_t>(capture) << 32));
}

Observation Verification::derivatives(int purpose, std::size_t capture,
                                      const RenderAt& render) const {
  return {static_cast<int>(capture),
          render(x_, problem_->captures[capture], derivative_spp_, seed_for(purpose, capture),
                 Side::kBoth),
          {}};
}

bool Verification::step(const RenderAt& render) {
  if (over_) return false;
  const std::size_t captures = problem_->captures.size();
  if (!has_instruments_) {  // its steps are not taken: only what it has seen counts
    for (int i = 0; i < kWarmUps; ++i) {
      std::vector<Observation> seen;
      for (std::size_t v = 0; v < captures; ++v)
        seen.push_back(derivatives(kWarmUp + i, v, render));
      (void)evidence_.step(x_, seen);
    }
    has_instruments_ = true;
  }
  const Coordinates& coordinates = evidence_.coordinates();
  const double weight = static_cast<double>(derivative_spp_) / iteration_spp_;
  Evidence found(x_.size());
  for (std::size_t v = 0; v < captures; ++v) {
    const Capture& photo = problem_->captures[v];
    const Film film = render(x_, photo, spp_, seed_for(2 * report_.passes, v), std::nullopt);
    const Observation slopes = derivatives(2 * report_.passes + 1, v, render);
    found.add(photo, evidence_.equations(x_, slopes, film, weight), captures);
  }
  const Vector u = coordinates.from_values(x_);
  const Estimate now = estimate(problem_->unknowns, coordinates, u, found);
  ++report_.passes;
  report_.components = now.components;
  report_.misfit.value = found.misfit;
  report_.misfit.standard_error = std::sqrt(found.misfit_variance);
  report_.misfit.explained = found.misfit <= kMisfitSigmas * report_.misfit.standard_error;
  const double reach = now.step.cwiseQuotient(coordinates.cap()).cwiseAbs().maxCoeff();
  x_ = problem_->unknowns.project(coordinates.to_values(u + now.step / std::max(1.0, reach)));
  over_ = now.surprise <= kSurprise || report_.passes == kMostPasses;
  if (over_ && now.surprise > kSurprise)  // still on its way: no interval would hold
    for (Confidence& one : report_.components) one.determined = false;
  return !over_;
}

double Verification::fraction() const {
  return over_ ? 1 : static_cast<double>(report_.passes) / kMostPasses;
}

}  // namespace selenite
