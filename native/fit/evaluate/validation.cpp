// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/evaluate/validation.h"

#include "fit/evaluate/seeds.h"
#include "fit/evaluate/tiled_loss.h"

namespace selenite {

Validation validate(const FitProblem& problem, PhotoEvaluator& evaluator, const Point& point,
                    int spp, Previews& previews) {
  const std::vector<Photo>& photos = problem.photos();
  const double share = 1.0 / static_cast<double>(photos.size());
  Validation sum;
  for (std::size_t i = 0; i < photos.size(); ++i) {
    const std::uint64_t seed =
        stream_seed(problem.settings().seed, Stream::kValidation, 0, static_cast<int>(i));
    const Film film = evaluator.evaluate(point, photos[i], {spp, seed});
    const LossResult loss = problem.loss().evaluate(film, photos[i]);
    sum.loss += share * loss.value;
    sum.unbiased += share * loss.unbiased;
    sum.variance += share * share * loss.standard_error * loss.standard_error;
    sum.bias += mean_bias(film, photos[i]) * share;
    for (const float part : loss.parts) sum.parts.push_back(static_cast<float>(share) * part);
    previews[i] = std::make_shared<const Picture>(film.mean);
  }
  return sum;
}

bool is_worse(const Validation& one, const Validation& than, double sigmas) {
  if (than.parts.empty()) return false;
  const auto terms = [](const std::vector<float>& parts) {
    const auto count = static_cast<Eigen::Index>(parts.size());
    return Eigen::Map<const Eigen::ArrayXf>(parts.data(), count).cast<double>();
  };
  const NoisySum by(terms(one.parts) - terms(than.parts));
  return by.sum > sigmas * by.deviation;
}

}  // namespace selenite
