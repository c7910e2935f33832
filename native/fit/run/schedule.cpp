// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/run/schedule.h"

#include <algorithm>
#include <iterator>

#include "fit/evaluate/photo_evaluator.h"
#include "fit/evaluate/rendered_pixels.h"
#include "fit/inference/informative_pixels.h"
#include "fit/phases/field_refinement.h"
#include "fit/phases/minima_comparison.h"
#include "fit/phases/multi_start.h"
#include "fit/phases/refinement.h"
#include "fit/phases/roughness_profile.h"
#include "fit/phases/starts/alignment_start.h"
#include "fit/phases/starts/light_start.h"
#include "fit/phases/starts/rotation_start.h"

namespace selenite {
namespace {

constexpr MultiStartOptions kMultiStart;
constexpr ExpectedCourse kExpected;

double pixels_of(const std::vector<Photo>& photos) {
  double sum = 0;
  for (const Photo& photo : photos) sum += rendered_count(photo);
  return sum;
}

/// How many renders a picture with derivatives takes.
struct Renders {
  int plain = 0, carrying = 0;
};

class Planner {
 public:
  Planner(const FitProblem& problem, const Strategy& strategy)
      : problem_(problem),
        strategy_(strategy),
        blocks_(strategy.blocks(problem)),
        pixels_(pixels_of(problem.photos())) {}

  std::vector<PlannedRenders> plan() {
    if (strategy_.multi_start) plan_multi_start();
    plan_descent();
    if (!strategy_.refines) return std::move(plan_);
    if (strategy_.joint) {
      plan_field_refinement();
      if (strategy_.profiles_roughness()) plan_roughness_profile();
      return std::move(plan_);
    }
    plan_refinement();
    plan_comparison();
    return std::move(plan_);
  }

 private:
  /// Equal ones are counted together.
  void add(PhaseKind phase, double pixels, int spp, double renders, Carried carried) {
    if (renders == 0) return;
    const auto same = std::ranges::find_if(plan_, [&](const PlannedRenders& one) {
      return one.phase == phase && one.pixels == pixels && one.spp == spp && one.carried == carried;
    });
    if (same != plan_.end())
      same->renders += renders;
    else
      plan_.push_back({phase, pixels, spp, renders, carried});
  }
  void add(PhaseKind phase, double pixels, int spp, double times, const Renders& renders) {
    add(phase, pixels, spp, times * renders.plain, Carried::kNothing);
    add(phase, pixels, spp, times * renders.carrying, Carried::kDerivatives);
  }

  /// Asks the code that renders derivatives, with films of one pixel in place of renders.
  static Renders renders_of(const SceneModel& model, const Point& point, Purpose purpose,
                            const Differences& which) {
    Renders count;
    (void)render_derivatives(model.problem, model.differences, model.scene_at(point),
                             model.problem.photos.front(), point.scalars, purpose, which,
                             [&](const Vector&, const SlotLayout& layout, Paths) {
                               ++(layout.slots.empty() ? count.plain : count.carrying);
                               return Film(1, 1, 2, static_cast<int>(layout.slots.size()));
                             });
    return count;
  }
  Renders renders_of(Purpose purpose, const Differences& which) const {
    return renders_of(scene_model(problem_), problem_.start(), purpose, which);
  }

  void validate(PhaseKind phase, double times) {
    add(phase, pixels_, problem_.settings().chosen_validation_spp(), times, Carried::kNothing);
  }

  void plan_multi_start() {
    std::vector<Photo> small;
    for (const Photo& photo : problem_.photos()) small.push_back(photo.resized(kMultiStart.size));
    if (LightStart::of(problem_, 0)) {
      constexpr LightStartOptions kLight;
      add(PhaseKind::kMultiStart, pixels_of(small), kLight.spp, kLight.passes,
          Carried::kFieldDerivatives);
    }
    const SceneModel model =
        strategy_.uniform ? scene_model(problem_, *strategy_.uniform) : scene_model(problem_);
    if (RotationStart::of(model.problem, 0)) {
      constexpr RotationStartOptions kRotation;
      std::vector<Photo> larger;
      for (const Photo& photo : problem_.photos()) larger.push_back(photo.resized(kRotation.size));
      add(PhaseKind::kMultiStart, pixels_of(larger), kRotation.spp,
          kRotation.angles + 2 * kRotation.halvings, Carried::kNothing);
    }
    double searches = 1;
    if (const auto alignment = AlignmentStart::of(problem_.photos(), 0)) {
      constexpr AlignmentStartOptions kStart;
      if (alignment->may_move(kMultiStart.size)) ++searches;
      std::vector<Photo> aligned;
      std::ranges::copy_if(problem_.photos(), std::back_inserter(aligned), &Photo::align);
      add(PhaseKind::kMultiStart, pixels_of(aligned), kStart.spp, kStart.passes, Carried::kNothing);
    }
    std::vector<Photo> searched;
    const Scene scene = problem_.scene_at(problem_.start());
    for (const std::size_t i : searched_photos(model.problem, scene)) searched.push_back(small[i]);
    plan_search(model, pixels_of(searched), searches);
  }

  void plan_search(const SceneModel& model, double pixels, double times) {
    const auto evaluate = [&](double candidates, int spp) {  // in two halves
      add(PhaseKind::kMultiStart, pixels, spp / 2, times * 2 * candidates, Carried::kNothing);
    };
    const Point start{model.problem.unknowns.start(), {}};
    const Renders step = renders_of(model, strategy_.uniform ? start : problem_.start(),
                                    Purpose::kInstrumental, {alternating_side(0)});
    evaluate(kMultiStart.points + 1, kMultiStart.first_spp);
    const bool few = std::ssize(model.problem.unknowns.parameters()) < kExpected.few_parameters;
    const double distinct = few ? kExpected.distinct : 1;
    for (const auto& [count, steps] : kMultiStart.rounds) {
      add(PhaseKind::kMultiStart, pixels, kMultiStart.step_spp,
          times * distinct * (count + 1) * steps, step);
      evaluate(distinct * (count + 2), kMultiStart.step_spp);
    }
    evaluate(distinct * kExpected.last_candidates, kMultiStart.final_spp);
  }

  void plan_descent() {
    const FitSettings& settings = problem_.settings();
    int iterations = blocks_.iterations();
    if (strategy_.refines && problem_.fields().empty() && strategy_.optimiser.averages_iterations)
      iterations = std::min(iterations, kExpected.converged_after);
    int scalar_iterations = 0;
    if (strategy_.multi_start) validate(PhaseKind::kDescent, 1);  // of the user's start
    for (int i = 0; i < iterations; ++i) {
      const Block block = blocks_.block(i);
      const bool starts_scalars = block.first && block.scalars;
      const bool restarts = starts_scalars && restart_is_due(scalar_iterations == 0);
      const bool due = (block.first && (block.scalars || !strategy_.joint || i == 0)) ||
                       (!strategy_.after_multi_start() && i % settings.validation_interval == 0);
      if (restarts)
        plan_restart();
      else if (due)
        validate(PhaseKind::kDescent, 1);
      if (block.fields) {
        // A loss that is no sum over pixels has its slopes from a render before.
        const int renders = strategy_.joint || problem_.loss().per_pixel ? 1 : 2;
        add(PhaseKind::kDescent, pixels_, settings.spp, renders, Carried::kFieldDerivatives);
      }
      if (!block.scalars) continue;
      if (problem_.fields().empty() || problem_.unknowns().size() > 0) {
        Differences which = differences_of(strategy_.optimiser.purpose, scalar_iterations);
        which.refractions = !strategy_.searches_ior();
        add(PhaseKind::kDescent, pixels_, settings.spp, 1,
            renders_of(strategy_.optimiser.purpose, which));
      }
      ++scalar_iterations;
    }
    if (restart_is_due(false))
      plan_restart();
    else
      validate(PhaseKind::kDescent, 1);
  }

  int count_of(Scale scale) const {
    const auto& all = problem_.unknowns().descriptions();
    return static_cast<int>(
        std::ranges::count_if(all, [&](const Parameter& one) { return one.scale == scale; }));
  }
  int searched_iors() const { return strategy_.searches_ior() ? count_of(Scale::kLogExcess) : 0; }
  bool restart_is_due(bool first) const {
    if (!strategy_.prefers_low_roughness() || (first && !strategy_.searches_ior())) return false;
    return count_of(Scale::kRoughness) > 0 || searched_iors() > 0;
  }
  /// Also what stands in its place where nothing is to be compared: a validation.
  void plan_restart() {
    const double candidates = count_of(Scale::kRoughness) > 0 ? kExpected.restart_candidates : 1;
    validate(PhaseKind::kDescent, candidates);
    add(PhaseKind::kDescent, pixels_, problem_.settings().spp,
        candidates * searched_iors() * kExpected.line_search_renders, Carried::kNothing);
  }

  /// The refined values come first. Where a roughness is determined there is nothing to render.
  void plan_roughness_profile() {
    constexpr RoughnessProfileOptions kOptions;
    const double found = count_of(Scale::kRoughness);
    const double tries = found > 0 ? 1 + kExpected.profiled_roughnesses * found : 0;
    add(PhaseKind::kRoughnessProfile, pixels_, problem_.settings().spp * kOptions.light_samples,
        tries * kOptions.passes, Carried::kFieldDerivatives);
    add(PhaseKind::kRoughnessProfile, pixels_,
        problem_.settings().chosen_validation_spp() * kOptions.samples, tries, Carried::kNothing);
  }

  void plan_refinement() {
    constexpr RefinementOptions kOptions;
    const int spp = problem_.settings().chosen_refinement_spp();
    const auto pass_spp = [&](int share) {
      return std::min(spp, std::max(spp / share, kOptions.least_of_pass));
    };
    const Renders up = renders_of(Purpose::kInstrumental,
                                  {.side = alternating_side(0), .of_roughness = Side::kBoth});
    if (!strategy_.optimiser.averages_iterations)
      add(PhaseKind::kRefinement, pixels_,
          std::max(pass_spp(kFirstShare) / kOptions.derivative_share, kLeastOfDerivatives),
          kOptions.warm_ups, up);
    const auto pass = [&](int samples, double times) {
      add(PhaseKind::kRefinement, pixels_, samples, times, Carried::kNothing);
      add(PhaseKind::kRefinement, pixels_,
          std::max(samples / kOptions.derivative_share / kJacobianPortions, kLeastOfDerivatives),
          kJacobianPortions * times, up);
    };
    pass(pass_spp(kFirstShare), 1);
    pass(pass_spp(kSecondShare), 1);
    pass(spp, kExpected.passes - 2);
    validate(PhaseKind::kRefinement, 1);
  }

  /// A roughness looks sharp there, mostly, and is left out.
  void plan_field_refinement() {
    constexpr FieldRefinementOptions kOptions;
    const FitSettings& settings = problem_.settings();
    const int all = settings.chosen_refinement_spp();
    const int spp = settings.refinement_spp == 0 ? all / kOptions.share_of_samples : all;
    const Renders both = renders_of(
        Purpose::kInstrumental,
        {.side = Side::kBoth, .of_roughness = Side::kBoth, .roughnesses = false, .picture = false});
    const double informative = pixels_ * kExpected.informative_pixels / kInformativePixels.one_of;
    bool pilot = true;
    for (const int share : kOptions.shares) {
      const int of_pass = std::min(spp, std::max(spp / share, kOptions.least_of_pass));
      const int derivatives =
          pilot ? of_pass * kOptions.pilot : of_pass / kOptions.share_after_pilot;
      add(PhaseKind::kRefinement, pixels_, of_pass, 1, Carried::kNothing);
      add(PhaseKind::kRefinement, pixels_,
          std::max(derivatives / kJacobianPortions, kLeastOfDerivatives), kJacobianPortions, both);
      const int closer = kOptions.informative_samples * of_pass;
      add(PhaseKind::kRefinement, informative, closer, 1, Carried::kNothing);
      add(PhaseKind::kRefinement, informative,
          closer / (kOptions.informative_derivative_share * kJacobianPortions), kJacobianPortions,
          both);
      pilot = false;
    }
    validate(PhaseKind::kRefinement, 1);
  }

  void plan_comparison() {
    const int spp = problem_.settings().chosen_refinement_spp();
    double alternatives =
        static_cast<double>(problem_.unknowns().exchanged(problem_.unknowns().start()).size());
    if (strategy_.multi_start && !strategy_.uniform) alternatives += kExpected.alternatives;
    if (alternatives == 0) return;
    const int of_round = std::max(spp / kAlternativeMinima.shares.front(),
                                  std::min(kAlternativeMinima.least_of_round, spp));
    add(PhaseKind::kComparison, pixels_, std::max(of_round / 2, 2), 2 * (1 + alternatives),
        Carried::kNothing);
  }

  const FitProblem& problem_;
  const Strategy& strategy_;
  BlockSchedule blocks_;
  double pixels_;
  std::vector<PlannedRenders> plan_;
};

}  // namespace

const char* carried_text(Carried carried) {
  switch (carried) {
    case Carried::kNothing:
      return "none";
    case Carried::kDerivatives:
      return "scalars";
    case Carried::kFieldDerivatives:
      return "fields";
  }
  return "";
}

std::vector<PlannedRenders> schedule(const FitProblem& problem, const Strategy& strategy) {
  return Planner(problem, strategy).plan();
}

}  // namespace selenite
