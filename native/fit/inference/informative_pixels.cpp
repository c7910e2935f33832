// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/inference/informative_pixels.h"

#include <algorithm>
#include <functional>
#include <iterator>
#include <memory>

namespace selenite {

void InformativePixels::add_pilot(const Observation& derivatives, const Vector& slope,
                                  double weight) {
  pilot_[static_cast<std::size_t>(derivatives.photo)].add(
      split_halves(*problem_, derivatives, slope), 1, weight);
}

/// The score of a pixel is what it adds to the diagonal of J^T w J, one half of the pilot pass times the
/// other: single strong paths, which dominate the square of the mean, show in one of them alone.
void InformativePixels::choose(const GaussNewton& gauss_newton, const std::vector<bool>& counts) {
  selections_.clear();
  std::vector<Eigen::MatrixXf> scores;  // columns are unknowns
  Eigen::RowVectorXd total = Eigen::RowVectorXd::Zero(std::ssize(counts));
  for (std::size_t i = 0; i < pilot_.size(); ++i) {
    const InstrumentalVariables::Set sums = pilot_[i].plain();
    scores.push_back(gauss_newton.weights()[i].asDiagonal() *
                     sums.a.slopes.cwiseProduct(sums.b.slopes));
    total += scores.back().cast<double>().colwise().sum();
  }
  Eigen::VectorXf shares = Eigen::VectorXf::Zero(total.size());
  for (Eigen::Index k = 0; k < total.size(); ++k)
    if (counts[static_cast<std::size_t>(k)] && total[k] > 0)
      shares[k] = static_cast<float>(1 / total[k]);
  std::vector<float> all, positive;
  for (const Eigen::MatrixXf& one : scores) {
    const Eigen::VectorXf numbers = one * shares;
    for (Eigen::Index i = 0; i < numbers.size(); i += 3) all.push_back(numbers.segment<3>(i).sum());
  }
  std::ranges::copy_if(all, std::back_inserter(positive), [](float one) { return one > 0; });
  const std::ptrdiff_t chosen = std::ssize(positive) / options_.one_of;
  if (chosen == 0) return;
  std::nth_element(positive.begin(), positive.begin() + chosen, positive.end(), std::greater<>());
  const float least = positive[static_cast<std::size_t>(chosen)];
  for (auto next = all.cbegin(); const Photo& photo : problem_->photos) {
    auto pixels = std::make_shared<PixelMask>();
    for (std::size_t p = 0; p < photo.size(); ++p) pixels->push_back(*next++ > least);
    selections_.push_back({photo, {}});
    selections_.back().photo.pixels = std::move(pixels);
  }
}

void InformativePixels::gather(const Observation& derivatives, const Vector& slope) {
  Selection& selection = selections_[static_cast<std::size_t>(derivatives.photo)];
  const Halves halves = split_halves(*problem_, derivatives, slope, FilmExtent::kSomePixels);
  selection.jacobians.add(halves, 1);
  if (selection.gathered++ == 0) selection.variance = Eigen::VectorXf::Zero(halves.variance.size());
  selection.variance += halves.variance * (static_cast<float>(derivatives.film.spp) / 2);
}

/// The samples of the derivatives say how noisy each pixel is: where these are few, the weights are those
/// of the whole photo.
GaussNewton::WeightedResidual InformativePixels::seen(std::size_t i, const Film& residual,
                                                      const GaussNewton& gauss_newton) const {
  const Selection& selection = selections_[i];
  const PhotoWeights& weights = gauss_newton.weights();
  const Eigen::VectorXf variance = selection.variance / static_cast<float>(selection.gathered);
  return {residual_halves(residual, selection.photo), selection.jacobians.plain(),
          weights.by_variance(i, variance).cwiseMin(weights[i])};
}

void InformativePixels::members(SavedState& state) {
  state(pilot_);
  std::int64_t count = std::ssize(selections_);
  state(count);
  if (state.reading()) selections_.assign(static_cast<std::size_t>(count), Selection{});
  for (std::size_t i = 0; i < selections_.size(); ++i) {
    Selection& one = selections_[i];
    PixelMask pixels;
    if (!state.reading()) pixels = *one.photo.pixels;
    state(pixels, one.jacobians, one.variance, one.gathered);
    if (!state.reading()) continue;
    one.photo = problem_->photos[i];
    one.photo.pixels = std::make_shared<const PixelMask>(std::move(pixels));
  }
}

void InformativePixels::weigh(std::vector<GaussNewton::PhotoEquations>& all) const {
  const Eigen::Index unknowns = all.front().informative->z.a.slopes.cols();
  Eigen::VectorXf common = Eigen::VectorXf::Zero(unknowns), each = common;
  for (const GaussNewton::PhotoEquations& one : all) {
    const auto& [a, b] = one.informative->z;
    const auto weight = one.informative->weight.asDiagonal();
    common += (weight * a.slopes.cwiseProduct(b.slopes)).colwise().sum();
    each += (weight * (a.slopes.cwiseAbs2() + b.slopes.cwiseAbs2())).colwise().sum() / 2;
  }
  const Eigen::VectorXf gain =
      options_.weight * (each.array() > 0).select(common.cwiseQuotient(each), 0).cwiseMax(0);
  for (GaussNewton::PhotoEquations& one : all)
    for (InstrumentalVariables::Half* half : {&one.informative->z.a, &one.informative->z.b})
      half->filtered *= gain.asDiagonal();
}

}  // namespace selenite
