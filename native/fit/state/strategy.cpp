// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/state/strategy.h"

#include <algorithm>
#include <limits>
#include <string>

#include "fit/objective/photo_weights.h"
#include "fit/problem/pixel_weights.h"
#include "fit/solver/joint_gauss_newton.h"
#include "math/fault.h"

namespace selenite {
namespace {

/// Least model error of images alone in Gauss-Newton, where `dim_share_of_fields` makes all pixels bright: by the
/// usual one all count alike, however much noise they have. Measured: docs/measurements/fields.md, "Maps".
constexpr double kModelErrorOfImages = 0.01;
constexpr int kSamplesOfImages =
    4;  ///< of later iterations of images alone, in those of an iteration

bool any_on_surface(const Fields& fields) {
  for (std::size_t f = 0; f < fields.refs().size(); ++f)
    if (fields.on_surface(f)) return true;
  return false;
}

/// Whether scalars can be solved for beside the images: not beside a coarser lattice, which leaves errors of
/// single texels in the photos.
bool few_texels(const Fields& fields) {
  std::ptrdiff_t texels = 0;
  for (std::size_t f = 0; f < fields.refs().size(); ++f)
    if (const Texture* const image = fields.image(f)) texels += std::ssize(image->pixels());
  return texels <= FieldGaussNewtonOptions{}.most_texels;
}

/// Fields without scalars that are solved for as beside these: light is linear, and images nearly so.
bool solved_alone(const FitProblem& problem) {
  const Fields& fields = problem.fields();
  return problem.unknowns().size() == 0 && (fields.has_environment() || any_on_surface(fields)) &&
         JointGaussNewton::applies(fields, problem.photos());
}

/// Fields alone are stepped by Adam, unless they are solved for as beside scalars.
/// InvalidArgument: another optimiser is asked for.
const OptimiserKind& optimiser_of(const FitProblem& problem) {
  const FitSettings& settings = problem.settings();
  const auto choose = [&](const std::string& name) -> const OptimiserKind& {
    return choose_optimiser(name, problem.unknowns().size(), problem.loss(), settings.spp,
                            settings.accumulate);
  };
  if (problem.fields().vertices()) return choose("adam");
  if (problem.fields().empty() || problem.unknowns().size() > 0) return choose(settings.optimiser);
  if (solved_alone(problem)) return choose(settings.optimiser);
  if (settings.optimiser == "adam" || settings.optimiser == "auto") return choose("adam");
  throw Refused("",
                "optimiser = '" + settings.optimiser +
                    "' cannot fit a grid or an image, and nothing else is fitted",
                "choose optimiser = 'adam' or 'auto'");
}

bool wants_multi_start(const FitProblem& problem, const OptimiserKind& kind, bool uniform) {
  const FitSettings& settings = problem.settings();
  if (settings.search == "off" || problem.fields().vertices()) return false;
  const bool few = problem.fields().empty() ? problem.unknowns().size() <= kFewUnknowns : uniform;
  if (settings.search == "auto") return kind.few_unknowns && few;
  if (few) return true;
  throw Refused("",
                "search = 'on' is for up to " + std::to_string(kFewUnknowns) +
                    " unknowns, where an albedo grid or image that starts with one colour "
                    "counts as three and any other as too many",
                "choose search = 'off' or 'auto'");
}

bool wants_refinement(const FitProblem& problem, bool joint) {
  const FitSettings& settings = problem.settings();
  const int scalars = problem.unknowns().size();
  if ((joint && scalars == 0) || problem.fields().vertices()) return false;
  if (settings.refinement != "auto") return settings.refinement == "on";
  return (problem.fields().empty() || joint) && scalars <= kFewUnknowns &&
         problem.loss().least_squares &&
         choose_optimiser("auto", scalars, problem.loss(), settings.spp, settings.accumulate)
             .few_unknowns;
}

/// The mean brightness by which photos are judged where fields are fitted alone: that of the brightest of them,
/// as if all were parts of one picture, so that no dark photo rules. Photos whose exposures are to be
/// found may be dark by those alone: each is judged by its own.
double common_brightness(const std::vector<Photo>& photos) {
  double most = 0;
  for (const Photo& photo : photos) {
    if (photo.gain_freedom != GainFreedom::kNone) return 0;
    most = std::max(most, mean_brightness(photo));
  }
  return most;
}

}  // namespace

Strategy::Strategy(FitProblem& problem)
    : optimiser(optimiser_of(problem)),
      moves_vertices(problem.fields().vertices() != nullptr),
      alternates(!problem.fields().empty() && optimiser.few_unknowns),
      has_images(any_on_surface(problem.fields())),
      has_environment(problem.fields().has_environment()) {
  const FitSettings& settings = problem.settings();
  if (alternates && settings.search != "off") uniform = problem.uniform();
  multi_start = wants_multi_start(problem, optimiser, uniform != nullptr);
  joint = alternates && settings.accumulate &&
          (has_environment || solved_alone(problem) ||
           (after_multi_start() && few_texels(problem.fields()))) &&
          JointGaussNewton::applies(problem.fields(), problem.photos());
  refines = wants_refinement(problem, joint);
  PixelWeightsOptions weights;
  const bool images_alone = has_images && problem.unknowns().size() == 0;
  if (!problem.fields().empty() && (!joint || images_alone)) {
    weights.dim_share = weights.dim_share_of_fields;  // no dark pixel rules
    if (joint) weights.model_error = kModelErrorOfImages;
    weights.black = std::max(weights.black, common_brightness(problem.photos()));
    weights.plain_model_error = std::numeric_limits<double>::infinity();
  }
  problem.set_weights(
      std::make_shared<PhotoWeights>(problem.photos(), problem.loss().weighted, weights));
  if (most_iterations(problem) > settings.iterations) problem.set_goes_on();
  if (!alternates) return;
  // Damping falls over the blocks that a fit without a multi-start would have.
  const BlockSchedule usual({true, true, false, false}, settings.iterations);
  problem.set_scalar_iterations(usual.count(&Block::scalars, settings.iterations));
}

/// Fields have their steps planned over all iterations; what does not converge has no end to wait for.
int Strategy::most_iterations(const FitProblem& problem) const {
  const bool ends = refines && problem.fields().empty() && optimiser.averages_iterations;
  return ends ? problem.settings().chosen_most_iterations() : blocks(problem).iterations();
}

/// Images alone are nearly linear: few iterations find them, and samples limit what the others add.
/// Measured: docs/measurements/fields.md, "Maps".
int Strategy::samples(const FitProblem& problem, int iteration) const {
  if (!joint || !has_images || problem.unknowns().size() > 0) return 1;
  return iteration < problem.settings().iterations / 4 ? 1 : kSamplesOfImages;
}

BlockSchedule Strategy::blocks(const FitProblem& problem) const {
  const int all = problem.settings().iterations;
  const bool shortened = joint && refines && !has_environment, images = joint && has_images;
  const int share = shortened ? (images ? 4 : 2) : 1;
  return {{alternates, !problem.fields().empty(), after_multi_start(), joint, has_environment,
           problem.unknowns().size() > 0, images, images && refines},
          (all + share - 1) / share};
}

}  // namespace selenite
