// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "fit/gauss_newton.h"
#include "fit/search.h"

namespace selenite {

enum class AtBound { kNo, kMinimum, kMaximum };

/// What the photos say about one scalar.
struct Confidence {
  double standard_error = 0;         ///< infinite where nothing is known
  std::array<double, 2> interval{};  ///< holds the truth in 90 % of all fits; inside the bounds
  bool determined = false;           ///< else neither of the two is to be shown
  AtBound at_bound = AtBound::kNo;
  int correlated_with = -1;  ///< component that can make up for it in these photos
};

/// Whether something is left that no value of the unknowns explains.
struct Misfit {
  double value = 0;  ///< mean square of render minus photo, in units of the photo's brightness, as
                     ///< far as neighbouring pixels share it: noise of the photo does not count
  double standard_error = 0;
  bool explained = true;
};

struct TrustReport {
  std::vector<Confidence> components;  ///< empty: not verified, or parameters of a medium
  Misfit misfit;
  int passes = 0;
};

/// What one look at frozen values says, summed over photos and pixels; in `Coordinates`.
struct Evidence {
  Eigen::MatrixXd normal;           ///< Z^T w J; not symmetric
  Eigen::MatrixXd normal_variance;  ///< of each of its entries
  Eigen::MatrixXd spread;           ///< covariance of `gradient`, noise of the photos included
  Vector gradient;                  ///< Z^T w (I - photo)
  double misfit = 0, misfit_variance = 0;

  explicit Evidence(Eigen::Index n)
      : normal(Eigen::MatrixXd::Zero(n, n)),
        normal_variance(normal),
        spread(normal),
        gradient(Vector::Zero(n)) {}
  void add(const Capture& capture, const GaussNewton::Equations& equations, std::size_t captures);
};

/// One Gauss-Newton step from the evidence, and how sure it is.
struct Estimate {
  Vector step;          ///< in determined directions only, inside the bounds
  double surprise = 0;  ///< largest component of it along a direction, in standard deviations
  std::vector<Confidence> components;
};
/// `unsure`: a way that counts as one standard error more; empty: none.
Estimate estimate(const Unknowns& unknowns, const Coordinates& coordinates, const Vector& u,
                  const Evidence& evidence, const Vector& unsure = {});

/// Looks again at the answer of a fit, with fresh seeds and frozen values, and says how sure it is.
///
/// All samples of a look are for the same values, so its step and its covariance
/// H^-1 Cov(g) H^-1 need no assumption about the way that led there. Cov(g) is summed from the
/// residuals themselves, pixel by pixel: the noise of the photos is in it without being known. The
/// answer moves by that step; where it is more than noise the look is repeated from there, and if the
/// last step still is, its length is an error beside the noise: it may have gone too far, or half of
/// the way. The first looks take few samples: they are the way to where the next one begins, and where
/// the last step is mostly their noise it is weighed against them by the samples of both.
class Verification {
 public:
  /// `problem` must outlive it. Takes instruments from `optimiser` where that has some.
  Verification(const Problem& problem, const Optimiser& optimiser, Vector x, std::uint64_t seed,
               int spp, int iteration_spp);
  /// The next photo of a pass; false when it was the last of the last.
  bool step(const RenderAt& render);
  double fraction() const;
  const Vector& values() const { return x_; }
  /// After the last step: the answer is not `values` but `x`, for what they were found by does not
  /// hold that far. How far they are apart is an error beside the noise.
  void settle_for(const Vector& x);
  const TrustReport& report() const { return report_; }

 private:
  Observation derivatives(int purpose, std::size_t capture, const RenderAt& render) const;
  void gather_instruments(const RenderAt& render);
  void end_pass();
  int pass_spp(int pass) const;
  double noise_of_step() const;

  const Problem* problem_;
  GaussNewton evidence_;
  bool has_instruments_;
  Evidence found_;           ///< of this pass so far
  Vector u_;                 ///< of the last pass, in `Coordinates`
  std::size_t capture_ = 0;  ///< the next of this pass
  Vector x_;
  std::uint64_t seed_;
  int spp_, iteration_spp_;
  bool over_ = false;
  TrustReport report_;
};

}  // namespace selenite
