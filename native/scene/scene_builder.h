// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "scene/scene.h"

namespace selenite {

/// Collects the parts of a scene in world coordinates; `build` checks them together, moves them to
/// the geometry's origin and makes the accelerator.
struct SceneBuilder {
  std::vector<Mesh> meshes;
  std::vector<Instance> instances;
  std::vector<Camera> cameras;
  std::vector<std::shared_ptr<const Texture>> textures;  ///< for the maps of materials
  Appearance appearance;

  int add_material(Material material);
  int add_mesh(Mesh mesh);
  int add_object(Instance instance);
  /// Lights of one name are one lamp at several places: their power and colour are the same, and a
  /// ParameterRef goes by the first of them.
  int add_light(Light light);
  int add_camera(Camera camera);
  Scene build() const;
};

}  // namespace selenite
