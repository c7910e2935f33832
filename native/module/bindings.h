// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <array>
#include <string>
#include <tuple>
#include <variant>
#include <vector>

#include "model/ray_kind.h"
#include "scene/camera.h"

namespace selenite {

struct Parameter;
struct Scene;
struct SceneBuilder;

/// A photo's frame as Python gives it: (aspect, width, height), and of a crop also its window,
/// (left, top, right, bottom).
using WholeFrame = std::tuple<double, int, int>;
using FrameTuple = std::variant<WholeFrame, std::tuple<double, int, int, std::array<double, 4>>>;
inline PhotoFrame frame_of(const FrameTuple& t) {
  if (const auto* whole = std::get_if<WholeFrame>(&t))
    return {std::get<0>(*whole), std::get<1>(*whole), std::get<2>(*whole)};
  const auto& [aspect, width, height, window] = std::get<1>(t);
  return {aspect, width, height, {window[0], window[1], window[2], window[3]}};
}

/// A set of kinds of rays from their names. UnknownName: one that is none.
RayKinds kinds_of(const std::string& who, const std::vector<std::string>& names);
void bind_parameters(pybind11::module_& m);
/// A parameter as Python has it, without its owner and width.
pybind11::dict parameter_row(const Parameter& parameter);
void bind_scene(pybind11::module_& m);
/// Materials and their textures.
void bind_materials(pybind11::class_<SceneBuilder>& builder);
/// What shaders compute in a scene, for tests.
void bind_shaders(pybind11::class_<Scene>& scene);
/// Objects, and what rays see of them and of lights.
void bind_visibility(pybind11::class_<SceneBuilder>& builder);
/// The world.
void bind_world(pybind11::class_<SceneBuilder>& builder);
/// Light states of a scene.
void bind_lights(pybind11::class_<Scene>& scene);
void bind_render(pybind11::module_& m);
/// Photos and unknowns.
void bind_photo(pybind11::module_& m);
/// What photos show of a scene.
void bind_evaluator(pybind11::module_& m);
void bind_fit(pybind11::module_& m);
/// What workers of a fit do.
void bind_workers(pybind11::module_& m);
/// What fits say of themselves.
void bind_fit_result(pybind11::module_& m);
/// Vertices of a scene's objects.
void bind_vertices(pybind11::class_<Scene>& scene);
void bind_photo_jacobian(pybind11::module_& m);
void bind_fisher_information(pybind11::module_& m);
void bind_schedule(pybind11::module_& m);
void bind_probe(pybind11::module_& m);

}  // namespace selenite
