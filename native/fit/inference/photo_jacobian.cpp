// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/inference/photo_jacobian.h"

#include <algorithm>

#include "fit/evaluate/finite_differences.h"
#include "fit/evaluate/seeds.h"
#include "math/error.h"

namespace selenite {
namespace {

Photo black_photo(const std::string& camera, const RenderSettings& settings) {
  Photo black;
  black.camera = camera;
  black.width = settings.width;
  black.height = settings.height;
  black.reference.resize(static_cast<std::size_t>(settings.width) * settings.height);
  return black;
}

void note_not_finite(const Unknowns& unknowns, const Halves& halves,
                     std::vector<std::string>& names) {
  for (Eigen::Index k = 0; k < halves.jacobian_a.cols(); ++k) {
    const std::string& name = unknowns.components()[static_cast<std::size_t>(k)].name;
    const bool finite =
        halves.jacobian_a.col(k).allFinite() && halves.jacobian_b.col(k).allFinite();
    if (!finite && std::ranges::find(names, name) == names.end()) names.push_back(name);
  }
}

}  // namespace

int PhotoJacobian::spp() const {
  int sum = 0;
  for (const Portion& one : portions) sum += one.spp;
  return sum;
}

void PhotoJacobian::join(const PhotoJacobian& other) {
  if (other.width != width || other.height != height || other.layout.slots != layout.slots)
    throw InvalidArgument("Two photo Jacobians of other sizes or unknowns cannot be joined");
  const float share = static_cast<float>(other.spp()) / static_cast<float>(spp() + other.spp());
  for (std::size_t i = 0; i < mean.size(); ++i)
    mean[i] = mean[i] * (1 - share) + other.mean[i] * share;
  variance = (1 - share) * variance + share * other.variance;
  portions.insert(portions.end(), other.portions.begin(), other.portions.end());
  dropped += other.dropped;
  for (const std::string& name : other.not_finite)
    if (std::ranges::find(not_finite, name) == not_finite.end()) not_finite.push_back(name);
}

PhotoJacobian photo_jacobian(const Scene& scene, const Unknowns& unknowns,
                             const std::string& camera, const RenderSettings& settings,
                             Progress* progress) {
  if (settings.spp < kLeastJacobianSpp)
    throw InvalidArgument(
        "Derivatives of " + std::to_string(settings.spp) + " samples a pixel do not suffice for " +
        std::to_string(kJacobianPortions) + " portions of two halves; give spp of at least " +
        std::to_string(kLeastJacobianSpp));
  const std::vector<Photo> photos{black_photo(camera, settings)};
  PhotoJacobian seen;
  seen.width = settings.width;
  seen.height = settings.height;
  seen.layout = SlotLayout(scene, unknowns.parameters());
  seen.mean.resize(photos[0].size());
  seen.variance = Eigen::VectorXf::Zero(static_cast<Eigen::Index>(3 * photos[0].size()));
  const Reparametrization reparametrization(unknowns);
  const Problem problem{unknowns, seen.layout, photos, losses()[0], 1};
  const Vector& x = unknowns.start();
  const Scene here = unknowns.scene_with(scene, x);
  for (int portion = 0; portion < kJacobianPortions; ++portion) {
    RenderSettings part = settings;
    part.spp = settings.spp / kJacobianPortions;
    if (portion < settings.spp % kJacobianPortions) ++part.spp;
    part.seed = seed_of(mix64(settings.seed), portion, 0);  // seeds 2 and 3 share no portion
    Observation one{
        0,
        render_derivatives(problem, &reparametrization, here, x, Purpose::kInstrumental,
                           {.side = alternating_side(portion), .of_roughness = Side::kBoth},
                           [&](const Vector& at, const SlotLayout& slots, Paths) {
                             const Scene there = unknowns.scene_with(scene, at);
                             return render(there, there.camera(camera), slots, part, progress);
                           }),
        {}};
    Halves halves = split_halves(problem, one, reparametrization.slope(x));
    note_not_finite(unknowns, halves, seen.not_finite);
    const float share = static_cast<float>(part.spp) / static_cast<float>(settings.spp);
    for (std::size_t i = 0; i < seen.mean.size(); ++i) seen.mean[i] += one.film.mean[i] * share;
    const Eigen::Map<const Eigen::VectorXf> variance(&one.film.variance.front().r,
                                                     seen.variance.size());
    seen.variance += variance.cwiseMax(0.f) * (share * static_cast<float>(part.spp));
    seen.dropped += one.film.dropped;
    seen.portions.push_back({std::move(halves), part.spp});
  }
  return seen;
}

}  // namespace selenite
