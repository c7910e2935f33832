// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/evaluate/validation.h"

#include <algorithm>
#include <cmath>

#include "fit/evaluate/seeds.h"
#include "fit/evaluate/tiled_loss.h"
#include "fit/objective/closed_form_gain.h"
#include "fit/objective/photo_weights.h"
#include "fit/problem/saved_state.h"
#include "math/scalar.h"

namespace selenite {

Validation validate(const FitProblem& problem, PhotoEvaluator& evaluator, const Point& point,
                    int spp, Previews& previews) {
  const std::vector<Photo>& photos = problem.photos();
  auto films = std::make_shared<std::vector<Film>>();
  std::vector<Alignment> alignments;
  for (std::size_t i = 0; i < photos.size(); ++i) {
    alignments.push_back(evaluator.alignment(photos[i]));
    const std::uint64_t seed =
        stream_seed(problem.settings().seed, Stream::kValidation, 0, static_cast<int>(i));
    films->push_back(evaluator.evaluate(point, photos[i], {spp, seed}));
    films->back().half_a.clear();  // no loss asks for it
    previews[i] = std::make_shared<const Picture>(films->back().mean);
  }
  Validation found = judge(problem, std::move(films));
  for (const Photo& photo : photos) found.gains.push_back(evaluator.found_gain(photo));
  found.alignments = std::move(alignments);
  return found;
}

Validation judge(const FitProblem& problem, std::shared_ptr<const std::vector<Film>> films) {
  const double share = 1.0 / static_cast<double>(films->size());
  Validation sum;
  for (std::size_t i = 0; i < films->size(); ++i) {
    const Film& film = (*films)[i];
    const LossResult loss = evaluate_loss(problem.scalars(), i, film);
    sum.loss += share * loss.value;
    sum.unbiased += share * loss.unbiased;
    sum.variance += share * share * loss.standard_error * loss.standard_error;
    sum.bias += mean_bias(film, problem.photos()[i]) * share;
    for (const float part : loss.parts) sum.parts.push_back(static_cast<float>(share) * part);
  }
  sum.films = std::move(films);
  return sum;
}

std::vector<PhotoReport> report_photos(const FitProblem& problem, const Validation& validation) {
  std::vector<PhotoReport> reports(validation.films->size());
  for (std::size_t i = 0; i < reports.size(); ++i) {
    const Film& film = (*validation.films)[i];
    const Photo& photo = problem.photos()[i];
    double squares = 0;
    for (std::size_t k = 0; k < film.size(); ++k)
      for (int c = 0; c < 3; ++c)
        squares += photo.share(k) * (square(static_cast<double>(film.mean[k][c]) -
                                            static_cast<double>(photo.reference[k][c])) -
                                     std::max(film.variance[k][c], 0.f));
    reports[i].residual_rms = std::sqrt(std::max(squares, 0.0));
    if (i < validation.alignments.size()) reports[i].alignment = validation.alignments[i];
    if (photo.gain_freedom == GainFreedom::kNone) continue;
    reports[i].gain = validation.gains[i];
    reports[i].gain_error =
        gain_error(film, validation.gains[i], photo, gain_weights(problem.scalars(), photo));
  }
  return reports;
}

void Validation::members(SavedState& state) {
  std::vector<Film> pictures;
  if (!state.reading()) pictures = *films;
  state(loss, unbiased, variance, parts, bias, gains, alignments, pictures);
  if (state.reading()) films = std::make_shared<const std::vector<Film>>(std::move(pictures));
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
