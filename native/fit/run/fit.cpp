// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/run/fit.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "fit/evaluate/field_loss.h"
#include "fit/evaluate/tiled_loss.h"
#include "fit/evaluate/seeds.h"
#include "math/error.h"

namespace selenite {
namespace {

constexpr double kNotDone = std::numeric_limits<double>::quiet_NaN();
/// More samples than this share left out: the derivatives describe another picture.
constexpr double kTooManyDropped = 1e-3;
constexpr double kReverted = 2;  ///< standard errors by which a turn may not end worse
/// The tolerance is compared with a mean over so many validations.
constexpr int kToleranceWindow = 3;

/// Runs all checks of a fit before the first of them ends it; returns the scene, for the
/// constructor.
Scene checked(Scene scene, std::vector<Photo>& photos,
              const std::vector<UnknownParameter>& unknowns, const FitSettings& settings) {
  std::string problems;
  bool only_names = true;
  const auto collect = [&](auto&& check) {
    try {
      check();
    } catch (const UnknownName& error) {
      problems += (problems.empty() ? "" : "\n") + std::string(error.what());
    } catch (const InvalidArgument& error) {
      problems += (problems.empty() ? "" : "\n") + std::string(error.what());
      only_names = false;
    }
  };
  collect([&] { check_photos(scene, photos); });
  collect([&] { (void)Unknowns(scene, unknowns); });
  collect([&] { (void)Fields(scene, unknowns); });
  collect([&] { settings.check(); });
  if (problems.empty()) return scene;
  if (only_names) throw UnknownName(problems);
  throw InvalidArgument(problems);
}

}  // namespace

const char* stop_text(StopReason reason) {
  switch (reason) {
    case StopReason::kIterations:
      return "all iterations done";
    case StopReason::kConverged:
      return "the values have settled";
    case StopReason::kTolerance:
      return "loss below tolerance";
    case StopReason::kCancelled:
      return "cancelled";
    case StopReason::kDropped:
      return "too many samples were not finite";
    case StopReason::kError:
      return "error";
    default:
      return "";
  }
}

Fit::Fit(Scene scene, std::vector<Photo> photos, const std::vector<UnknownParameter>& unknowns,
         FitSettings settings)
    : scene_(checked(std::move(scene), photos, unknowns, settings)),
      photos_(std::move(photos)),
      unknowns_(scene_, unknowns),
      fields_(scene_, unknowns),
      settings_(std::move(settings)),
      loss_(find_loss(settings_.loss)),
      layout_(scene_, unknowns_.parameters()),
      problem_{unknowns_, layout_, photos_, loss_, settings_.iterations},
      field_adam_(fields_),
      x_(unknowns_.start()),
      field_values_(fields_.start()),
      previews_(photos_.size()) {
  if (!fields_.empty() && unknowns_.size() == 0) {
    if (settings_.optimiser != "adam" && settings_.optimiser != "auto")
      throw InvalidArgument("optimiser = '" + settings_.optimiser +
                            "' cannot fit a grid or an image, and nothing else is fitted; choose "
                            "optimiser = 'adam' or 'auto'");
    settings_.optimiser = "adam";
  }
  const OptimiserKind& kind = choose_optimiser(settings_.optimiser, unknowns_.size(), loss_,
                                               settings_.spp, settings_.accumulate);
  optimiser_name_ = kind.name;
  purpose_ = kind.purpose;
  // What Gauss-Newton gathers over iterations would be about fields that have moved since.
  alternates_ = !fields_.empty() && kind.few_unknowns;
  if (alternates_) problem_.iterations = count_iterations(&Block::scalars, settings_.iterations);
  optimiser_ = kind.make(problem_);
  if (settings_.finite_differences) reparametrization_ = std::make_unique<Reparametrization>(unknowns_);
  begin_multi_start(kind, unknowns);
  result_.last = result_.best = x_;
  result_.fields_last = result_.fields_best = std::make_shared<FieldValues>(field_values_);
  result_.best_validation = result_.best_validation_standard_error = kNotDone;
}

RenderSettings Fit::render_settings(const Photo& photo, int spp, std::uint64_t seed) const {
  RenderSettings settings;
  settings.width = photo.width;
  settings.height = photo.height;
  settings.spp = spp;
  settings.seed = seed;
  settings.depth = settings_.depth;
  settings.threads = settings_.threads;
  settings.frame = photo.frame;
  settings.pixels = photo.pixels;
  return settings;
}

void Fit::count(const Film& film, const Photo& photo) {
  const std::int64_t pixels =
      photo.pixels ? std::ranges::count_if(*photo.pixels, [](auto one) { return one != 0; })
                   : static_cast<std::int64_t>(film.size());
  result_.samples += pixels * film.spp;
  result_.dropped += film.dropped;
  result_.cpu_seconds += film.cpu_seconds;
  if (film.dropped > 0 && first_dropped_.empty()) first_dropped_ = film.first_dropped;
}

Fit::Subject Fit::subject(const FieldValues& fields) const {
  return {problem_, reparametrization_.get(),
          [this, &fields](const Vector& x) { return scene_at(x, fields); }};
}

Film Fit::derivatives(const Subject& subject, const Vector& x, const Photo& photo, int spp,
                      std::uint64_t seed, Purpose purpose, Differences which, Progress* progress) {
  const Scene scene = subject.scene_at(x);
  return render_derivatives(
      subject.problem, subject.reparametrization, scene, x, purpose, which,
      [&](const Vector& at, const SlotLayout& layout, Paths paths) {
        const Scene there = subject.scene_at(at);
        const std::uint64_t its_seed = paths == Paths::kOfFilm ? seed : seed_of(seed, 1, 0);
        Film film = settings_.renderer(there, there.camera(photo.camera), layout,
                                       render_settings(photo, spp, its_seed), progress);
        count(film, photo);
        return film;
      });
}

Observation Fit::observe(const Vector& x, const FieldValues& fields, int index, const Block& block,
                         std::vector<std::vector<double>>& gradients, FieldGaussNewton* newton,
                         Progress* progress) {
  const Photo& photo = photos_[static_cast<std::size_t>(index)];
  const std::uint64_t seed =
      stream_seed(settings_.seed, Stream::kStep, result_.iterations, index);
  Observation seen;
  seen.photo = index;
  if (block.fields && newton) {
    const Scene scene = scene_at(x, fields);
    const auto i = static_cast<std::size_t>(index);
    FieldJacobian found = render_field_jacobian(scene, scene.camera(photo.camera), fields_.refs(),
                                                render_settings(photo, settings_.spp, seed),
                                                newton->shares(i), newton->cell(), progress);
    count(found.film, photo);
    newton->gather(i, found);
    seen.film = std::move(found.film);
  } else if (block.fields) {
    const Scene scene = scene_at(x, fields);
    FieldGradient found =
        loss_field_gradient(scene, scene.camera(photo.camera), fields_, photo, loss_,
                            render_settings(photo, settings_.spp, seed), progress);
    count(found.film, photo);
    gradients.resize(found.fields.size());
    for (std::size_t f = 0; f < gradients.size(); ++f) {
      gradients[f].resize(found.fields[f].size());
      std::transform(gradients[f].begin(), gradients[f].end(), found.fields[f].begin(),
                     gradients[f].begin(), std::plus<>());
    }
    seen.film = std::move(found.film);
  }
  if (block.scalars && (fields_.empty() || unknowns_.size() > 0)) {
    Differences which = differences_of(purpose_, count_iterations(&Block::scalars, result_.iterations));
    which.refractions = !searches_ior();
    seen.film =
        derivatives(subject(fields), x, photo, settings_.spp, seed, purpose_, which, progress);
  }
  seen.loss = loss_.evaluate(seen.film, photo);
  previews_[static_cast<std::size_t>(index)] = std::make_shared<const Picture>(seen.film.mean);
  return seen;
}

/// The same samples every time: differences between two sets of values are not hidden by noise.
Fit::Validation Fit::validate(const Vector& x, const FieldValues& fields, int spp,
                              Progress* progress) {
  const Scene scene = scene_at(x, fields);
  const SlotLayout none;
  const double share = 1.0 / static_cast<double>(photos_.size());
  Validation sum;
  for (int i = 0; i < static_cast<int>(photos_.size()); ++i) {
    const Photo& photo = photos_[static_cast<std::size_t>(i)];
    const std::uint64_t seed = stream_seed(settings_.seed, Stream::kValidation, 0, i);
    const Film film = settings_.renderer(scene, scene.camera(photo.camera), none,
                                         render_settings(photo, spp, seed), progress);
    count(film, photo);
    const LossResult loss = loss_.evaluate(film, photo);
    sum.loss += share * loss.value;
    sum.unbiased += share * loss.unbiased;
    sum.variance += share * share * loss.standard_error * loss.standard_error;
    sum.bias += mean_bias(film, photo) * share;
    for (const float part : loss.parts) sum.parts.push_back(static_cast<float>(share) * part);
    previews_[static_cast<std::size_t>(i)] = std::make_shared<const Picture>(film.mean);
  }
  return sum;
}

void Fit::note_validation(HistoryRow& row, const Validation& validation) {
  row.validation = validation.unbiased;
  row.validation_standard_error = std::sqrt(validation.variance);
  const bool first = std::isnan(result_.best_validation);
  if (first || validation.unbiased < smallest_.unbiased) smallest_ = validation;
  if (is_worse(validation, smallest_, 1)) return;
  if (!first && gives_way_to_best(row.values, validation)) return;
  best_ = validation;
  result_.best = row.values;
  result_.fields_best = result_.fields_last;
  result_.best_iteration = row.iteration;
  result_.best_validation = row.validation;
  result_.best_validation_standard_error = row.validation_standard_error;
}

bool Fit::may_give_way_to_best(const Vector& x) const {
  return searched_ && !field_gauss_newton_ && !is_low_roughness(x) && is_low_roughness(result_.best);
}

bool Fit::gives_way_to_best(const Vector& x, const Validation& validation) const {
  return may_give_way_to_best(x) && !best_.parts.empty() && is_equivalent(best_, validation);
}

bool Fit::is_worse(const Validation& one, const Validation& than, double sigmas) {
  if (than.parts.empty()) return false;
  const auto terms = [](const std::vector<float>& parts) {
    const auto count = static_cast<Eigen::Index>(parts.size());
    return Eigen::Map<const Eigen::ArrayXf>(parts.data(), count).cast<double>();
  };
  const NoisySum by(terms(one.parts) - terms(than.parts));
  return by.sum > sigmas * by.deviation;
}

bool Fit::within_tolerance() const {
  double sum = 0;
  int found = 0;
  for (auto row = result_.history.rbegin(); row != result_.history.rend(); ++row) {
    if (std::isnan(row->validation)) continue;
    sum += row->validation;
    if (++found == kToleranceWindow) break;
  }
  return settings_.tolerance > 0 && found == kToleranceWindow &&
         sum / kToleranceWindow < settings_.tolerance;
}

bool Fit::too_many_dropped() {
  if (static_cast<double>(result_.dropped) <=
      kTooManyDropped * static_cast<double>(result_.samples))
    return false;
  stop(StopReason::kDropped, std::to_string(result_.dropped) + " of " +
                                 std::to_string(result_.samples) +
                                 " samples were not finite and left out; first: " + first_dropped_ +
                                 ". Check the scene for extreme values");
  return true;
}

bool Fit::stop(StopReason reason, std::string message) {
  result_.stopped = reason;
  result_.message = std::move(message);
  return false;
}

bool Fit::step(Progress* progress) {
  if (result_.stopped != StopReason::kNone) return false;
  try {
    if (multi_start_) return run_multi_start(progress);
    if (!trials_.empty()) return compare_trials(progress);
    if (alternative_minima_) return compare_alternatives(progress);
    return refinement_ ? refine(progress) : iterate(progress);
  } catch (const Cancelled&) {
    return stop(StopReason::kCancelled);
  } catch (const std::exception& error) {
    return stop(StopReason::kError,
                "Iteration " + std::to_string(result_.iterations) + ": " + error.what());
  }
}

bool Fit::iterate(Progress* progress) {
  const double share = 1.0 / static_cast<double>(photos_.size());
  const Block now = block(result_.iterations);
  if (now.first && now.scalars && begin_trials()) return true;
  const bool due = (now.first && (now.scalars || !field_gauss_newton_ || result_.iterations == 0)) ||
                   (!searched_ && result_.iterations % settings_.validation_interval == 0);
  Validation validation;
  if (due) validation = tried_ ? *tried_ : validate(x_, field_values_, progress);
  // A turn begins with few equations, which may lead it far astray.
  const bool reverted =
      alternates_ && now.first && due && is_worse(validation, best_, kReverted);
  if (reverted) validation = best_;
  const Vector x = reverted ? result_.best : x_;
  FieldValues next_fields = reverted ? *result_.fields_best : field_values_;
  HistoryRow row{result_.iterations, x, 0, kNotDone, kNotDone, {}, fields_.means(next_fields)};
  Vector next = x;
  FieldAdam field_adam = field_adam_;
  std::vector<std::vector<double>> gradients;
  // A cancelled step leaves no trace: without `accumulate` the optimiser steps between renders.
  std::unique_ptr<Optimiser> copy = settings_.accumulate ? nullptr : optimiser_->clone();
  std::unique_ptr<FieldGaussNewton> newton =
      field_gauss_newton_ ? std::make_unique<FieldGaussNewton>(*field_gauss_newton_) : nullptr;
  if (newton && reverted) newton->set_values(next_fields);
  const std::vector<FieldStep> how = field_steps();
  std::vector<Observation> seen;
  for (int i = 0; i < static_cast<int>(photos_.size()); ++i) {
    seen.push_back(observe(next, next_fields, i, now, gradients, newton.get(), progress));
    row.loss += share * seen.back().loss.value;
    row.mean_bias += mean_bias(seen.back().film, photos_[static_cast<std::size_t>(i)]) * share;
    if (now.fields && !newton && (searched_ || !settings_.accumulate)) {
      field_adam.step(next_fields, gradients, how);
      gradients.clear();
    }
    if (settings_.accumulate) continue;
    next = copy->step(next, seen);
    seen.clear();
  }
  if (settings_.accumulate) {
    if (reverted || (now.scalars && now.first && !newton)) optimiser_->reset_equations();
    if (now.scalars) next = optimiser_->step(next, seen, newton.get());
    if (now.fields && searched_) next = optimiser_->step_by_residuals(next, seen, newton.get());
    if (newton) next_fields = newton->values();
    if (now.fields && !searched_) field_adam.step(next_fields, gradients, how);
  } else {
    optimiser_ = std::move(copy);
  }
  tried_.reset();
  x_ = result_.last = x;
  if (reverted) result_.fields_last = result_.fields_best;
  if (due) note_validation(row, validation);
  result_.history.push_back(row);
  if (too_many_dropped()) return false;
  if (due && within_tolerance()) return stop(StopReason::kTolerance);
  x_ = result_.last = unknowns_.project(next);
  field_adam_ = std::move(field_adam);
  field_gauss_newton_ = std::move(newton);
  field_values_ = std::move(next_fields);
  if (now.fields && searched_ && !field_gauss_newton_) smooth(now);
  if (!fields_.empty()) result_.fields_last = std::make_shared<FieldValues>(field_values_);
  ++result_.iterations;
  return is_over() ? finish(progress) : true;
}

bool Fit::is_over() const {
  return result_.iterations >= all_iterations() || (wants_refinement() && optimiser_->converged());
}

bool Fit::accept(const Vector& x, const Validation& validation, bool accepted) {
  HistoryRow row{result_.iterations, x, 0, 0, 0, {}, fields_.means(field_values_)};
  x_ = result_.last = row.values;
  row.loss = validation.loss;
  row.mean_bias = validation.bias;
  note_validation(row, validation);
  // An answer that draws on all iterations gives way to an earlier state only if that is better by
  // more than the noise of the comparison.
  if (accepted || (optimiser_->averages() && (!alternates_ || field_gauss_newton_) &&
               row.validation < result_.best_validation + 2 * row.validation_standard_error)) {
    result_.best_validation = kNotDone;
    note_validation(row, validation);
  }
  const bool best = result_.best == row.values;
  result_.history.push_back(std::move(row));
  return best;
}

bool Fit::finish(Progress* progress) {
  // Beside fields the last values: each turn of the scalars begins afresh.
  const Vector x = alternates_ ? x_ : unknowns_.project(optimiser_->answer(x_));
  if (!may_give_way_to_best(x) && begin_trials()) return true;
  const Validation validation = tried_ ? *tried_ : validate(x, field_values_, progress);
  if (!gives_way_to_best(x, validation) && begin_trials()) return true;
  accept(x, validation);
  tried_.reset();
  if (too_many_dropped()) return false;
  if (!wants_refinement()) return stop(StopReason::kIterations);
  start_refinement();
  return true;
}

}  // namespace selenite
