// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "fit/evaluate/cancellation.h"
#include "fit/evaluate/local_regression.h"
#include "fit/evaluate/wiener_filter.h"
#include "fit/objective/half_buffers.h"
#include "fit/problem/saved_state.h"
#include "fit/solver/column_sums.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "InstrumentalVariablesOptions".
struct InstrumentalVariablesOptions {
  WienerFilterOptions filter{};
  /// Of the box blur of a derivative picture of which there is one draw only, in pixels.
  int first_blur_radius = 1;
  LocalRegressionOptions regression{};
  /// Share of a derivative picture's power that is signal, from which it takes no regression.
  double clear = 0.25;
};

/// How noise is taken out of derivative pictures: by the filter alone, or also by what the picture itself
/// says of them, which takes longer.
enum class Denoising { kFilter, kRegression };

/// Jacobians of a photo summed over iterations, halves apart: derivative pictures whose noise falls from
/// iteration to iteration. Direct shares, where films have them, are filtered apart from the rest, whose
/// noise would bury them.
class InstrumentalVariables {
 public:
  InstrumentalVariables() = default;
  explicit InstrumentalVariables(const InstrumentalVariablesOptions& options) : options_(options) {}

  /// What one half of all samples says. Instruments of half A meet the residuals and the slopes of
  /// half B: they share no sample with these, not by the filter either. Otherwise noise that they have
  /// in common would pass the filter, and derivatives would seem larger than they are.
  struct Half {
    Jacobian filtered;  ///< the slopes clipped and filtered
    Jacobian slopes;    ///< means
    Jacobian noise;     ///< another draw of the noise of `slopes`
    void members(SavedState& state) { state(filtered, slopes, noise); }
  };
  struct Set {
    Half a, b;
    void members(SavedState& state) { state(a, b); }
  };
  /// Adds the halves of an iteration; of those before, the share `keep` stays. Columns that these do not
  /// have stay as they are. `weight`: samples of these halves in units of those of a usual iteration.
  void add(const Halves& halves, double keep, double weight = 1);
  /// Pictures alone, as the features of regressions.
  void add_picture(const Halves& halves, double weight);
  bool empty() const { return adds_.empty(); }
  /// Unless empty. `importance` of the rows, as in the sums that they will be part of.
  /// `threads`: 0 = one per core. Throws Cancelled, asked at every column.
  Set all(const SlotLayout& layout, const Photo& photo, const Eigen::VectorXf& importance,
          const Progress* progress = nullptr, Denoising denoising = Denoising::kFilter,
          int threads = 1) const;
  /// The same with the means themselves as instruments: of so many samples that no filter is needed.
  Set plain() const;
  void members(SavedState& state);

 private:
  /// Each half is in two parts: what they have in common is signal, the rest is noise.
  struct Part {
    ColumnSums a, b;
    ColumnSums direct_a, direct_b;  ///< their direct shares, where they are known
    Eigen::VectorXd weight;         ///< of the columns
    void members(SavedState& state);
  };
  /// Of a column: what came along more than one surface, or all where nothing is known apart; the rest.
  enum class Share { kIndirect, kDirect };
  /// A share of column k of a half, summed over a part.
  Eigen::VectorXf sum(const Part& part, ColumnSums Part::*which, Eigen::Index k, Share share) const;
  bool has_direct(Eigen::Index k) const;
  /// Puts `indirect`, what is known of a half's column without its direct share, in the place of as much of that
  /// share's mean as is noise.
  void clear(ColumnSums Part::*which, const Eigen::VectorXf& importance,
             const Eigen::VectorXf& indirect, Half& half, Eigen::Index k) const;
  /// The share of a filtered column's power that the other half confirms. What is left is noise.
  float confirmed(const Eigen::VectorXf& filtered, ColumnSums Part::*other,
                  const Eigen::VectorXf& importance, Eigen::Index k) const;
  Half means(ColumnSums Part::*which) const;
  /// Variance of the mean of column k over that of the difference of the parts.
  double share(Eigen::Index k) const;
  /// A share of column k of a half, clipped and filtered.
  Eigen::VectorXf filtered(const SlotLayout& layout, const Photo& photo, ColumnSums Part::*which,
                           const Eigen::VectorXf& importance, Eigen::Index k, Share of) const;
  /// Blends the filtered columns of a half with their regressions, which count as much as they are noisy.
  void regress(const SlotLayout& layout, const Photo& photo, ColumnSums Part::*which,
               const Eigen::VectorXf& importance, Half& half) const;

  InstrumentalVariablesOptions options_;
  Eigen::Index rows_ = 0;
  std::array<Part, 2> parts_;
  std::vector<int> adds_;  ///< to the columns
  /// Render minus photo: sums of the halves, and their weight. Features of half A share no sample with
  /// half B, as its instruments.
  Eigen::VectorXf picture_a_, picture_b_;
  double picture_weight_ = 0;
};

}  // namespace selenite
