// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/multi_start.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "fit/evaluate/seeds.h"
#include "fit/problem/pixel_weights.h"
#include "math/rng.h"
#include "math/scalar.h"

namespace selenite {
namespace {

constexpr double kRendersOfStep = 3;  ///< with its differences, on average
constexpr int kRemembered = 1 << 20;  ///< iterations that steps expect: damping stays as at first
constexpr double kMedianOfSquare = 0.455;  ///< of a standard normal number

/// Van der Corput's sequence, shifted; a base per dimension makes it Halton's.
double radical_inverse(int base, std::size_t index, double shift) {
  double result = shift, digit = 1.0 / base;
  for (; index > 0; index /= static_cast<std::size_t>(base), digit /= base)
    result += digit * static_cast<double>(index % static_cast<std::size_t>(base));
  return result - std::floor(result);
}

constexpr std::array kBases{2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37};

double median(std::vector<double> numbers) {
  const auto middle = numbers.begin() + static_cast<std::ptrdiff_t>(numbers.size() / 2);
  std::nth_element(numbers.begin(), middle, numbers.end());
  return *middle;
}

double uniform(std::uint64_t key) { return static_cast<double>(mix64(key) >> 11) * 0x1p-53; }

}  // namespace

std::vector<std::size_t> searched_photos(const Problem& problem, const Scene& scene,
                                         const MultiStartOptions& options) {
  const std::size_t all = problem.photos.size();
  const std::size_t count = std::min(all, static_cast<std::size_t>(options.photos));
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t first = i * all / count, next = (i + 1) * all / count;
    const double at = uniform(i) * static_cast<double>(next - first);
    chosen.push_back(first + static_cast<std::size_t>(at));
  }
  for (std::size_t p = 0; p < problem.unknowns.parameters().size(); ++p) {
    const auto shows = [&](std::size_t photo) {
      return problem.unknowns.is_seen(p, scene, problem.photos[photo]);
    };
    std::size_t first = 0;
    while (first < all && !shows(first)) ++first;
    if (first < all && std::ranges::none_of(chosen, shows)) chosen.push_back(first);
  }
  std::ranges::sort(chosen);
  return chosen;
}

MultiStart::MultiStart(const Problem& problem, const std::vector<std::size_t>& photos,
                       std::uint64_t seed, const MultiStartOptions& options)
    : options_(options),
      seed_(seed),
      problem_{problem.unknowns, problem.layout, photos_, problem.loss, kRemembered},
      reparametrization_(problem.unknowns) {
  for (const std::size_t index : photos) {
    photos_.push_back(problem.photos[index].resized(options_.size));
    weights_.push_back(problem.loss.weighted ? relative_weights(photos_.back(), 1)
                                             : shares(photos_.back(), 1));
  }
  begin_at(problem.unknowns.start());
}

void MultiStart::begin_at(const Vector& values) {
  chosen_ = values;
  candidates_.clear();
  Candidate start;
  start.x = chosen_;
  start.from_start = start.untouched = true;
  candidates_.push_back(start);
  for (const Vector& x : spread_points()) {
    Candidate candidate;
    candidate.x = x;
    candidates_.push_back(std::move(candidate));
  }
  result_ = {.points = static_cast<int>(candidates_.size())};
  next_ = 0;
  ahead_ = {};
  round_ = stepped_ = 0;
}

/// A point of a component's range, `at` in [0, 1].
///
/// Logarithmic where the table says so, and for light. A rotation has been searched before. A spread of
/// roughness that is even in the value was worse in four of eight fits and better in two. Steps find no
/// way from an index of refraction near 1, at which nothing shows.
double MultiStart::point_in_range(int component, double at) const {
  const Unknowns& unknowns = problem_.unknowns;
  const Parameter& description = unknowns.description_of(component);
  double low = unknowns.minimum()[component], high = unknowns.maximum()[component];
  at = options_.margin + (1 - 2 * options_.margin) * at;
  if (description.scale == Scale::kLogExcess && low < options_.least_ior &&
      high > options_.largest_ior) {
    low = options_.least_ior;
    high = options_.largest_ior;
  }
  const double start = chosen_[component];
  if (description.scale == Scale::kAngle) return start;
  const bool light = description.effect == Effect::kEmission;
  if ((light || (description.scale == Scale::kLog && description.effect != Effect::kSurface)) &&
      start > 0) {
    low = std::max(low, start / options_.extinction_factor);
    high = std::min(high, start * options_.extinction_factor);
  }
  if (description.scale == Scale::kReflectance) {
    low = Reparametrization::reflectance(low);
    return Reparametrization::albedo_of(low + at * (Reparametrization::reflectance(high) - low));
  }
  if ((light || description.scale == Scale::kLog || description.scale == Scale::kRoughness) &&
      low > 0)
    return low * std::pow(high / low, at);
  return low + at * (high - low);
}

/// Even over the ranges of the parameters; the channels of a colour share their grey.
std::vector<Vector> MultiStart::spread_points() const {
  const Unknowns& unknowns = problem_.unknowns;
  std::vector<Vector> points;
  for (std::size_t n = 1; n <= static_cast<std::size_t>(options_.points); ++n) {
    Vector x = chosen_;
    for (int k = 0; k < unknowns.size(); ++k) {
      const auto parameter =
          static_cast<std::size_t>(unknowns.components()[static_cast<std::size_t>(k)].parameter);
      const double shift = uniform(seed_ ^ (0x517cc1b7ull * (parameter + 1)));
      double at = radical_inverse(kBases[parameter % kBases.size()], n, shift);
      const bool colour = unknowns.values_of(static_cast<int>(parameter), x).size() > 1;
      if (colour && unknowns.description_of(k).diagonal) {
        const double stray = uniform(seed_ + 977 * n + 31 * static_cast<unsigned>(k)) - 0.5;
        at = std::clamp(at + options_.greyness * stray, 0.0, 1.0);
      }
      x[k] = point_in_range(k, at);
    }
    points.push_back(unknowns.project(x));
  }
  return points;
}

std::uint64_t MultiStart::seed_for(int purpose, int index, int photo) const {
  return seed_of(mix64(seed_ ^ static_cast<std::uint64_t>(purpose)), index, photo);
}

/// Equal seeds for all candidates: what they have in common cancels in a comparison.
void MultiStart::evaluate(Candidate& candidate, int spp, int purpose, Evaluator& evaluator) {
  candidate.tiled_loss = TiledLoss();
  const double share = 1.0 / static_cast<double>(photos_.size());
  const std::size_t of_candidate = 2 * photos_.size();
  const auto how = [&](std::size_t picture) {
    return Evaluation{
        spp / 2, seed_for(purpose, static_cast<int>(picture % 2), static_cast<int>(picture / 2))};
  };
  // Where candidates make no steps, those that follow are known.
  const bool known = round_ == 0 || round_ == last_round();
  const std::size_t end = known ? candidates_.size() : next_ + 1;
  for (std::size_t v = 0; v < photos_.size(); ++v) {
    const Photo& photo = photos_[v];
    FilmPair parts;
    for (std::size_t i = 0; i < 2; ++i) {
      ahead_.reach(
          evaluator, next_ * of_candidate + 2 * v + i, end * of_candidate, [&](std::size_t k) {
            const std::size_t picture = k % of_candidate;
            evaluator.expect({candidates_[k / of_candidate].x}, photos_[picture / 2], how(picture));
          });
      parts[i] = evaluator.evaluate({candidate.x}, photo, how(2 * v + i));
    }
    candidate.tiled_loss.append(TiledLoss(merged(parts), photo, weights_[v]), share);
    if (round_ == last_round()) candidate.pictures.push_back(std::move(parts));
  }
}

/// Puts the losses together: the detail counts as far as it separates candidates.
void MultiStart::rank() {
  std::vector<double> details, noise;
  for (const Candidate& one : candidates_) {
    if (one.untouched) continue;  // mostly far off
    const NoisySum detail(one.tiled_loss.all - one.tiled_loss.coarse);
    details.push_back(detail.sum);
    noise.push_back(square(detail.deviation));
  }
  const double middle = median(details);
  std::vector<double> spread;
  for (const double one : details) spread.push_back(square(one - middle) / kMedianOfSquare);
  const double between = median(spread);
  const double share = between > 0 ? std::max(1 - median(noise) / between, 0.0) : 0;
  for (Candidate& one : candidates_) {
    one.tiles = one.tiled_loss.coarse + share * (one.tiled_loss.all - one.tiled_loss.coarse);
    one.loss = one.tiles.sum();
    one.rank = one.loss + options_.rank_sigmas * std::sqrt(one.tiles.square().sum());
  }
}

int MultiStart::steps_of(const Candidate& candidate) const {
  if (round_ == 0 || round_ == last_round() || candidate.untouched) return 0;
  return options_.rounds[static_cast<std::size_t>(round_) - 1].steps;
}

void MultiStart::descend(Candidate& candidate, int n, Evaluator& evaluator) const {
  if (!candidate.steps) candidate.steps = std::make_shared<GaussNewton>(problem_);
  const int purpose = 16 + 64 * round_ + n;
  std::vector<Observation> seen;
  const auto how = [&](std::size_t v) {
    const std::uint64_t seed = seed_for(purpose, static_cast<int>(next_), static_cast<int>(v));
    return Evaluation{options_.step_spp, seed, Differences{alternating_side(n)}};
  };
  Ahead ahead;
  for (std::size_t v = 0; v < photos_.size(); ++v) {
    ahead.reach(evaluator, v, photos_.size(),
                [&](std::size_t k) { evaluator.expect({candidate.x}, photos_[k], how(k)); });
    seen.push_back(
        {static_cast<int>(v), evaluator.evaluate({candidate.x}, photos_[v], how(v)), {}});
  }
  candidate.x = candidate.steps->step(candidate.x, seen);
}

/// Whether two points are one basin's, for all that a search can tell.
bool MultiStart::same_basin(const Vector& x, const Vector& y) const {
  const Vector range = reparametrization_.maximum() - reparametrization_.minimum();
  const Vector apart = reparametrization_.from_values(x) - reparametrization_.from_values(y);
  return (apart.cwiseAbs().array() <= options_.same_basin * range.array()).all();
}

/// The best of each kind. The start and what came of it stay whatever their rank.
void MultiStart::keep_best(std::size_t count) {
  std::stable_sort(candidates_.begin(), candidates_.end(),
                   [](const Candidate& a, const Candidate& b) { return a.rank < b.rank; });
  std::vector<Candidate> kept;
  for (Candidate& one : candidates_) {
    const bool known = std::any_of(kept.begin(), kept.end(), [&](const Candidate& other) {
      return same_basin(one.x, other.x);
    });
    if (one.from_start || (kept.size() < count && !known)) kept.push_back(std::move(one));
  }
  candidates_ = std::move(kept);
}

bool MultiStart::step(Evaluator& evaluator) {
  if (round_ > last_round()) return false;
  Candidate& candidate = candidates_[next_];
  const bool final = round_ == last_round();
  if (stepped_ < steps_of(candidate)) {
    descend(candidate, stepped_++, evaluator);
    return true;
  }
  evaluate(candidate,
           final         ? options_.final_spp
           : round_ == 0 ? options_.first_spp
                         : options_.step_spp,
           round_, evaluator);
  stepped_ = 0;
  if (++next_ < candidates_.size()) return true;
  next_ = 0;
  ahead_ = {};
  rank();
  if (final) {
    choose();
  } else {
    note_best();
    keep_best(
        static_cast<std::size_t>(options_
                                     .rounds[std::min<std::size_t>(static_cast<std::size_t>(round_),
                                                                   options_.rounds.size() - 1)]
                                     .count));
    if (round_ == 0) {  // one goes on as it is, one is refined
      Candidate copy = *std::find_if(candidates_.begin(), candidates_.end(),
                                     [](const Candidate& one) { return one.from_start; });
      copy.untouched = false;
      candidates_.push_back(std::move(copy));
    }
  }
  return ++round_ <= last_round();
}

bool MultiStart::cut_short() {
  if (round_ > 0) return true;  // `note_best` has chosen when the last round ended
  candidates_.resize(next_);    // the others have not been rendered
  if (candidates_.size() < 2) return false;
  result_.points = static_cast<int>(candidates_.size());
  rank();
  note_best();
  return true;
}

/// Chooses among candidates whose losses are of equal seeds, before those are compared pixel against pixel.
void MultiStart::note_best() {
  const auto worse = [](const Candidate& a, const Candidate& b) { return a.rank < b.rank; };
  const Candidate* chosen = &*std::ranges::min_element(candidates_, worse);
  for (const Candidate& one : candidates_) {
    if (!one.untouched) continue;
    const NoisySum by(one.tiles - chosen->tiles);
    result_.start_loss = one.loss;
    result_.standard_error = by.deviation;
    if (by.sum <= options_.sigmas * by.deviation) chosen = &one;
  }
  chosen_ = chosen->x;
  result_.moved = !chosen->untouched;
  result_.loss = chosen->loss;
}

void MultiStart::members(SavedState& state) {
  std::int64_t count = std::ssize(candidates_);
  state(count);
  if (state.reading()) candidates_.resize(static_cast<std::size_t>(count));
  for (Candidate& one : candidates_) {
    bool has_steps = one.steps != nullptr;
    state(one.x, one.from_start, one.untouched, one.loss, one.rank, one.tiled_loss, one.pictures,
          one.tiles, has_steps);
    if (state.reading() && has_steps) one.steps = std::make_shared<GaussNewton>(problem_);
    if (has_steps) state(*one.steps);
  }
  state(next_, round_, stepped_, chosen_, result_);
}

double MultiStart::work(int round, bool steps) const {
  if (round == 0) return options_.first_spp;
  if (round == last_round()) return options_.final_spp;
  const int count = steps ? options_.rounds[static_cast<std::size_t>(round) - 1].steps : 0;
  return options_.step_spp * (1 + kRendersOfStep * count);
}

double MultiStart::fraction() const {
  if (round_ > last_round()) return 1;
  double done = 0, all = 0;
  for (int round = 0; round <= last_round(); ++round) {
    if (round == round_) {
      for (std::size_t i = 0; i < candidates_.size(); ++i) {
        const double part = work(round, !candidates_[i].untouched);
        all += part;
        if (i < next_) done += part;
      }
      done += options_.step_spp * kRendersOfStep * stepped_;
      continue;
    }
    // The most that there may be: the start as it is and stepped, and others. None is added later.
    const auto place = static_cast<std::size_t>(std::clamp(round - 1, 0, last_round() - 2));
    double others = round == 0 ? options_.points : 1 + options_.rounds[place].count;
    if (round > std::max(round_, 1))
      others = std::min(others, static_cast<double>(candidates_.size()) - 1);
    const double part = work(round, false) + others * work(round, true);
    all += part;
    if (round < round_) done += part;
  }
  return done / all;
}

std::vector<Vector> MultiStart::others() const {
  std::vector<Vector> others;
  for (const Candidate& one : candidates_)
    if (!one.untouched && one.x != chosen_) others.push_back(one.x);
  return others;
}

/// Share of the range, in the coordinate of steps, to the nearest bound.
double MultiStart::distance_to_bounds(const Vector& x) const {
  const Vector u = reparametrization_.from_values(x);
  const Vector nearest =
      (u - reparametrization_.minimum()).cwiseMin(reparametrization_.maximum() - u);
  return nearest.cwiseQuotient(reparametrization_.maximum() - reparametrization_.minimum())
      .minCoeff();
}

/// Whether nothing says that `other` is better by more than noise.
bool MultiStart::equivalent(const Candidate& one, const Candidate& other) const {
  // Tile against tile: equal seeds, so that common noise cancels.
  const NoisySum by(one.tiles - other.tiles);
  if (by.sum > options_.sigmas * by.deviation) return false;
  PairedMidpointTest behind;
  for (std::size_t v = 0; v < photos_.size(); ++v)
    behind.add(photos_[v], weights_[v], other.pictures[v], one.pictures[v]);
  return !behind.significant(options_.sigmas);
}

void MultiStart::choose() {
  const Candidate& best =
      *std::min_element(candidates_.begin(), candidates_.end(),
                        [](const Candidate& a, const Candidate& b) { return a.rank < b.rank; });
  const Candidate* chosen = &best;
  // At a bound steps see little, as of a roughness: of equals the one farthest from bounds.
  for (const Candidate& one : candidates_)
    if (!one.untouched && distance_to_bounds(one.x) > distance_to_bounds(chosen->x) &&
        equivalent(one, best))
      chosen = &one;
  for (const Candidate& one : candidates_) {
    if (!one.untouched) continue;
    result_.start_loss = one.loss;
    result_.standard_error = NoisySum(one.tiles - chosen->tiles).deviation;
    if (equivalent(one, *chosen)) chosen = &one;
  }
  chosen_ = chosen->x;
  result_.moved = !chosen->untouched;
  result_.loss = chosen->loss;
}

}  // namespace selenite
