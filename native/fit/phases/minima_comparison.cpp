// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/minima_comparison.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fit/evaluate/seeds.h"

namespace selenite {
namespace {

constexpr std::size_t kParts = std::tuple_size_v<FilmPair>;

/// Whether component k of `x` is that of another basin.
bool far_apart(const Reparametrization& reparametrization, const Vector& x, const Vector& answer,
               Eigen::Index k) {
  const double range = reparametrization.maximum()[k] - reparametrization.minimum()[k];
  const double way = reparametrization.from_values(x)[k] - reparametrization.from_values(answer)[k];
  return std::abs(way) > kAlternativeMinima.share_of_range * range;
}

/// Whether the interval of a component excludes `x` by so many widths.
bool excludes_by(const Confidence& reported, double x, double widths) {
  const auto [low, high] = reported.interval;
  const double margin = widths * (high - low);
  return reported.determined && (x < low - margin || x > high + margin);
}

}  // namespace

MinimaComparison::MinimaComparison(const Problem& problem, std::vector<Eigen::VectorXf> weights,
                                   Point answer, std::vector<Vector> alternatives,
                                   std::uint64_t seed, int spp)
    : problem_(&problem),
      reparametrization_(problem.unknowns),
      fields_(std::move(answer.fields)),
      weights_(std::move(weights)),
      seed_(seed),
      most_spp_(spp) {
  alternatives.insert(alternatives.begin(), std::move(answer.scalars));
  for (Vector& x : alternatives) candidates_.emplace_back().x = std::move(x);
}

/// Of a part.
int MinimaComparison::spp() const {
  const int share = kAlternativeMinima.shares[static_cast<std::size_t>(round_)];
  const int all =
      std::max(most_spp_ / share, std::min(kAlternativeMinima.least_of_round, most_spp_));
  return std::max(all / static_cast<int>(kParts), 2);
}

bool MinimaComparison::step(Evaluator& evaluator) {
  if (candidates_.size() < 2 || round_ == static_cast<int>(kAlternativeMinima.shares.size()))
    return false;
  const auto how = [&](std::size_t photo, std::size_t part) {
    const int purpose = static_cast<int>(kParts) * round_ + static_cast<int>(part);
    return Evaluation{spp(), seed_of(seed_, purpose, static_cast<int>(photo))};
  };
  const std::size_t of_photo = candidates_.size() * kParts;
  ahead_.reach(evaluator, photo_ * of_photo + candidate_ * kParts + part_,
               problem_->photos.size() * of_photo, [&](std::size_t k) {
                 const std::size_t photo = k / of_photo;
                 evaluator.expect({candidates_[k % of_photo / kParts].x, fields_},
                                  problem_->photos[photo], how(photo, k % kParts));
               });
  Candidate& candidate = candidates_[candidate_];
  candidate.seen[part_] =
      evaluator.evaluate({candidate.x, fields_}, problem_->photos[photo_], how(photo_, part_));
  if (++part_ < kParts) return true;
  part_ = 0;
  if (++candidate_ < candidates_.size()) return true;
  candidate_ = 0;
  end_photo();
  if (++photo_ < problem_->photos.size()) return true;
  photo_ = 0;
  ahead_ = {};
  end_round();
  return candidates_.size() > 1 && round_ < static_cast<int>(kAlternativeMinima.shares.size());
}

void MinimaComparison::end_photo() {
  const Photo& photo = problem_->photos[photo_];
  const Eigen::VectorXf& weights = weights_[photo_];
  const auto& answer = candidates_.front().seen;
  for (std::size_t i = 1; i < candidates_.size(); ++i)
    candidates_[i].against_answer.add(photo, weights, answer, candidates_[i].seen);
  for (Candidate& candidate : candidates_) {
    candidate.tiled_loss.append(TiledLoss(merged(candidate.seen), photo, weights), 1);
    candidate.seen = {};
  }
}

/// Drops those that have lost.
void MinimaComparison::end_round() {
  const TiledLoss& answer = candidates_.front().tiled_loss;
  const auto worse = [](const Eigen::ArrayXd& alternative, const Eigen::ArrayXd& answer) {
    const NoisySum by(alternative - answer);
    return by.sum > kAlternativeMinima.sigmas * by.deviation;
  };
  const auto lost = [&](const Candidate& alternative) {
    return alternative.against_answer.significant(kAlternativeMinima.sigmas) ||
           worse(alternative.tiled_loss.coarse, answer.coarse) ||
           worse(alternative.tiled_loss.all, answer.all);
  };
  candidates_.erase(std::remove_if(candidates_.begin() + 1, candidates_.end(), lost),
                    candidates_.end());
  if (++round_ == static_cast<int>(kAlternativeMinima.shares.size()))
    return;  // `survivors` decides by the last one
  for (Candidate& candidate : candidates_) {
    candidate.tiled_loss = {};
    candidate.against_answer = {};
  }
}

bool MinimaComparison::Survivor::is_better() const { return z_score > kAlternativeMinima.sigmas; }

std::vector<MinimaComparison::Survivor> MinimaComparison::survivors() const {
  std::vector<Survivor> survivors;
  const Vector& answer = candidates_.front().x;
  for (auto alternative = candidates_.begin() + 1; alternative != candidates_.end();
       ++alternative) {
    bool far = false;
    for (Eigen::Index k = 0; k < answer.size(); ++k)
      far = far || far_apart(reparametrization_, alternative->x, answer, k);
    survivors.push_back({alternative->x, alternative->against_answer.z_score(), far});
  }
  std::stable_sort(survivors.begin(), survivors.end(),
                   [](const Survivor& a, const Survivor& b) { return a.z_score > b.z_score; });
  return survivors;
}

std::vector<MinimaComparison::Survivor> MinimaComparison::pending(const TrustReport& report) const {
  std::vector<Survivor> found = survivors();
  std::erase_if(found, [&](const Survivor& one) {
    if (!one.far) return true;
    TrustReport judged = report;
    mark_ambiguous(judged, reparametrization_, candidates_.front().x, one.x, false);
    return !one.is_better() && judged.alternatives.size() == report.alternatives.size();
  });
  return found;
}

void MinimaComparison::members(SavedState& state) {
  state(fields_, weights_, candidates_, seed_, most_spp_, round_, photo_, candidate_, part_);
}

double MinimaComparison::fraction() const {
  const double rounds = static_cast<double>(kAlternativeMinima.shares.size());
  if (candidates_.size() < 2 || round_ == static_cast<int>(kAlternativeMinima.shares.size()))
    return 1;
  const auto of_photo = static_cast<double>(kParts * candidates_.size());
  const double done =
      (static_cast<double>(photo_) + static_cast<double>(kParts * candidate_ + part_) / of_photo) /
      static_cast<double>(problem_->photos.size());
  return (round_ + done) / rounds;
}

void mark_ambiguous(TrustReport& report, const Reparametrization& reparametrization,
                    const Vector& answer, const Vector& alternative, bool refined) {
  bool any = false;
  for (std::size_t k = 0; k < report.components.size(); ++k) {
    Confidence& reported = report.components[k];
    const auto at = static_cast<Eigen::Index>(k);
    if (!far_apart(reparametrization, alternative, answer, at) ||
        !excludes_by(reported, alternative[at], refined ? 0 : kAlternativeMinima.widths))
      continue;
    any = true;
    reported.determined = false;
    report.ambiguous.push_back(static_cast<int>(k));
  }
  if (any) report.alternatives.push_back(alternative);
}

}  // namespace selenite
