// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/alternative_minima.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "fit/evaluate/seeds.h"

namespace selenite {
namespace {

/// Shares of the samples, a round each.
constexpr std::array kShares{16, 4, 1};
constexpr int kLeastOfRound = 16;  ///< samples, where there are as many
/// Standard deviations by which a rival must be worse to lose.
constexpr double kSigmas = 3;
/// Widths of its interval, and share of its range, that a value of a rival lies off at least: what is
/// nearer is the same basin, seen less sharply.
constexpr double kWidths = 2, kShareOfRange = 0.1;
constexpr std::size_t kParts = std::tuple_size_v<Parts>;

/// Whether component k of `x` is that of another basin.
bool far_apart(const Coordinates& coordinates, const Vector& x, const Vector& answer,
               Eigen::Index k) {
  const double range = coordinates.maximum()[k] - coordinates.minimum()[k];
  const double way = coordinates.from_values(x)[k] - coordinates.from_values(answer)[k];
  return std::abs(way) > kShareOfRange * range;
}

/// Whether what is told about a component leaves `x` out by so many widths.
bool leaves_out(const Confidence& told, double x, double widths) {
  const auto [low, high] = told.interval;
  const double margin = widths * (high - low);
  return told.determined && (x < low - margin || x > high + margin);
}

}  // namespace

Rivals::Rivals(const Problem& problem, std::vector<Eigen::VectorXf> weights, Vector answer,
               std::vector<Vector> rivals, std::uint64_t seed, int spp)
    : problem_(&problem),
      coordinates_(problem.unknowns),
      weights_(std::move(weights)),
      seed_(seed),
      most_spp_(spp) {
  rivals.insert(rivals.begin(), std::move(answer));
  for (Vector& x : rivals) candidates_.emplace_back().x = std::move(x);
}

/// Of a part.
int Rivals::spp() const {
  const int share = kShares[static_cast<std::size_t>(round_)];
  const int all = std::max(most_spp_ / share, std::min(kLeastOfRound, most_spp_));
  return std::max(all / static_cast<int>(kParts), 2);
}

bool Rivals::step(const RenderAt& render) {
  if (candidates_.size() < 2 || round_ == static_cast<int>(kShares.size())) return false;
  const Capture& photo = problem_->captures[capture_];
  Candidate& candidate = candidates_[candidate_];
  const int purpose = static_cast<int>(kParts) * round_ + static_cast<int>(part_);
  candidate.seen[part_] = render(candidate.x, photo, spp(),
                                 seed_of(seed_, purpose, static_cast<int>(capture_)), std::nullopt);
  if (++part_ < kParts) return true;
  part_ = 0;
  if (++candidate_ < candidates_.size()) return true;
  candidate_ = 0;
  end_photo();
  if (++capture_ < problem_->captures.size()) return true;
  capture_ = 0;
  end_round();
  return candidates_.size() > 1 && round_ < static_cast<int>(kShares.size());
}

void Rivals::end_photo() {
  const Capture& photo = problem_->captures[capture_];
  const Eigen::VectorXf& weights = weights_[capture_];
  const auto& answer = candidates_.front().seen;
  for (std::size_t i = 1; i < candidates_.size(); ++i)
    candidates_[i].behind.add(photo, weights, answer, candidates_[i].seen);
  for (Candidate& candidate : candidates_) {
    candidate.likeness.append(Likeness(whole(candidate.seen), photo, weights), 1);
    candidate.seen = {};
  }
}

/// Drops those that have lost.
void Rivals::end_round() {
  const Likeness& answer = candidates_.front().likeness;
  const auto worse = [](const Eigen::ArrayXd& rival, const Eigen::ArrayXd& answer) {
    const Total by(rival - answer);
    return by.sum > kSigmas * by.deviation;
  };
  const auto lost = [&](const Candidate& rival) {
    return rival.behind.certain(kSigmas) || worse(rival.likeness.coarse, answer.coarse) ||
           worse(rival.likeness.all, answer.all);
  };
  candidates_.erase(std::remove_if(candidates_.begin() + 1, candidates_.end(), lost),
                    candidates_.end());
  if (++round_ == static_cast<int>(kShares.size())) return;  // `standing` tells by the last one
  for (Candidate& candidate : candidates_) {
    candidate.likeness = {};
    candidate.behind = {};
  }
}

bool Rivals::Standing::won() const { return ahead > kSigmas; }

std::vector<Rivals::Standing> Rivals::standing() const {
  std::vector<Standing> standing;
  const Vector& answer = candidates_.front().x;
  for (auto rival = candidates_.begin() + 1; rival != candidates_.end(); ++rival) {
    bool far = false;
    for (Eigen::Index k = 0; k < answer.size(); ++k)
      far = far || far_apart(coordinates_, rival->x, answer, k);
    if (far) standing.push_back({rival->x, rival->behind.ahead()});
  }
  std::stable_sort(standing.begin(), standing.end(),
                   [](const Standing& a, const Standing& b) { return a.ahead > b.ahead; });
  return standing;
}

std::vector<Rivals::Standing> Rivals::serious(const TrustReport& report) const {
  std::vector<Standing> found = standing();
  std::erase_if(found, [&](const Standing& one) {
    TrustReport judged = report;
    contest(judged, coordinates_, candidates_.front().x, one.x, false);
    return !one.won() && judged.rivals.size() == report.rivals.size();
  });
  return found;
}

double Rivals::fraction() const {
  const double rounds = static_cast<double>(kShares.size());
  if (candidates_.size() < 2 || round_ == static_cast<int>(kShares.size())) return 1;
  const auto of_photo = static_cast<double>(kParts * candidates_.size());
  const double done = (static_cast<double>(capture_) +
                       static_cast<double>(kParts * candidate_ + part_) / of_photo) /
                      static_cast<double>(problem_->captures.size());
  return (round_ + done) / rounds;
}

void contest(TrustReport& report, const Coordinates& coordinates, const Vector& answer,
             const Vector& rival, bool refined) {
  bool any = false;
  for (std::size_t k = 0; k < report.components.size(); ++k) {
    Confidence& told = report.components[k];
    const auto at = static_cast<Eigen::Index>(k);
    if (!far_apart(coordinates, rival, answer, at) ||
        !leaves_out(told, rival[at], refined ? 0 : kWidths))
      continue;
    any = true;
    told.determined = false;
    report.contested.push_back(static_cast<int>(k));
  }
  if (any) report.rivals.push_back(rival);
}

}  // namespace selenite
