// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

#include <tuple>

#include "scene/camera.h"

namespace selenite {

struct Scene;
struct SceneBuilder;

/// A photo's frame as Python gives it: (aspect, width, height).
using FrameTuple = std::tuple<double, int, int>;
inline PhotoFrame frame_of(const FrameTuple& t) {
  return {std::get<0>(t), std::get<1>(t), std::get<2>(t)};
}

void bind_parameters(pybind11::module_& m);
void bind_scene(pybind11::module_& m);
/// Objects, and what rays see of them and of lights.
void bind_visibility(pybind11::class_<SceneBuilder>& builder);
/// Light states of a scene.
void bind_lights(pybind11::class_<Scene>& scene);
void bind_render(pybind11::module_& m);
void bind_fit(pybind11::module_& m);
void bind_photo_jacobian(pybind11::module_& m);
void bind_fisher_information(pybind11::module_& m);
void bind_schedule(pybind11::module_& m);
void bind_probe(pybind11::module_& m);

}  // namespace selenite
