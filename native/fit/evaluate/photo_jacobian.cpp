// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/evaluate/photo_jacobian.h"

#include "fit/evaluate/finite_differences.h"
#include "math/error.h"

namespace selenite {

PhotoJacobian photo_jacobian(const Scene& scene, const Unknowns& unknowns, const std::string& camera,
          const RenderSettings& settings, Progress* progress) {
  if (settings.spp < 2)
    throw InvalidArgument("A look of " + std::to_string(settings.spp) +
                          " samples a pixel has no second half; give spp of at least 2");
  const SlotLayout layout(scene, unknowns.parameters());
  const Reparametrization reparametrization(unknowns);
  Photo black;  // residuals are not asked for
  black.camera = camera;
  black.width = settings.width;
  black.height = settings.height;
  black.reference.resize(static_cast<std::size_t>(settings.width) * settings.height);
  const std::vector<Photo> photos{black};
  const Problem problem{unknowns, layout, photos, losses()[0], 1};
  const Vector& x = unknowns.start();
  Film film = render_derivatives(
      problem, &reparametrization, unknowns.scene_with(scene, x), x, Purpose::kInstrumental, {Side::kUp},
      [&](const Vector& at, const SlotLayout& slots, Paths) {
        const Scene there = unknowns.scene_with(scene, at);
        return render(there, there.camera(camera), slots, settings, progress);
      });
  Observation seen{0, std::move(film), {}};
  Halves halves = split_halves(problem, seen, reparametrization.slope(x));
  return {std::move(seen.film), std::move(halves.jacobian_a), std::move(halves.jacobian_b)};
}

}  // namespace selenite
