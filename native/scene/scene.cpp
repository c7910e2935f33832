// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/scene.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "math/error.h"
#include "scene/parameter_table.h"

namespace selenite {
namespace {

/// Those of MaterialValues before the medium's.
constexpr int kSurfaceFields = material_field(&MaterialValues::extinction);

/// End the names of images of a parameter, and of a node.
constexpr std::string_view kTexture = "_texture", kImage = ".image";

constexpr const char* kNoSuchKind = "There is no such kind of owner or grid in a scene";

const ParameterTable& table(OwnerKind kind) {
  static const auto material = ParameterTable::of<MaterialValues>();
  static const auto light = ParameterTable::of<LightParameters>();
  static const auto world = ParameterTable::of<WorldParameters>();
  switch (kind) {
    case OwnerKind::kMaterial:
      return material;
    case OwnerKind::kLight:
      return light;
    case OwnerKind::kWorld:
      return world;
  }
  throw InvalidArgument(kNoSuchKind);
}

template <class Action>
void visit_parameter(Appearance& appearance, const ParameterRef& ref, Action&& action) {
  switch (ref.kind) {
    case OwnerKind::kMaterial: {
      Material& material = appearance.materials.at(ref.owner);
      const int constant = shader_constant(ref.field);
      if (constant < 0) return visit_field(material.values, ref.field, action);
      const int width = material.shader->constants.at(constant).width;
      Color<double>& color = material.constants.at(constant);
      action(&color.r, width);
      if (width == 1) color.g = color.b = color.r;
      return;
    }
    case OwnerKind::kLight:  // one lamp may stand at several places
      for (Light& light : appearance.lights)
        if (light.name == appearance.lights.at(ref.owner).name)
          visit_field(light.values, ref.field, action);
      return;
    case OwnerKind::kWorld:
      return visit_field(appearance.world.values, ref.field, action);
  }
}

void require_constant(const Material& material, int field) {
  if (shader_constant(field) >= 0) return;
  const std::string name =
      material.name + ":" + std::string(table(OwnerKind::kMaterial).rows.at(field).name);
  if (const FieldMap* map = material.map_of(field))
    throw InvalidArgument(name + " comes from " +
                          (map->texture ? "image '" + map->texture->name() + "'"
                                        : "colour attribute '" + map->attribute + "'") +
                          "; give it one value");
  if (material.albedo_grid && field == material_field(&MaterialValues::albedo))
    throw InvalidArgument(name + " comes from grid '" + material.albedo_grid.grid->name() +
                          "'; fit albedo_grid, or take the grid away");
}

template <class AnyMaterial>
auto& grid_of(AnyMaterial& material, GridKind kind) {
  switch (kind) {
    case GridKind::kAlbedo:
      return material.albedo_grid;
    case GridKind::kDensity:
      return material.density_grid;
  }
  throw InvalidArgument(kNoSuchKind);
}

template <class Range, class Name>
std::string listed(const Range& range, Name&& name) {
  std::string text;
  for (const auto& item : range)
    text += (text.empty() ? "'" : ", '") + std::string(name(item)) + "'";
  return text.empty() ? "none" : text;
}

/// The number of a parameter; -1: there is none. A shader takes the place of the surface's fields.
int field_of(const Material& material, std::string_view name) {
  if (material.shader) {
    const auto& constants = material.shader->constants;
    for (std::size_t i = 0; i < constants.size(); ++i)
      if (constants[i].parameter.name == name) return constant_field(static_cast<int>(i));
  }
  const int field = table(OwnerKind::kMaterial).find(name);
  return material.shader && field < kSurfaceFields ? -1 : field;
}

std::vector<std::string_view> names_of(const Material& material) {
  std::vector<std::string_view> names;
  if (material.shader)
    for (const ShaderConstant& constant : material.shader->constants)
      names.push_back(constant.parameter.name);
  const auto& rows = table(OwnerKind::kMaterial).rows;
  for (std::size_t i = material.shader ? kSurfaceFields : 0; i < rows.size(); ++i)
    names.push_back(rows[i].name);
  return names;
}

/// The parameter of a surface whose image has this name; -1: none.
int image_field(std::string_view name) {
  if (!name.ends_with(kTexture)) return -1;
  name.remove_suffix(kTexture.size());
  const int field = table(OwnerKind::kMaterial).find(name);
  return field < kSurfaceFields ? field : -1;
}

}  // namespace

int constant_field(int constant) {
  return static_cast<int>(table(OwnerKind::kMaterial).rows.size()) + constant;
}
int shader_constant(int field) {
  return std::max(field - static_cast<int>(table(OwnerKind::kMaterial).rows.size()), -1);
}

const std::vector<Parameter>& parameter_table(OwnerKind kind) { return table(kind).rows; }
const std::vector<int>& parameter_widths(OwnerKind kind) { return table(kind).widths; }

void check_value(std::string_view owner, const Parameter& p, double value) {
  if (value >= p.lower && value <= p.upper) return;  // false for NaN
  std::ostringstream text;
  text << owner << ':' << p.name << " = " << value << " lies outside [" << p.lower << ", "
       << p.upper << "]; give a value inside";
  throw InvalidArgument(text.str());
}

const Camera& Scene::camera(std::string_view name) const {
  for (const Camera& c : cameras)
    if (c.name == name) return c;
  throw UnknownName("Camera '" + std::string(name) + "' is not in the scene; cameras: " +
                    listed(cameras, [](const Camera& c) { return c.name; }));
}

ParameterRef Scene::find(std::string_view owner, std::string_view parameter) const {
  ParameterRef ref{OwnerKind::kWorld, -1, -1};
  for (std::size_t i = 0; i < appearance.materials.size(); ++i)
    if (appearance.materials[i].name == owner)
      ref = {OwnerKind::kMaterial, static_cast<int>(i), -1};
  if (ref.owner < 0)
    for (std::size_t i = appearance.lights.size(); i-- > 0;)  // the first of a lamp's places
      if (appearance.lights[i].name == owner) ref = {OwnerKind::kLight, static_cast<int>(i), -1};
  if (ref.owner < 0 && owner == kWorldName) ref.owner = 0;
  if (ref.owner < 0)
    throw UnknownName(
        "'" + std::string(owner) + "' is no material or light of the scene; materials: " +
        listed(appearance.materials, [](const Material& m) { return m.name; }) + "; lights: " +
        listed(appearance.lights, [](const Light& l) { return l.name; }) + "; or 'World'");
  const Material* material =
      ref.kind == OwnerKind::kMaterial ? &appearance.materials[ref.owner] : nullptr;
  ref.field = material ? field_of(*material, parameter) : table(ref.kind).find(parameter);
  if (ref.field >= 0) return ref;
  std::vector<std::string_view> names;
  if (material)
    names = names_of(*material);
  else
    for (const Parameter& p : parameter_table(ref.kind)) names.push_back(p.name);
  throw UnknownName("'" + std::string(owner) + "' has no parameter '" + std::string(parameter) +
                    "'; it has: " + listed(names, [](std::string_view name) { return name; }));
}

std::string Scene::owner_name(const ParameterRef& ref) const {
  switch (ref.kind) {
    case OwnerKind::kMaterial:
      return appearance.materials.at(ref.owner).name;
    case OwnerKind::kLight:
      return appearance.lights.at(ref.owner).name;
    case OwnerKind::kWorld:
      return kWorldName;
  }
  throw InvalidArgument(kNoSuchKind);
}

const Parameter& Scene::description(const ParameterRef& ref) const {
  if (ref.kind == OwnerKind::kMaterial)
    if (const int constant = shader_constant(ref.field); constant >= 0)
      return appearance.materials.at(ref.owner).shader->constants.at(constant).parameter;
  return parameter_table(ref.kind).at(ref.field);
}

int Scene::width(const ParameterRef& ref) const {
  if (ref.kind == OwnerKind::kMaterial)
    if (const int constant = shader_constant(ref.field); constant >= 0)
      return appearance.materials.at(ref.owner).shader->constants.at(constant).width;
  return parameter_widths(ref.kind).at(ref.field);
}

void Scene::require_constant(const ParameterRef& ref) const {
  switch (ref.kind) {
    case OwnerKind::kMaterial:
      return selenite::require_constant(appearance.materials.at(ref.owner), ref.field);
    case OwnerKind::kLight:
      return;
    case OwnerKind::kWorld:
      if (ref.field == field_index<WorldParameters>(&WorldParameters::rotation) &&
          !appearance.world.map)
        throw InvalidArgument(
            "World:rotation: the world has no image to be rotated; give it one, or leave it out");
      return;
  }
}

int Scene::material(std::string_view name) const {
  for (std::size_t i = 0; i < appearance.materials.size(); ++i)
    if (appearance.materials[i].name == name) return static_cast<int>(i);
  throw UnknownName("'" + std::string(name) + "' is no material of the scene; materials: " +
                    listed(appearance.materials, [](const Material& m) { return m.name; }));
}

void check_grids(const Material& material) {
  const std::string who = "Material '" + material.name + "': ";
  if (const auto& grid = material.albedo_grid.grid; grid && grid->maximum() > 1)
    throw InvalidArgument(who + "albedo grid '" + grid->name() + "' reaches " +
                          std::to_string(grid->maximum()) +
                          ", outside [0, 1]; give shares of the light that is scattered");
  if (const auto& grid = material.density_grid.grid; grid && grid->channels() != 1)
    throw InvalidArgument(who + "density grid '" + grid->name() +
                          "' holds colours; give one number a voxel");
  for (const PlacedGrid* placed : {&material.albedo_grid, &material.density_grid}) {
    if (!*placed) continue;
    const double determinant = placed->to_unit.determinant();
    if (!std::isfinite(determinant) || determinant == 0)
      throw InvalidArgument(who + "the matrix that places grid '" + placed->grid->name() +
                            "' has determinant " + std::to_string(determinant) +
                            "; give one that can be inverted");
  }
}

const char* grid_name(GridKind kind) {
  switch (kind) {
    case GridKind::kAlbedo:
      return "albedo_grid";
    case GridKind::kDensity:
      return "density_grid";
  }
  throw InvalidArgument(kNoSuchKind);
}

const PlacedGrid& Material::grid(GridKind kind) const { return grid_of(*this, kind); }
PlacedGrid& Material::grid(GridKind kind) { return grid_of(*this, kind); }

const FieldMap* Material::map_of(int field) const {
  const auto found =
      std::find_if(maps.begin(), maps.end(), [&](const FieldMap& m) { return m.field == field; });
  return found == maps.end() ? nullptr : &*found;
}

const PlacedGrid& Scene::grid(const GridRef& ref) const {
  const Material& material = appearance.materials.at(static_cast<std::size_t>(ref.material));
  const PlacedGrid& placed = material.grid(ref.kind);
  if (!placed)
    throw InvalidArgument("Material '" + material.name + "' has no " + grid_name(ref.kind) +
                          "; give it one when the scene is built");
  return placed;
}

bool is_image_name(std::string_view name) {
  return name.ends_with(kImage) || image_field(name) >= 0;
}

ImageRef Scene::image_named(int number, std::string_view name) const {
  const Material& material = appearance.materials.at(static_cast<std::size_t>(number));
  for (std::size_t i = 0; i < material.images.size(); ++i)
    if (material.images[i].name == name) return {number, constant_field(static_cast<int>(i))};
  const int field = image_field(name);
  if (field >= 0) return {number, field};
  throw UnknownName("'" + material.name + "' has no image '" + std::string(name) +
                    "'; its shader has: " +
                    listed(material.images, [](const ShaderImage& image) { return image.name; }));
}

std::string Scene::image_name(const ImageRef& ref) const {
  const int own = shader_constant(ref.field);
  if (own >= 0)
    return appearance.materials.at(static_cast<std::size_t>(ref.material)).images.at(own).name;
  return std::string(table(OwnerKind::kMaterial).rows.at(ref.field).name) + std::string(kTexture);
}

int Scene::object(std::string_view name) const {
  const auto& instances = geometry->instances();
  for (std::size_t i = 0; i < instances.size(); ++i)
    if (instances[i].name == name) return static_cast<int>(i);
  throw UnknownName("'" + std::string(name) + "' is no object of the scene; objects: " +
                    listed(instances, [](const Instance& o) { return o.name; }));
}

const FieldMap& Scene::image(const ImageRef& ref) const {
  const Material& material = appearance.materials.at(static_cast<std::size_t>(ref.material));
  const std::string who = material.name + ":" + image_name(ref) + ": ";
  const int own = shader_constant(ref.field);
  const FieldMap* image = own >= 0 ? &material.images.at(own).map : material.map_of(ref.field);
  if (!image || !image->texture) {
    const std::string name(table(OwnerKind::kMaterial).rows.at(ref.field).name);
    throw InvalidArgument(who + "no image gives " + name + "; name " + name + ", or link an image");
  }
  if (image->texture->has_alpha())
    throw InvalidArgument(who + "image '" + image->texture->name() +
                          "' has alpha; set its Alpha to None or Channel Packed");
  return *image;
}

Scene Scene::with_grid(const GridRef& ref, std::vector<float> values) const {
  auto changed = std::make_shared<Grid>(grid(ref).grid->with(std::move(values)));
  Scene scene = *this;
  Material& material = scene.appearance.materials.at(static_cast<std::size_t>(ref.material));
  material.grid(ref.kind).grid = std::move(changed);
  check_grids(material);
  return scene;
}

Scene Scene::with_image(const ImageRef& ref, std::vector<Colorf> pixels) const {
  const FieldMap& from = image(ref);
  Scene scene = *this;
  Material& material = scene.appearance.materials.at(static_cast<std::size_t>(ref.material));
  auto texture = std::make_shared<Texture>(from.texture->with(std::move(pixels)));
  if (const int own = shader_constant(ref.field); own >= 0) {
    auto shader = std::make_shared<Shader>(*material.shader);
    shader->textures.at(static_cast<std::size_t>(from.field)) = texture;
    material.shader = std::move(shader);
    material.images.at(own).map.texture = std::move(texture);
    return scene;
  }
  FieldMap& map = material.maps[static_cast<std::size_t>(
      &from - appearance.materials[static_cast<std::size_t>(ref.material)].maps.data())];
  map.texture = std::move(texture);
  return scene;
}

int Scene::channels(const ImageRef& ref) const {
  const int own = shader_constant(ref.field);
  return own < 0 ? parameter_widths(OwnerKind::kMaterial).at(ref.field)
                 : appearance.materials.at(static_cast<std::size_t>(ref.material))
                       .images.at(own)
                       .channels;
}

const VertexColors& Scene::vertex_colors(const VertexColorsRef& ref) const {
  const VertexColors* found = nullptr;
  for (const auto& one : appearance.mesh_colors) {
    if (one->mesh() != ref.mesh) continue;
    if (found)
      throw InvalidArgument("Mesh '" + geometry->meshes().at(ref.mesh).name +
                            "': its materials look up the colour attributes '" +
                            found->attribute() + "' and '" + one->attribute() +
                            "'; let them look up one");
    found = one.get();
  }
  if (!found)
    throw InvalidArgument("Mesh '" + geometry->meshes().at(ref.mesh).name +
                          "': its materials look up no colour attribute that it has; link a Color "
                          "Attribute to the Base Color");
  return *found;
}

Scene Scene::with_vertex_colors(const VertexColorsRef& ref, std::vector<Colorf> values) const {
  const VertexColors& from = vertex_colors(ref);
  if (values.size() != from.values().size())
    throw InvalidArgument("Colour attribute '" + from.attribute() + "' has " +
                          std::to_string(from.values().size()) + " values, not " +
                          std::to_string(values.size()));
  Scene scene = *this;
  for (auto& one : scene.appearance.mesh_colors)
    if (one.get() == &from) {
      one = std::make_shared<const VertexColors>(from.with(std::move(values)));
      break;
    }
  return scene;
}

const EnvironmentMap& Scene::environment() const {
  const World& world = appearance.world;
  const std::string who = std::string(kWorldName) + ":" + kEnvironment + ": ";
  if (!world.map) throw InvalidArgument(who + "the world has no image; give it one, or name color");
  for (int c = 0; c < 3; ++c)
    if (world.values.color[c] != 1)
      throw InvalidArgument(who + "the world's colour (" + std::to_string(world.values.color[c]) +
                            " in channel " + std::to_string(c) +
                            ") tints its image; set it to 1, 1, 1");
  return *world.map;
}

Scene Scene::with_environment(std::vector<Colorf> pixels) const {
  const EnvironmentMap& from = environment();
  for (std::size_t i = 0; i < pixels.size(); ++i)
    for (int c = 0; c < 3; ++c)
      if (!(pixels[i][c] >= 0))
        throw InvalidArgument("World image: pixel " + std::to_string(i) + " holds " +
                              std::to_string(pixels[i][c]) + "; give radiance from 0 up");
  Scene scene = *this;
  scene.appearance.world.map = std::make_shared<EnvironmentMap>(
      from.width(), from.height(), std::move(pixels), EnvironmentMap::kUnknownEven);
  return scene;
}

std::vector<double> Scene::get(const ParameterRef& ref) const {
  std::vector<double> values;
  Appearance copy = appearance;  // `fields` visits references to non-const members
  visit_parameter(copy, ref,
                  [&](const double* first, int count) { values.assign(first, first + count); });
  return values;
}

Scene Scene::with(const std::vector<std::pair<ParameterRef, std::vector<double>>>& values) const {
  Scene scene = *this;
  for (const auto& [ref, numbers] : values) {
    require_constant(ref);
    const Parameter& p = description(ref);
    const std::string owner = owner_name(ref);
    const int width = this->width(ref);
    if (static_cast<int>(numbers.size()) != width)
      throw InvalidArgument(owner + ":" + std::string(p.name) + " takes " + std::to_string(width) +
                            " numbers, not " + std::to_string(numbers.size()));
    for (double x : numbers) check_value(owner, p, x);
    visit_parameter(scene.appearance, ref, [&source = numbers](double* first, int count) {
      for (int i = 0; i < count; ++i) first[i] = source[i];
    });
  }
  return scene;
}

}  // namespace selenite
