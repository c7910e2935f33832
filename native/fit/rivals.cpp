// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/rivals.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "fit/streams.h"

namespace selenite {
namespace {

/// Shares of the samples, a round each.
constexpr std::array kShares{4, 1};
/// Standard deviations of the difference of losses by which a rival must lose.
constexpr double kSigmas = 3;
/// Widths of its interval, and share of its range, that a value of a rival lies off at least: what is
/// nearer is the same basin, seen less sharply.
constexpr double kWidths = 2, kShareOfRange = 0.1;

}  // namespace

Rivals::Rivals(const Problem& problem, Vector answer, std::vector<Vector> rivals,
               std::uint64_t seed, int spp)
    : problem_(&problem), seed_(seed), most_spp_(spp) {
  candidates_.push_back({std::move(answer), {}});
  for (Vector& x : rivals) candidates_.push_back({std::move(x), {}});
}

int Rivals::spp() const {
  return std::max(most_spp_ / kShares[static_cast<std::size_t>(round_)], 2);
}

bool Rivals::step(const RenderAt& render) {
  if (candidates_.size() < 2 || round_ == static_cast<int>(kShares.size())) return false;
  const std::vector<Capture>& captures = problem_->captures;
  const Capture& photo = captures[capture_];
  Candidate& candidate = candidates_[candidate_];
  const Film film = render(candidate.x, photo, spp(),
                           seed_of(seed_, round_, static_cast<int>(capture_)), std::nullopt);
  const std::vector<float> parts = problem_->loss.evaluate(film, photo).parts;
  candidate.parts.insert(candidate.parts.end(), parts.begin(), parts.end());
  if (++capture_ < captures.size()) return true;
  capture_ = 0;
  if (++candidate_ < candidates_.size()) return true;
  candidate_ = 0;
  end_round();
  return candidates_.size() > 1 && round_ < static_cast<int>(kShares.size());
}

/// Drops those that have lost.
void Rivals::end_round() {
  const std::vector<float>& answer = candidates_.front().parts;
  const auto lost = [&](const Candidate& rival) {
    double sum = 0, squares = 0;
    for (std::size_t i = 0; i < answer.size(); ++i) {
      const double difference = static_cast<double>(rival.parts[i]) - answer[i];
      sum += difference;
      squares += difference * difference;
    }
    const double variance = squares - sum * sum / static_cast<double>(answer.size());
    return sum > kSigmas * std::sqrt(std::max(variance, 0.0));
  };
  candidates_.erase(std::remove_if(candidates_.begin() + 1, candidates_.end(), lost),
                    candidates_.end());
  for (Candidate& candidate : candidates_) candidate.parts.clear();
  ++round_;
}

double Rivals::fraction() const {
  const double rounds = static_cast<double>(kShares.size());
  if (candidates_.size() < 2 || round_ == static_cast<int>(kShares.size())) return 1;
  const double pictures = static_cast<double>(candidates_.size() * problem_->captures.size());
  const double done =
      static_cast<double>(candidate_ * problem_->captures.size() + capture_) / pictures;
  return (round_ + done) / rounds;
}

bool Rivals::far_apart(const Vector& x, std::size_t component, const Confidence& told) const {
  const auto k = static_cast<Eigen::Index>(component);
  const Coordinates coordinates(problem_->unknowns);
  const double range = coordinates.maximum()[k] - coordinates.minimum()[k];
  const double way =
      coordinates.from_values(x)[k] - coordinates.from_values(candidates_.front().x)[k];
  if (std::abs(way) <= kShareOfRange * range) return false;
  const auto [low, high] = told.interval;
  const double width = high - low;
  return x[k] < low - kWidths * width || x[k] > high + kWidths * width;
}

void Rivals::judge(TrustReport& report) const {
  for (std::size_t i = 1; i < candidates_.size(); ++i) {
    const Vector& x = candidates_[i].x;
    std::vector<std::size_t> apart;
    for (std::size_t k = 0; k < report.components.size(); ++k)
      if (report.components[k].determined && far_apart(x, k, report.components[k]))
        apart.push_back(k);
    if (apart.empty()) continue;
    report.rivals.push_back(x);
    for (const std::size_t k : apart) report.contested.push_back(static_cast<int>(k));
  }
  for (const int k : report.contested)
    report.components[static_cast<std::size_t>(k)].determined = false;
}

}  // namespace selenite
