// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/problem/fit_problem.h"

#include "math/problem_list.h"
#include "render/shape/shape_gradient.h"

namespace selenite {
namespace {

/// Runs all checks of a fit before the first of them ends it; returns the scene, for the constructor.
Scene checked(Scene scene, std::vector<Photo>& photos,
              const std::vector<UnknownParameter>& unknowns, const FitSettings& settings) {
  ProblemList problems;
  problems.collect([&] { check_photos(scene, photos); });
  problems.collect([&] { (void)Unknowns(scene, unknowns, photos); });
  problems.collect([&] { (void)Fields(scene, unknowns); });
  problems.collect([&] { settings.check(); });
  for (const UnknownParameter& one : unknowns)
    if (one.parameter == kVertexPositions && unknowns.size() > 1)
      problems.add({one.name(), "vertices move alone, while all else keeps its values",
                    "fit them in a stage of their own"});
  problems.raise();
  if (const Loss& loss = find_loss(settings.loss); loss.check)
    for (const Photo& photo : photos) problems.collect([&] { loss.check(photo); });
  problems.raise();
  return scene;
}

}  // namespace

FitProblem::FitProblem(Scene scene, std::vector<Photo> photos,
                       const std::vector<UnknownParameter>& unknowns, FitSettings settings)
    : scene_(checked(std::move(scene), photos, unknowns, settings)),
      photos_(std::move(photos)),
      wanted_(unknowns),
      unknowns_(scene_, unknowns, photos_),
      fields_(scene_, unknowns),
      settings_(std::move(settings)),
      loss_(find_loss(settings_.loss)),
      layout_(unknowns_.layout(scene_)),
      problem_{unknowns_, layout_, photos_, loss_, settings_.iterations} {
  problem_.threads = settings_.threads;
  if (settings_.finite_differences) differences_ = std::make_unique<Reparametrization>(unknowns_);
}

std::unique_ptr<UniformFields> FitProblem::uniform() const {
  return UniformFields::of(scene_, wanted_, fields_, photos_, loss_, settings_.iterations);
}

Scene FitProblem::scene_at(const Point& point) const {
  return fields_.scene_with(scene_at(point.scalars), point.fields);
}

std::string FitProblem::fingerprint() const {
  std::string text = settings_.loss;
  for (const std::int64_t number :
       {static_cast<std::int64_t>(settings_.seed), std::int64_t{settings_.iterations},
        std::int64_t{settings_.chosen_most_iterations()}, std::int64_t{settings_.spp},
        std::int64_t{settings_.depth}, std::int64_t{settings_.accumulate},
        std::int64_t{settings_.validation_interval},
        std::int64_t{settings_.chosen_validation_spp()},
        std::int64_t{settings_.chosen_refinement_spp()},
        std::int64_t{settings_.finite_differences}})
    text += " " + std::to_string(number);
  text += " " + settings_.search + " " + settings_.refinement + " " +
          std::to_string(settings_.precision);
  for (const Component& component : unknowns_.components()) text += "\n" + component.name;
  for (std::size_t f = 0; f < fields_.names().size(); ++f)
    text += "\n" + fields_.names()[f] + " " + std::to_string(fields_.start()[f].size());
  for (const Photo& photo : photos_) text += "\n" + std::to_string(photo.fingerprint());
  return text;
}

}  // namespace selenite
