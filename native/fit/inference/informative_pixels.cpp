// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/inference/informative_pixels.h"

#include <algorithm>
#include <functional>
#include <iterator>
#include <memory>

namespace selenite {
namespace {

/// One of so many pixels that tell something is chosen. On the thesis' dragon a third of what photos
/// know of the IOR lies there, and little more in twice as many.
constexpr std::ptrdiff_t kOneOf = 48;
/// The equations of pixels in focus have a twentieth of the noise of others. Less than half of what that
/// would be worth: what the model is wrong about lies there, too.
constexpr float kWeight = 8;

}  // namespace

void Focus::scout(const Observation& derivatives, const Vector& slope, double weight) {
  scouted_[static_cast<std::size_t>(derivatives.capture)].add(
      split_halves(*problem_, derivatives, slope), 1, weight);
}

/// By what numbers of photos add to the diagonal of J^T w J, as the two halves of what was scouted say:
/// single strong paths, which rule the mean's square, show in one of them alone.
void Focus::choose(const GaussNewton& evidence, const std::vector<bool>& counts) {
  photos_.clear();
  std::vector<Eigen::MatrixXf> told;  // columns are unknowns
  Eigen::RowVectorXd total = Eigen::RowVectorXd::Zero(std::ssize(counts));
  for (std::size_t i = 0; i < scouted_.size(); ++i) {
    const JacobianSums::Set sums = scouted_[i].plain();
    told.push_back(evidence.weight(i).asDiagonal() * sums.a.slopes.cwiseProduct(sums.b.slopes));
    total += told.back().cast<double>().colwise().sum();
  }
  Eigen::VectorXf shares = Eigen::VectorXf::Zero(total.size());
  for (Eigen::Index k = 0; k < total.size(); ++k)
    if (counts[static_cast<std::size_t>(k)] && total[k] > 0)
      shares[k] = static_cast<float>(1 / total[k]);
  std::vector<float> all, positive;
  for (const Eigen::MatrixXf& one : told) {
    const Eigen::VectorXf numbers = one * shares;
    for (Eigen::Index i = 0; i < numbers.size(); i += 3) all.push_back(numbers.segment<3>(i).sum());
  }
  std::ranges::copy_if(all, std::back_inserter(positive), [](float one) { return one > 0; });
  const std::ptrdiff_t chosen = std::ssize(positive) / kOneOf;
  if (chosen == 0) return;
  std::nth_element(positive.begin(), positive.begin() + chosen, positive.end(), std::greater<>());
  const float least = positive[static_cast<std::size_t>(chosen)];
  for (auto next = all.cbegin(); const Capture& capture : problem_->captures) {
    auto pixels = std::make_shared<PixelMask>();
    for (std::size_t p = 0; p < capture.size(); ++p) pixels->push_back(*next++ > least);
    photos_.push_back({capture, {}});
    photos_.back().capture.pixels = std::move(pixels);
  }
}

void Focus::gather(const Observation& derivatives, const Vector& slope) {
  Photo& photo = photos_[static_cast<std::size_t>(derivatives.capture)];
  const Halves halves = split_halves(*problem_, derivatives, slope);
  photo.jacobians.add(halves, 1);
  if (photo.gathered++ == 0) photo.variance = Eigen::VectorXf::Zero(halves.variance.size());
  photo.variance += halves.variance * (static_cast<float>(derivatives.film.spp) / 2);
}

/// The weights know the noise pixel by pixel from the derivatives' samples: where few have seen it, they
/// are those of the whole photo.
GaussNewton::Seen Focus::seen(std::size_t i, const Film& residual,
                              const GaussNewton& evidence) const {
  const Photo& photo = photos_[i];
  const Eigen::VectorXf variance = photo.variance / static_cast<float>(photo.gathered);
  return {residual_halves(residual, photo.capture), photo.jacobians.plain(),
          evidence.weight_by(i, variance).cwiseMin(evidence.weight(i))};
}

void Focus::weigh(std::vector<GaussNewton::Equations>& all) {
  const Eigen::Index unknowns = all.front().focus->z.a.slopes.cols();
  Eigen::VectorXf common = Eigen::VectorXf::Zero(unknowns), each = common;
  for (const GaussNewton::Equations& one : all) {
    const auto& [a, b] = one.focus->z;
    const auto weight = one.focus->weight.asDiagonal();
    common += (weight * a.slopes.cwiseProduct(b.slopes)).colwise().sum();
    each += (weight * (a.slopes.cwiseAbs2() + b.slopes.cwiseAbs2())).colwise().sum() / 2;
  }
  const Eigen::VectorXf gain =
      kWeight * (each.array() > 0).select(common.cwiseQuotient(each), 0).cwiseMax(0);
  for (GaussNewton::Equations& one : all)
    for (JacobianSums::Half* half : {&one.focus->z.a, &one.focus->z.b})
      half->instruments *= gain.asDiagonal();
}

}  // namespace selenite
