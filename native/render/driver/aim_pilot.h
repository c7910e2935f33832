// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "render/driver/progress.h"
#include "render/film/render_settings.h"
#include "render/film/slots.h"
#include "scene/scene.h"

namespace selenite {

/// What pilots have found, for lamps that look alike from the body.
struct AimVerdict {
  float solid_angle;  ///< sr
  bool beside_world;  ///< with the world on
  bool aimed;
};

/// Whether it is open for a lamp of the scene if paths inside bodies with a medium aim at it (see
/// RefractedLight), and the picture's noise depends on it.
bool has_undecided_aims(const Scene& scene);

/// The scene with that decided for all of its lamps. A pilot renders a few pixels of the bodies with aims,
/// which also says what the variance would be without (AimExcess). It compares variance times cost, of the
/// picture and of the derivatives of `layout`.
/// Costs are counts of the work times measured constants, so the decision is the same on any machine.
/// The pilot has the shape, depth and threads of the picture `like`. `verdicts`: of earlier pilots, which
/// are taken over and added to; null: none. Throws Cancelled.
Scene decide_aims(Scene scene, const Camera& camera, const SlotLayout& layout,
                  const RenderSettings& like, std::vector<AimVerdict>* verdicts = nullptr,
                  Progress* progress = nullptr);

/// Steradians, as if the lamp and the place faced each other; 0 without size.
float solid_angle_of(const Light& lamp, const Vec3f& place);

}  // namespace selenite
