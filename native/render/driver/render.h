// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "render/driver/progress.h"
#include "render/film/film.h"
#include "render/film/render_settings.h"
#include "render/film/slots.h"
#include "scene/scene.h"

namespace selenite {

/// Image, variance and, for the parameters of `layout`, the per-pixel Jacobian in the same pass.
///
/// Unbiased; detached sampling (directions are drawn at the scene's values and carry no derivative;
/// f and df are both divided by the same density). The result depends on scene, camera, layout and
/// settings, not on `threads`. Different seeds give independent pictures.
/// Throws Cancelled (polled per tile), InvalidArgument.
Film render(const Scene& scene, const Camera& camera, const SlotLayout& layout,
            const RenderSettings& settings, Progress* progress = nullptr);

}  // namespace selenite
