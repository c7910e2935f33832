// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/scene_builder.h"

#include <algorithm>

#include "math/error.h"

namespace selenite {
namespace {

template <class List>
void require_new_name(const List& list, const std::string& name, const char* kind) {
  for (const auto& item : list)
    if (item.name == name)
      throw InvalidArgument(std::string(kind) + " '" + name +
                            "' was added twice; names must differ");
}

template <class Item, class List>
int append(List& list, Item&& item) {
  list.push_back(std::forward<Item>(item));
  return static_cast<int>(list.size()) - 1;
}

/// What a fit can change is the same at all places of a lamp.
void require_one_lamp(const Light& first, const Light& other) {
  const LightParameters &a = first.values, &b = other.values;
  if (a.power != b.power || !(a.color == b.color) || first.kind != other.kind)
    throw InvalidArgument(
        "Light '" + other.name +
        "' was added twice with another kind, power or colour; give lights of one "
        "name the same, or another name");
}

std::string count_of(std::size_t n) { return std::to_string(n); }

}  // namespace

int SceneBuilder::add_material(Material material) {
  require_new_name(appearance.materials, material.name, "Material");
  struct Check {
    const std::string& owner;
    void operator()(const Parameter& p, double& x) const { check_value(owner, p, x); }
    void operator()(const Parameter& p, Color<double>& c) const {
      for (int i = 0; i < 3; ++i) check_value(owner, p, c[i]);
    }
  };
  MaterialParameters<double>::fields(material.values, Check{material.name});
  check_grids(material);
  return append(appearance.materials, std::move(material));
}

int SceneBuilder::add_mesh(Mesh mesh) {
  const std::string who = "Mesh '" + mesh.name + "': ";
  const std::size_t n = mesh.triangles.size();
  for (const auto& t : mesh.triangles)
    for (int corner : t)
      if (corner < 0 || corner >= static_cast<int>(mesh.positions.size()))
        throw InvalidArgument(who + "vertex index " + std::to_string(corner) +
                              " lies outside [0, " + count_of(mesh.positions.size()) + ")");
  if (mesh.corner_normals.size() != 3 * n)
    throw InvalidArgument(who + count_of(mesh.corner_normals.size()) + " corner normals for " +
                          count_of(n) + " triangles; give three a triangle");
  const auto check_corners = [&](const auto& lists, const char* what) {
    for (const auto& list : lists)
      if (list.values.size() != 3 * n)
        throw InvalidArgument(who + what + " '" + list.name + "' has " +
                              count_of(list.values.size()) + " values for " + count_of(n) +
                              " triangles; give three a triangle");
  };
  check_corners(mesh.uvs, "UV map");
  check_corners(mesh.colors, "colour attribute");
  check_corners(mesh.vectors, "corner vectors");
  for (const auto& list : mesh.colors)
    if (!list.elements.empty() && list.elements.size() != 3 * n)
      throw InvalidArgument(who + "colour attribute '" + list.name + "' has " +
                            count_of(list.elements.size()) + " elements for " + count_of(n) +
                            " triangles; give three a triangle");
  if (mesh.material_slots.size() != n)
    throw InvalidArgument(who + count_of(mesh.material_slots.size()) + " material slots for " +
                          count_of(n) + " triangles; give one a triangle");
  return append(meshes, std::move(mesh));
}

int SceneBuilder::add_object(Instance instance) {
  const std::string who = "Object '" + instance.name + "': ";
  if (instance.mesh < 0 || instance.mesh >= static_cast<int>(meshes.size()))
    throw InvalidArgument(who + "mesh " + std::to_string(instance.mesh) + " was not added");
  for (int m : instance.materials)
    if (m < 0 || m >= static_cast<int>(appearance.materials.size()))
      throw InvalidArgument(who + "material " + std::to_string(m) + " was not added");
  for (int slot : meshes[instance.mesh].material_slots)
    if (slot < 0 || slot >= static_cast<int>(instance.materials.size()))
      throw InvalidArgument(who + "a face uses material slot " + std::to_string(slot) + " of " +
                            count_of(instance.materials.size()));
  for (const int set : {instance.lit_set, instance.shadow_set})
    if (set < 0 || set >= LinkedSets::kMost)
      throw InvalidArgument(who + "light linking set " + std::to_string(set) +
                            " lies outside [0, " + std::to_string(LinkedSets::kMost) + ")");
  const Vec3d at = instance.to_world.translation();
  if (!std::isfinite(at.x) || !std::isfinite(at.y) || !std::isfinite(at.z))
    throw InvalidArgument(who + "its location is not finite; give it a finite location");
  const double determinant = instance.to_world.determinant();
  if (!std::isfinite(determinant) || determinant == 0)
    throw InvalidArgument(who + "its matrix has determinant " + std::to_string(determinant) +
                          "; give it a scale other than 0 in every direction");
  return append(instances, std::move(instance));
}

int SceneBuilder::add_light(Light light) {
  for (const Light& other : appearance.lights)
    if (other.name == light.name) require_one_lamp(other, light);
  light.prepare({});  // checks; placed for good by `build`
  return append(appearance.lights, std::move(light));
}

int SceneBuilder::add_camera(Camera camera) {
  require_new_name(cameras, camera.name, "Camera");
  camera.check();
  return append(cameras, std::move(camera));
}

Scene SceneBuilder::build() const {
  appearance.world.check();
  std::vector<Vec3d> eyes;
  for (const Camera& camera : cameras) eyes.push_back(camera.to_world.translation());
  Scene scene{std::make_shared<Geometry>(meshes, instances, eyes), cameras, appearance};
  const Vec3d& origin = scene.geometry->origin();
  for (Light& light : scene.appearance.lights) light.prepare(origin);
  for (Material& material : scene.appearance.materials) {
    material.albedo_grid.move_origin(origin);
    material.density_grid.move_origin(origin);
  }
  for (Camera& camera : scene.cameras) camera.to_world.translate(-origin);
  const auto& built = scene.geometry->meshes();
  for (std::size_t m = 0; m < built.size(); ++m)
    for (const CornerData<Colorf>& list : built[m].colors)
      if (!list.elements.empty() && std::ranges::all_of(list.held, [](const Colorf& c) {
            return std::isfinite(c.r) && std::isfinite(c.g) && std::isfinite(c.b);
          }))
        scene.appearance.mesh_colors.push_back(std::make_shared<const VertexColors>(
            static_cast<int>(m), list.name, std::make_shared<const std::vector<int>>(list.elements),
            list.held));
  return scene;
}

}  // namespace selenite
