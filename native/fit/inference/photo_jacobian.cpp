// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/inference/photo_jacobian.h"

#include <algorithm>

#include "fit/evaluate/photo_evaluator.h"
#include "fit/evaluate/seeds.h"
#include "math/fault.h"

namespace selenite {
namespace {

/// The photo at the size of the settings, without its pixels, by which a fit would find its gain and
/// alignment.
Photo blank_photo(Photo photo, const RenderSettings& settings) {
  if (photo.id.empty()) photo.id = photo.camera;
  photo.width = settings.width;
  photo.height = settings.height;
  photo.frame = settings.frame;
  photo.pixels = settings.pixels;
  photo.weight.clear();
  photo.gain_freedom = GainFreedom::kNone;
  photo.align = false;
  photo.reference.assign(static_cast<std::size_t>(settings.width) * settings.height, Colorf());
  return photo;
}

FitSettings evaluator_settings(const RenderSettings& settings) {
  FitSettings same;
  same.depth = settings.depth;
  same.threads = settings.threads;
  return same;
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
    throw Refused("", "Two photo Jacobians of other sizes or unknowns cannot be joined");
  const float share = static_cast<float>(other.spp()) / static_cast<float>(spp() + other.spp());
  for (std::size_t i = 0; i < mean.size(); ++i)
    mean[i] = mean[i] * (1 - share) + other.mean[i] * share;
  variance = (1 - share) * variance + share * other.variance;
  portions.insert(portions.end(), other.portions.begin(), other.portions.end());
  dropped += other.dropped;
  for (const std::string& name : other.not_finite)
    if (std::ranges::find(not_finite, name) == not_finite.end()) not_finite.push_back(name);
}

PhotoJacobian photo_jacobian(const Scene& scene, const Unknowns& unknowns, const Photo& photo,
                             const RenderSettings& settings, Progress* progress) {
  if (settings.spp < kLeastJacobianSpp)
    throw Refused("",
                  "Derivatives of " + std::to_string(settings.spp) +
                      " samples a pixel do not suffice for " + std::to_string(kJacobianPortions) +
                      " portions of two halves",
                  "give spp of at least " + std::to_string(kLeastJacobianSpp));
  const std::vector<Photo> photos{blank_photo(photo, settings)};
  PhotoJacobian seen;
  seen.width = settings.width;
  seen.height = settings.height;
  seen.layout = unknowns.layout(scene);
  seen.mean.resize(photos[0].size());
  seen.variance = Eigen::VectorXf::Zero(static_cast<Eigen::Index>(3 * photos[0].size()));
  const Reparametrization reparametrization(unknowns);
  const Problem problem{unknowns, seen.layout, photos, losses()[0], 1};
  const SceneModel model{problem, &reparametrization,
                         [&](const Point& at) { return unknowns.scene_with(scene, at.scalars); }};
  const FitSettings how = evaluator_settings(settings);
  RenderCounts counts;
  PhotoEvaluator evaluator(model, how, counts);
  evaluator.watch(progress);
  const Point start{unknowns.start()};
  for (int portion = 0; portion < kJacobianPortions; ++portion) {
    int spp = settings.spp / kJacobianPortions;
    if (portion < settings.spp % kJacobianPortions) ++spp;
    const std::uint64_t seed =
        seed_of(mix64(settings.seed), portion, 0);  // seeds 2 and 3 share no portion
    const Observation one{
        0,
        evaluator.evaluate(start, photos[0],
                           {spp, seed, differences_of_refinement(portion), Purpose::kInstrumental}),
        {}};
    Halves halves = split_halves(problem, one, reparametrization.slope(start.scalars));
    note_not_finite(unknowns, halves, seen.not_finite);
    const float share = static_cast<float>(spp) / static_cast<float>(settings.spp);
    for (std::size_t i = 0; i < seen.mean.size(); ++i) seen.mean[i] += one.film.mean[i] * share;
    const Eigen::Map<const Eigen::VectorXf> variance(&one.film.variance.front().r,
                                                     seen.variance.size());
    seen.variance += variance.cwiseMax(0.f) * (share * static_cast<float>(spp));
    seen.dropped += one.film.dropped;
    seen.portions.push_back({std::move(halves), spp});
  }
  return seen;
}

}  // namespace selenite
