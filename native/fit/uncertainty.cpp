// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/uncertainty.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fit/directions.h"
#include "fit/secants.h"
#include "fit/streams.h"
#include "fit/weights.h"

namespace selenite {
namespace {

constexpr double kQuantile90 = 1.6449;
constexpr int kMostPasses = 4;
constexpr double kSurprise = 3;  ///< standard deviations: the answer was not there yet
/// Share of the longest step within which a linear step is as good as a look from its end.
constexpr double kNear = 0.1;
constexpr int kWarmUp = 100;  ///< purpose of their seeds
/// The first passes take shares of the samples, unless that are too few to step by.
constexpr std::array kShares{16, 4};
constexpr int kLeastOfPass = 32;
/// Of the samples of residuals. The Jacobians of the iterations serve on, but where unknowns nearly
/// make up for each other their noise hides that: with an eighth, intervals there are too narrow.
constexpr int kDerivativeShare = 3;
constexpr int kWarmUps = 2;  ///< looks that gather instruments where the fit has none
/// Share of its range, in the coordinate of steps, beyond which a standard deviation says nothing
/// that the clamps have not said (an even spread over the range has 0.29).
constexpr double kUndetermined = 0.1;
constexpr double kPrior = 0.29;
/// A direction of the normal matrix counts from so many of its own standard deviations.
constexpr double kResolved = 3;
constexpr double kCoupled = 2;  ///< the same for its entries beside the diagonal
constexpr double kCorrelated = 0.8;
constexpr double kMisfitSigmas = 3;

using Matrix = Eigen::MatrixXd;

/// How far a coordinate may go: at most a factor of ten either way for what spans decades.
double range_of(const Coordinates& coordinates, Eigen::Index k) {
  constexpr double kDecades = 4.6;
  return std::min(coordinates.maximum()[k] - coordinates.minimum()[k], kDecades);
}

int derivative_spp(int spp) { return std::max(spp / kDerivativeShare, 2); }

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
    normal += product;
    gradient += term;
    spread.noalias() += term * term.transpose();
  }
  // A pixel's residual in one half times its neighbours' in the other: only what they share stays.
  const Eigen::VectorXf relative = relative_weights(capture, captures);
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
        const auto i = static_cast<Eigen::Index>(3 * at(x, y) + c);
        part += relative[i] * halves.residual_a[i] * around[c] / count;
      }
      misfit += part;
      misfit_variance += part * part;
    }
}

namespace {

/// The step along directions that are resolved, with its covariance.
struct Solution {
  Vector step;
  Matrix covariance;
  double surprise = 0;
};

/// Solves for the components `free` alone, in the directions of the scaled normal matrix. Those
/// whose value is noise do not move and are as wide as the clamps leave them; so are the
/// components `unseen`, and the others make up for them where the two are seen to be coupled.
Solution solve(const Evidence& evidence, const Coordinates& coordinates,
               const std::vector<Eigen::Index>& free, const std::vector<Eigen::Index>& unseen,
               const Vector& unsure) {
  const Vector inverse = evidence.normal.diagonal()(free).cwiseSqrt().cwiseInverse();
  const auto scaled = [&](const Matrix& m) -> Matrix {
    return inverse.asDiagonal() * m(free, free) * inverse.asDiagonal();
  };
  const Matrix doubt = inverse.cwiseAbs2().asDiagonal() * evidence.normal_variance(free, free) *
                       inverse.cwiseAbs2().asDiagonal();
  const Directions directions(scaled(evidence.normal));
  const Matrix &in = directions.in, &out = directions.out;
  const Vector along = out.transpose() * inverse.cwiseProduct(-evidence.gradient(free));
  const Matrix noise = out.transpose() * scaled(evidence.spread) * out;
  const Eigen::Index n = along.size();
  Vector reciprocal = Vector::Zero(n);  // of the values; 0: not resolved
  Solution solution;
  for (Eigen::Index j = 0; j < n; ++j) {
    const double error = std::sqrt(out.col(j).cwiseAbs2().dot(doubt * in.col(j).cwiseAbs2()));
    if (!(directions.values[j] > kResolved * error)) continue;
    reciprocal[j] = 1 / directions.values[j];
    const double deviation = std::sqrt(noise(j, j));
    if (std::abs(along[j]) > solution.surprise * deviation)
      solution.surprise = std::abs(along[j]) / deviation;
  }
  Matrix spread = reciprocal.asDiagonal() * noise * reciprocal.asDiagonal();
  for (Eigen::Index j = 0; j < n; ++j) {
    if (reciprocal[j] > 0) continue;
    double steepest = 0;
    for (Eigen::Index k = 0; k < n; ++k) {
      const double range = range_of(coordinates, free[static_cast<std::size_t>(k)]);
      steepest = std::max(steepest, std::abs(inverse[k] * in(k, j)) / (kPrior * range));
    }
    spread(j, j) = 1 / (steepest * steepest);
  }
  solution.step = inverse.cwiseProduct(in * reciprocal.cwiseProduct(along));
  solution.covariance =
      inverse.asDiagonal() * (in * spread * in.transpose()) * inverse.asDiagonal();
  for (const Eigen::Index m : unseen) {
    Vector coupling = evidence.normal.col(m)(free);
    for (Eigen::Index k = 0; k < n; ++k) {
      const double error =
          std::sqrt(evidence.normal_variance(free[static_cast<std::size_t>(k)], m));
      if (std::abs(coupling[k]) <= kCoupled * error) coupling[k] = 0;
    }
    const Vector answer =
        kPrior * range_of(coordinates, m) *
        inverse.cwiseProduct(
            in * reciprocal.cwiseProduct(out.transpose() * inverse.cwiseProduct(coupling)));
    solution.covariance += answer * answer.transpose();
  }
  if (unsure.size() > 0) solution.covariance += unsure(free) * unsure(free).transpose();
  return solution;
}

/// Values of component k between two offsets from u in its coordinate, inside the bounds.
std::array<double, 2> values_between(const Coordinates& coordinates, const Vector& u,
                                     Eigen::Index k, double low, double high) {
  const auto value = [&](double offset) {
    Vector end = u;
    end[k] = std::clamp(u[k] + offset, coordinates.minimum()[k], coordinates.maximum()[k]);
    return coordinates.to_values(end)[k];
  };
  return {value(low), value(high)};
}

bool is_blur(const Unknowns& unknowns, Eigen::Index k) {
  return unknowns.description_of(static_cast<int>(k)).coordinate == Coordinate::kBlur;
}

/// Roughness k where pictures are as far from those at u as a step `way` of its coordinate says. The
/// slope by a low roughness is a difference with a picture above it (`take_secants`): below there is
/// no room. Down to the bound pictures change by far less than it says: with the fourth power of
/// roughness (3.6, measured from 0.01 to 0.07 and 0.23 on the thesis' bunny). So the way is gone in
/// log(x^4 + s^4) / 4, which is the coordinate of the steps again where x is high.
double by_the_blur(const Coordinates& coordinates, const Vector& u, Eigen::Index k, double way) {
  constexpr double kShift = 0.2;
  const double floor = std::pow(kShift, 4);
  const auto straight = [&](double x) { return std::log(std::pow(x, 4) + floor) / 4; };
  Vector far = u;
  far[k] += kBlurSecant;
  const double here = straight(coordinates.to_values(u)[k]);
  const double slope = (straight(coordinates.to_values(far)[k]) - here) / kBlurSecant;
  return std::pow(std::max(std::exp(4 * (here + way * slope)) - floor, 0.0), 0.25);
}

/// The interval of a roughness reaches as far as nothing can be seen of it.
void follow_the_blur(const Unknowns& unknowns, const Coordinates& coordinates, const Vector& u,
                     Eigen::Index k, double reach, Confidence& one) {
  if (!is_blur(unknowns, k)) return;
  one.interval[0] = std::max(std::min(one.interval[0], by_the_blur(coordinates, u, k, -reach)),
                             unknowns.minimum()[k]);
  one.interval[1] = std::min(std::max(one.interval[1], by_the_blur(coordinates, u, k, reach)),
                             unknowns.maximum()[k]);
}

/// A step down to a low roughness falls short in its coordinate (see `by_the_blur`). Up it goes no
/// farther than that: noise alone would take a smooth body to where it looks the same.
double blurred_step(const Coordinates& coordinates, const Vector& u, Eigen::Index k, double step) {
  if (step >= 0) return step;
  Vector end = coordinates.to_values(u);
  end[k] = by_the_blur(coordinates, u, k, step);
  return std::min(step, coordinates.from_values(end)[k] - u[k]);
}

/// What the solution says about component k, the `at`-th of those solved for.
Confidence confidence(const Unknowns& unknowns, const Coordinates& coordinates, const Vector& u,
                      const Solution& solution, Eigen::Index at, Eigen::Index k) {
  Confidence one;
  const double error = std::sqrt(solution.covariance(at, at)), step = solution.step[at];
  const double to = u[k] + step;
  one.interval =
      values_between(coordinates, u, k, step - kQuantile90 * error, step + kQuantile90 * error);
  Vector end = u;
  end[k] = std::clamp(to, coordinates.minimum()[k], coordinates.maximum()[k]);
  follow_the_blur(unknowns, coordinates, end, k, kQuantile90 * error, one);
  one.standard_error = error * coordinates.slope(coordinates.to_values(end))[k];
  one.determined = error < kUndetermined * range_of(coordinates, k);
  if (to <= coordinates.minimum()[k]) one.at_bound = AtBound::kMinimum;
  if (to >= coordinates.maximum()[k]) one.at_bound = AtBound::kMaximum;
  return one;
}

/// The component whose error goes most with that of the `at`-th, if that is much.
int strongest_partner(const Matrix& covariance, Eigen::Index at,
                      const std::vector<Eigen::Index>& free) {
  int partner = -1;
  double strongest = kCorrelated;
  for (Eigen::Index j = 0; j < covariance.rows(); ++j) {
    const double size = std::sqrt(covariance(j, j) * covariance(at, at));
    if (j == at || !(std::abs(covariance(at, j)) > strongest * size)) continue;
    strongest = std::abs(covariance(at, j)) / size;
    partner = static_cast<int>(free[static_cast<std::size_t>(j)]);
  }
  return partner;
}

}  // namespace

Estimate estimate(const Unknowns& unknowns, const Coordinates& coordinates, const Vector& u,
                  const Evidence& evidence, const Vector& unsure) {
  const Eigen::Index n = u.size();
  Estimate result;
  result.step = Vector::Zero(n);
  result.components.resize(static_cast<std::size_t>(n));
  std::vector<Eigen::Index> free, unseen;
  for (Eigen::Index k = 0; k < n; ++k) {
    Confidence& one = result.components[static_cast<std::size_t>(k)];
    one.standard_error = std::numeric_limits<double>::infinity();
    one.interval = {unknowns.minimum()[k], unknowns.maximum()[k]};
    const double error = std::sqrt(evidence.normal_variance(k, k));
    (evidence.normal(k, k) > kResolved * error ? free : unseen).push_back(k);
  }
  // Those that would leave at a bound stay there, and the others are solved for without them.
  for (bool again = true; again && !free.empty();) {
    Solution solution = solve(evidence, coordinates, free, unseen, unsure);
    for (std::size_t i = 0; i < free.size(); ++i)
      if (double& step = solution.step[static_cast<Eigen::Index>(i)]; is_blur(unknowns, free[i]))
        step = blurred_step(coordinates, u, free[i], step);
    result.surprise = solution.surprise;
    std::vector<Eigen::Index> kept;
    for (std::size_t i = 0; i < free.size(); ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      const Eigen::Index k = free[i];
      Confidence& one = result.components[static_cast<std::size_t>(k)];
      one = confidence(unknowns, coordinates, u, solution, at, k);
      one.correlated_with = strongest_partner(solution.covariance, at, free);
      result.step[k] = solution.step[at];
      if (one.at_bound == AtBound::kNo) {
        kept.push_back(k);
        continue;
      }
      const bool low = one.at_bound == AtBound::kMinimum;
      result.step[k] = (low ? coordinates.minimum() : coordinates.maximum())[k] - u[k];
      // It is at the bound for the answer, so the interval reaches there whatever the step says.
      one.interval[low ? 0 : 1] = (low ? unknowns.minimum() : unknowns.maximum())[k];
    }
    again = kept.size() < free.size();
    free = std::move(kept);
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
      found_(x.size()),
      x_(std::move(x)),
      seed_(seed),
      spp_(spp),
      iteration_spp_(has_instruments_ ? iteration_spp : derivative_spp(spp)) {}

int Verification::pass_spp(int pass) const {
  const auto index = static_cast<std::size_t>(pass);
  return index < kShares.size() ? std::min(spp_, std::max(spp_ / kShares[index], kLeastOfPass))
                                : spp_;
}

Observation Verification::derivatives(int purpose, std::size_t capture,
                                      const RenderAt& render) const {
  return {static_cast<int>(capture),
          render(x_, problem_->captures[capture], derivative_spp(pass_spp(report_.passes)),
                 seed_of(seed_, purpose, static_cast<int>(capture)), Side::kBoth),
          {}};
}

/// Steps of its own are not taken: only what they have seen counts.
void Verification::gather_instruments(const RenderAt& render) {
  for (int i = 0; i < kWarmUps; ++i) {
    std::vector<Observation> seen;
    for (std::size_t v = 0; v < problem_->captures.size(); ++v)
      seen.push_back(derivatives(kWarmUp + i, v, render));
    (void)evidence_.step(x_, seen);
  }
  has_instruments_ = true;
}

bool Verification::step(const RenderAt& render) {
  if (over_) return false;
  if (!has_instruments_) gather_instruments(render);
  const std::size_t captures = problem_->captures.size();
  const Capture& photo = problem_->captures[capture_];
  const int spp = pass_spp(report_.passes);
  const double weight = static_cast<double>(derivative_spp(spp)) / iteration_spp_;
  const Film film = render(
      x_, photo, spp, seed_of(seed_, 2 * report_.passes, static_cast<int>(capture_)), std::nullopt);
  const Observation slopes = derivatives(2 * report_.passes + 1, capture_, render);
  found_.add(photo, evidence_.equations(x_, slopes, film, weight), captures);
  if (++capture_ == captures) end_pass();
  return !over_;
}

void Verification::end_pass() {
  const Coordinates& coordinates = evidence_.coordinates();
  u_ = coordinates.from_values(x_);
  Estimate now = estimate(problem_->unknowns, coordinates, u_, found_);
  ++report_.passes;
  report_.misfit.value = found_.misfit;
  report_.misfit.standard_error = std::sqrt(found_.misfit_variance);
  report_.misfit.explained = found_.misfit <= kMisfitSigmas * report_.misfit.standard_error;
  const double reach = now.step.cwiseQuotient(coordinates.cap()).cwiseAbs().maxCoeff();
  const double noise = noise_of_step();
  const bool whole = pass_spp(report_.passes - 1) == spp_ && report_.passes > 1;
  const bool near = reach <= kNear && now.surprise <= kSurprise * noise;
  const bool there = near || now.surprise <= kSurprise;
  over_ = (whole && there) || report_.passes == kMostPasses;
  if (over_ && near) {
    // Where this pass began is what the one before found: both count, by their samples.
    found_.gradient *= 1 - 1 / (noise * noise);
    now = estimate(problem_->unknowns, coordinates, u_, found_);
  }
  x_ = problem_->unknowns.project(coordinates.to_values(u_ + now.step / std::max(1.0, reach)));
  report_.components = now.components;
  if (over_) {
    if (!there)
      report_.components =
          estimate(problem_->unknowns, coordinates, u_, found_, now.step).components;
    return;
  }
  found_ = Evidence(x_.size());
  capture_ = 0;
}

/// Standard deviation of the last step where all of it is noise, over that of its own pass: the pass
/// before had fewer samples, and where it led has their noise.
double Verification::noise_of_step() const {
  const double now = pass_spp(report_.passes - 1);
  return report_.passes > 1 ? std::sqrt(1 + now / pass_spp(report_.passes - 2)) : 1;
}

void Verification::settle_for(const Vector& x) {
  const Coordinates& coordinates = evidence_.coordinates();
  const Vector apart = coordinates.from_values(x_) - coordinates.from_values(x);
  report_.components = estimate(problem_->unknowns, coordinates, u_, found_, apart).components;
}

double Verification::fraction() const {
  if (over_) return 1;
  const double part =
      static_cast<double>(capture_) / static_cast<double>(problem_->captures.size());
  // One more than those with a share is the last, mostly.
  const int passes = std::max(report_.passes, static_cast<int>(kShares.size())) + 1;
  double done = pass_spp(report_.passes) * part, all = 0;
  for (int pass = 0; pass < passes; ++pass) {
    all += pass_spp(pass);
    if (pass < report_.passes) done += pass_spp(pass);
  }
  return done / all;
}

}  // namespace selenite
