// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/evaluate/validation.h"

#include <algorithm>
#include <cmath>

#include "fit/evaluate/residual_rms.h"
#include "fit/evaluate/seeds.h"
#include "fit/evaluate/tiled_loss.h"
#include "fit/objective/closed_form_gain.h"
#include "fit/objective/photo_weights.h"
#include "fit/problem/saved_state.h"
#include "math/scalar.h"

namespace selenite {
namespace {

/// What the prior of a free gain adds to the loss of photo i.
double prior_cost(const Problem& problem, std::size_t i, const Colorf& gain) {
  const Photo& photo = problem.photos[i];
  if (photo.gain_freedom == GainFreedom::kNone || !problem.weights) return 0;
  double squares = 0;
  for (int c = 0; c < (photo.gain_freedom == GainFreedom::kScalar ? 1 : 3); ++c)
    squares += square(std::log(static_cast<double>(gain[c])));
  return problem.weights->scale() * gain_prior(problem, photo) * squares;
}

}  // namespace

Validation validate(const FitProblem& problem, PhotoEvaluator& evaluator, const Point& point,
                    int spp, Previews& previews) {
  const std::vector<Photo>& photos = problem.photos();
  auto films = std::make_shared<std::vector<Film>>();
  std::vector<Alignment> alignments;
  const auto how = [&](std::size_t i) {
    return Evaluation{
        .spp = spp,
        .seed = stream_seed(problem.settings().seed, Stream::kValidation, 0, static_cast<int>(i)),
        .halves = false};
  };
  Ahead ahead;
  for (std::size_t i = 0; i < photos.size(); ++i) {
    ahead.reach(evaluator, i, photos.size(),
                [&](std::size_t k) { evaluator.expect(point, photos[k], how(k)); });
    alignments.push_back(evaluator.alignment(photos[i]));
    films->push_back(evaluator.evaluate(point, photos[i], how(i)));
    films->back().half_a.clear();  // no loss asks for it
    previews[i] = std::make_shared<const Picture>(films->back().mean);
  }
  std::vector<Colorf> gains;
  for (const Photo& photo : photos) gains.push_back(evaluator.found_gain(photo));
  Validation found = judge(problem, std::move(films), std::move(gains));
  found.alignments = std::move(alignments);
  return found;
}

Validation judge(const FitProblem& problem, std::shared_ptr<const std::vector<Film>> films,
                 std::vector<Colorf> gains) {
  const double share = 1.0 / static_cast<double>(films->size());
  Validation sum;
  for (std::size_t i = 0; i < films->size(); ++i) {
    const Film& film = (*films)[i];
    const LossResult loss = evaluate_loss(problem.scalars(), i, film);
    sum.loss += share * loss.value;
    sum.unbiased += share * loss.unbiased;
    sum.variance += share * share * loss.standard_error * loss.standard_error;
    sum.bias += mean_bias(film, problem.photos()[i]) * share;
    const double prior = share * prior_cost(problem.scalars(), i, gains[i]);
    sum.loss += prior;
    sum.unbiased += prior;
    const auto of_part = static_cast<float>(prior / static_cast<double>(loss.parts.size()));
    for (const float part : loss.parts)
      sum.parts.push_back(static_cast<float>(share) * part + of_part);
  }
  sum.films = std::move(films);
  sum.gains = std::move(gains);
  return sum;
}

std::vector<PhotoReport> report_photos(const FitProblem& problem, const Validation& validation) {
  std::vector<PhotoReport> reports(validation.films->size());
  for (std::size_t i = 0; i < reports.size(); ++i) {
    const Film& film = (*validation.films)[i];
    const Photo& photo = problem.photos()[i];
    reports[i].residual_rms = residual_rms(film, photo);
    reports[i].unexplained = unexplained_share(film, photo);
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
