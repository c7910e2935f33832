// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/problem/uniform_fields.h"

#include <algorithm>
#include <variant>

namespace selenite {
namespace {

bool is_uniform(const Vector& values, int channels) {
  for (Eigen::Index i = channels; i < values.size(); ++i)
    if (values[i] != values[i % channels]) return false;
  return true;
}

std::string name_of(int field) {
  return std::string(parameter_table(OwnerKind::kMaterial)[static_cast<std::size_t>(field)].name);
}

}  // namespace

Color<double> UniformFields::Colour::stored(const Color<double>& linear) const {
  return image ? Color<double>(image->encode(Colorf(linear))) : linear;
}

Color<double> UniformFields::Colour::linear(const Color<double>& stored) const {
  return image ? Color<double>(image->decode(Colorf(stored))) : stored;
}

std::optional<UniformFields::Colour> UniformFields::colour_of(const Scene& scene, std::size_t field,
                                                              const ImageRef& ref) {
  if (shader_constant(ref.field) >= 0) return std::nullopt;  // no one parameter is like it
  const Material& material = scene.appearance.materials[static_cast<std::size_t>(ref.material)];
  return Colour{field,     material.name,           name_of(ref.field), scene.channels(ref),
                ref.field, scene.image(ref).texture};
}

std::optional<UniformFields::Colour> UniformFields::colour_of(const Scene& scene, std::size_t field,
                                                              const GridRef& ref) {
  if (ref.kind != GridKind::kAlbedo) return std::nullopt;
  const Material& material = scene.appearance.materials[static_cast<std::size_t>(ref.material)];
  return Colour{field, material.name, "albedo", 3};
}

std::optional<UniformFields::Colour> UniformFields::colour_of(const Scene&, std::size_t field,
                                                              const EnvironmentRef&) {
  return Colour{field, kWorldName, "color", 3, -1, nullptr, true};
}

/// Where one map of one material shows them, and no other mesh has that material.
std::optional<UniformFields::Colour> UniformFields::colour_of(const Scene& scene, std::size_t field,
                                                              const VertexColorsRef& ref) {
  std::optional<Colour> found;
  const auto& materials = scene.appearance.materials;
  for (std::size_t m = 0; m < materials.size(); ++m) {
    bool here = false, elsewhere = false;
    for (const Instance& instance : scene.geometry->instances())
      if (std::ranges::find(instance.materials, static_cast<int>(m)) != instance.materials.end())
        (instance.mesh == ref.mesh ? here : elsewhere) = true;
    for (const FieldMap& map : materials[m].maps) {
      if (!here || map.texture) continue;
      if (elsewhere || found) return std::nullopt;
      found = Colour{field, materials[m].name, name_of(map.field),
                     parameter_widths(OwnerKind::kMaterial)[static_cast<std::size_t>(map.field)],
                     map.field};
    }
  }
  return found;
}

std::vector<UniformFields::Colour> UniformFields::colours_of(const Scene& scene,
                                                             const Fields& fields) {
  std::vector<Colour> colours;
  for (std::size_t f = 0; f < fields.refs().size(); ++f)
    if (auto colour =
            std::visit([&](const auto& ref) { return colour_of(scene, f, ref); }, fields.refs()[f]))
      colours.push_back(std::move(*colour));
  return colours;
}

/// `wanted` without fields, then the colours that stand for them.
std::vector<UnknownParameter> UniformFields::few_of(const std::vector<UnknownParameter>& wanted,
                                                    const Fields& fields,
                                                    const std::vector<Colour>& colours) {
  std::vector<UnknownParameter> few;
  for (const UnknownParameter& one : wanted)
    if (!Fields::is_field(one)) few.push_back(one);
  for (const Colour& colour : colours) {
    UnknownParameter one = fields.wanted()[colour.field];
    one.owner = colour.owner;
    one.parameter = colour.parameter;
    if (colour.tints) {
      one.start = {1, 1, 1};
      one.minimum = 1 / kTintFactor;
      one.maximum = kTintFactor;
      few.push_back(std::move(one));
      continue;
    }
    const Vector& values = fields.start()[colour.field];
    const int channels = fields.channels(colour.field);
    Color<double> start;
    for (int c = 0; c < 3; ++c) start[c] = values[c % channels];
    start = colour.linear(start);
    one.start = {start.r, start.g, start.b};
    one.start.resize(static_cast<std::size_t>(colour.width));
    one.minimum = colour.linear(Color<double>(one.minimum)).r;
    one.maximum = colour.linear(Color<double>(one.maximum)).r;
    few.push_back(std::move(one));
  }
  return few;
}

Scene UniformFields::without(Scene scene, const std::vector<Colour>& colours) {
  for (const Colour& colour : colours) {
    if (colour.tints) continue;
    Material& material =
        scene.appearance.materials[static_cast<std::size_t>(scene.material(colour.owner))];
    if (colour.map_of < 0)
      material.albedo_grid = {};
    else
      std::erase_if(material.maps, [&](const FieldMap& map) { return map.field == colour.map_of; });
  }
  return scene;
}

std::unique_ptr<UniformFields> UniformFields::of(const Scene& scene,
                                                 const std::vector<UnknownParameter>& wanted,
                                                 const Fields& fields,
                                                 const std::vector<Photo>& photos, const Loss& loss,
                                                 int iterations) {
  for (std::size_t f = 0; f < fields.refs().size(); ++f)
    if (!fields.is_environment(f) && !is_uniform(fields.start()[f], fields.channels(f)))
      return nullptr;
  if (colours_of(scene, fields).empty() || std::ranges::all_of(wanted, Fields::is_field))
    return nullptr;
  std::unique_ptr<UniformFields> uniform(
      new UniformFields(scene, wanted, fields, photos, loss, iterations));
  return uniform->unknowns_.size() <= kFewUnknowns ? std::move(uniform) : nullptr;
}

Eigen::Index UniformFields::width_of(const std::vector<Colour>& colours) {
  Eigen::Index sum = 0;
  for (const Colour& colour : colours) sum += colour.width;
  return sum;
}

UniformFields::UniformFields(const Scene& scene, const std::vector<UnknownParameter>& wanted,
                             const Fields& fields, const std::vector<Photo>& photos,
                             const Loss& loss, int iterations)
    : fields_(fields),
      colours_(colours_of(scene, fields)),
      base_(fields.start()),
      scene_(without(scene, colours_)),
      unknowns_(scene_, few_of(wanted, fields, colours_), photos),
      scalars_(unknowns_.size() - width_of(colours_)),
      layout_(unknowns_.layout(scene_)),
      problem_{unknowns_, layout_, photos, loss, iterations},
      reparametrization_(unknowns_) {}

void UniformFields::set_light(const FieldValues& fields) {
  for (const Colour& colour : colours_) {
    if (!colour.tints) continue;
    base_[colour.field] = fields[colour.field];
    scene_ = fields_.scene_with_field(scene_, colour.field, base_[colour.field]);
  }
}

FieldValues UniformFields::fields(const Vector& x) const {
  FieldValues values = base_;
  Eigen::Index at = scalars_;
  for (const Colour& colour : colours_) {
    const Color<double> stored = colour.stored(
        colour.width == 1 ? Color<double>(x[at]) : Color<double>(x[at], x[at + 1], x[at + 2]));
    const UnknownParameter& wanted = fields_.wanted()[colour.field];
    const int channels = fields_.channels(colour.field);
    Vector& all = values[colour.field];
    for (Eigen::Index i = 0; i < all.size(); ++i) {
      const double mine = channels == 3 || colour.width == 1
                              ? stored[static_cast<int>(i % channels)]
                              : (stored.r + stored.g + stored.b) / 3;
      all[i] = std::clamp(colour.tints ? all[i] * mine : mine, wanted.minimum,
                          wanted.maximum);  // encoding rounds
    }
    at += colour.width;
  }
  return values;
}

}  // namespace selenite
