// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/state/render_plan.h"

#include <algorithm>

#include "fit/evaluate/rendered_pixels.h"

namespace selenite {

const char* carried_text(Carried carried) {
  switch (carried) {
    case Carried::kNothing:
      return "none";
    case Carried::kDerivatives:
      return "scalars";
    case Carried::kFieldDerivatives:
      return "fields";
    case Carried::kShapeDerivatives:
      return "shape";
  }
  return "";
}

double pixels_of(const std::vector<Photo>& photos) {
  double sum = 0;
  for (const Photo& photo : photos) sum += rendered_count(photo);
  return sum;
}

void RenderPlan::add(PhaseKind phase, double of_pixels, int spp, double renders, Carried carried) {
  if (renders == 0) return;
  const auto same = std::ranges::find_if(renders_, [&](const PlannedRenders& one) {
    return one.phase == phase && one.pixels == of_pixels && one.spp == spp &&
           one.carried == carried;
  });
  if (same != renders_.end())
    same->renders += renders;
  else
    renders_.push_back({phase, of_pixels, spp, renders, carried});
}

void RenderPlan::add(PhaseKind phase, double of_pixels, int spp, double times,
                     const Renders& renders) {
  add(phase, of_pixels, spp, times * renders.plain, Carried::kNothing);
  add(phase, of_pixels, spp, times * renders.carrying, Carried::kDerivatives);
}

void RenderPlan::validate(PhaseKind phase, double times) {
  add(phase, pixels, problem.settings().chosen_validation_spp(), times, Carried::kNothing);
}

/// Asks the code that renders derivatives, with films of one pixel in place of renders.
RenderPlan::Renders RenderPlan::renders_of(const SceneModel& model, const Point& point,
                                           Purpose purpose, const Differences& which) {
  Renders count;
  (void)render_derivatives(model.problem, model.differences, model.scene_at(point),
                           model.problem.photos.front(), point.scalars, purpose, which,
                           [&](const Vector&, const SlotLayout& layout, Paths) {
                             ++(layout.slots.empty() ? count.plain : count.carrying);
                             return Film(1, 1, 2, static_cast<int>(layout.slots.size()));
                           });
  return count;
}

RenderPlan::Renders RenderPlan::renders_of(Purpose purpose, const Differences& which) const {
  return renders_of(scene_model(problem), problem.start(), purpose, which);
}

int RenderPlan::count_of(Scale scale) const {
  const auto& all = problem.unknowns().descriptions();
  return static_cast<int>(
      std::ranges::count_if(all, [&](const Parameter& one) { return one.scale == scale; }));
}

}  // namespace selenite
