// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/prepared/prepared_material.h"

#include <cmath>

#include "render/prepared/mapped_color.h"
#include "scene/shader/modes.h"

namespace selenite {
namespace {

/// Free paths per radius as which an unknown medium counts where there is none.
constexpr float kThin = 0.2f;
/// The least rate at which free paths in an unknown density end, as a share of the largest.
constexpr float kLeastShare = 0.1f;

/// All numbers of a material, field by field, three for a colour.
std::vector<double> flatten(const MaterialParameters<double>& values) {
  std::vector<double> flat;
  struct Visit {
    std::vector<double>& flat;
    void operator()(const Parameter&, double& x) const { flat.push_back(x); }
    void operator()(const Parameter&, Color<double>& c) const {
      for (int i = 0; i < 3; ++i) flat.push_back(c[i]);
    }
  };
  MaterialParameters<double> copy = values;
  MaterialParameters<double>::fields(copy, Visit{flat});
  return flat;
}

/// Copies the numbers of a material into path scalars and seeds those that carry a derivative.
template <int L>
struct Seed {
  using T = PathScalar<L>;
  const std::vector<double>& flat;
  const std::vector<std::vector<int>>& local;  ///< per field: local slots, -1 or none if not ticked
  std::size_t at = 0;
  std::size_t field = 0;

  T scalar(int slot) {
    const auto value = static_cast<float>(flat[at++]);
    if constexpr (L > 0)
      if (slot >= 0) return T::variable(value, slot);
    return T(value);
  }
  void operator()(const Parameter&, T& x) {
    const auto& slots = local[field++];
    x = scalar(slots.empty() ? -1 : slots[0]);
  }
  void operator()(const Parameter&, Color<T>& c) {
    const auto& slots = local[field++];
    for (int i = 0; i < 3; ++i)
      c[i] = scalar(slots.empty() ? -1 : slots[slots.size() == 1 ? 0 : i]);
  }
};

/// Puts a looked-up colour into one field, clamped to what the model permits; a number takes the
/// luminance, as Blender's sockets do. What is unknown is seeded where it is inside.
template <class T>
struct Put {
  int field;
  const Colorf& color;
  int slot = -1;  ///< none: it is known
  int index = 0;
  static float inside(const Parameter& p, float x) {
    return clamp(x, static_cast<float>(p.lower), static_cast<float>(p.upper));
  }
  void operator()(const Parameter& p, T& x) {
    if (index++ != field) return;
    x = number(p, 0.2126729f * color.r + 0.7151522f * color.g + 0.0721750f * color.b);
  }
  void operator()(const Parameter& p, Color<T>& c) {
    if (index++ != field) return;
    for (int i = 0; i < 3; ++i) c[i] = number(p, color[i]);
  }
  T number(const Parameter& p, float x) const {
    const float value = inside(p, x);
    if constexpr (!std::is_same_v<T, float>)
      if (slot >= 0 && value == x) return T::variable(value, slot);
    return T(value);
  }
};

/// The constants of a shader; `first`: the field that the first of them is.
template <int L>
std::vector<Color<PathScalar<L>>> seeded_constants(const Material& material,
                                                   const std::vector<std::vector<int>>& local,
                                                   std::size_t first) {
  using T = PathScalar<L>;
  std::vector<double> flat;
  for (const Color<double>& c : material.constants)
    for (int i = 0; i < 3; ++i) flat.push_back(c[i]);
  Seed<L> seed{flat, local, 0, first};
  std::vector<Color<T>> constants(material.constants.size());
  for (Color<T>& c : constants) seed(Parameter{}, c);  // a number in all channels, with one slot
  return constants;
}

/// Walks below the surfaces of a material will need it.
void prepare_inside(const Geometry& geometry, int material) {
  const auto& instances = geometry.instances();
  for (std::size_t i = 0; i < instances.size(); ++i) {
    const auto& slots_of_mesh = instances[i].materials;
    if (std::find(slots_of_mesh.begin(), slots_of_mesh.end(), material) != slots_of_mesh.end())
      geometry.prepare_inside(static_cast<int>(i));
  }
}

template <int L>
void prepare_medium(const Material& source, const Geometry& geometry,
                    PreparedMaterial<L>& material) {
  const auto& sigma_t = material.values.extinction;
  if (source.albedo_grid) material.albedo_grid = &source.albedo_grid;
  if (source.density_grid) material.density_grid = &source.density_grid;
  float densest = source.density_grid ? source.density_grid.grid->maximum() : 1;
  const float radius = geometry.radius().all, most = max_channel(value_of(sigma_t));
  const bool unknown = material.density_field >= 0;
  if (unknown && most > 0) {
    // A grid that is empty everywhere still has its derivative: it counts as thin for its size.
    const double side = std::cbrt(1 / std::abs(source.density_grid.to_unit.determinant()));
    material.least_density =
        std::max(kLeastShare * densest, 2 * kThin / (static_cast<float>(side) * most));
    material.density_unit = densest = std::max(densest, material.least_density);
  }
  material.has_medium = densest > 0 && (max_channel(value_of(sigma_t)) > 0 || has_slope(sigma_t));
  if (!material.has_medium) return;
  material.sigma_s = sigma_t * material.values.albedo;
  material.rate = value_of(sigma_t);
  // A ticked extinction of 0 still has a derivative, of light that would be scattered once.
  const float least = radius > 0 ? kThin / (radius * densest) : 0;
  if (has_slope(sigma_t))
    material.rate = map(material.rate, [least](float r) { return std::max(r, least); });
  const float middling = source.density_grid ? source.density_grid.grid->mean() : 1.0f;
  material.typical_rate = material.rate * std::max(middling, material.least_density);
  // Twice the extinction where it is ticked: as many null collisions as real ones at the densest
  // place. Their number then adds as much variance to the derivative as the free path itself has.
  const bool loose = has_slope(sigma_t) || unknown;
  material.majorant = max_channel(material.rate) * densest * (loose ? 2.0f : 1.0f);
}

}  // namespace

Colorf mapped_color(const FieldMap& map, const Geometry& geometry, const MeshColors& mesh_colors,
                    const Hit& hit) {
  return map.texture ? map.texture->at(map.place(geometry.uv(hit, map.attribute)))
                     : color_at(geometry, mesh_colors, hit, map.attribute);
}

template <int L>
void PreparedMaterial<L>::apply(const FieldMap& map, const Geometry& geometry, const Hit& hit,
                                Principled<PathScalar<L>>& room) const {
  const Colorf color = mapped_color(map, geometry, *mesh_colors, hit);
  const auto unknown =
      std::ranges::find_if(unknown_maps, [&](const UnknownMap& one) { return one.map == &map; });
  Put<PathScalar<L>> put{map.field, color, unknown == unknown_maps.end() ? -1 : unknown->slot};
  Principled<PathScalar<L>>::fields(room, put);
}

template <int L>
int PreparedMaterial<L>::slopes_of(const Geometry& geometry, const Hit& hit, const Factor<L>& f,
                                   std::array<FieldSlope, L>& slopes) const {
  int found = 0;
  for (const UnknownMap& one : unknown_maps) {
    FieldPlace place;
    if (one.field >= 0) {
      const Vec2f uv = one.map->place(geometry.uv(hit, one.map->attribute));
      place = {{uv.x, uv.y, 0}, one.field};
    } else {
      const int mesh = geometry.instances()[hit.instance].mesh;
      const auto colors = std::ranges::find_if(unknown_colors, [&](const UnknownColors& c) {
        if (c.mesh != mesh) return false;
        if (!one.map) return &c == &unknown_colors[static_cast<std::size_t>(-2 - one.field)];
        return one.map->attribute.empty() || one.map->attribute == *c.attribute;
      });
      if (colors == unknown_colors.end()) continue;
      place = FieldPlace::on_triangle(hit.triangle, hit.b1, hit.b2, colors->field);
    }
    for (int k = 0; k < one.count; ++k) {
      const auto slot = static_cast<std::size_t>(one.slot + k);
      place.number = one.count > 1 ? k : -1;
      slopes[static_cast<std::size_t>(found++)] = {
          {f.slope[0][slot], f.slope[1][slot], f.slope[2][slot]}, place, 1};
    }
  }
  return found;
}

namespace {

std::vector<UnknownColors> unknown_colors_of(const Scene& scene, std::span<const FieldRef> fields) {
  std::vector<UnknownColors> found;
  for (std::size_t f = 0; f < fields.size(); ++f)
    if (const auto* ref = std::get_if<VertexColorsRef>(&fields[f]))
      found.push_back({ref->mesh, &scene.vertex_colors(*ref).attribute(), static_cast<int>(f)});
  return found;
}

/// Whether a shader shows colours by the name with this number.
bool shows_colors(const Shader& shader, std::size_t name) {
  return std::ranges::any_of(shader.instructions, [&](const Instruction& code) {
    return code.op == Op::kAttribute && static_cast<std::size_t>(code.item) == name &&
           static_cast<AttributeMode>(code.mode) == AttributeMode::kColor;
  });
}

/// The maps of a material that are unknown, with the slots of what they give.
std::vector<UnknownMap> unknown_maps_of(const Scene& scene, std::span<const FieldRef> fields,
                                        int material) {
  const auto of_mesh = [](const FieldRef& ref) {
    return std::holds_alternative<VertexColorsRef>(ref);
  };
  const bool any_colors = std::ranges::any_of(fields, of_mesh);
  std::vector<UnknownMap> found;
  int slots = 0;
  for (const FieldMap& map : scene.appearance.materials[material].maps) {
    const int field = field_number(fields, ImageRef{material, map.field});
    if (field >= 0 || (any_colors && !map.texture)) found.push_back({&map, slots++, 1, field});
  }
  const auto& images = scene.appearance.materials[material].images;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const int field = field_number(fields, ImageRef{material, constant_field(static_cast<int>(i))});
    if (field < 0) continue;
    found.push_back({&images[i].map, slots, images[i].channels, field});
    slots += images[i].channels;
  }
  const auto& shader = scene.appearance.materials[material].shader;
  if (!shader || !any_colors) return found;
  const std::vector<UnknownColors> colors = unknown_colors_of(scene, fields);
  for (std::size_t name = 0; name < shader->names.size(); ++name) {
    if (!shows_colors(*shader, name)) continue;
    const std::string& attribute = shader->names[name];
    bool any = false;
    for (std::size_t c = 0; c < colors.size(); ++c)
      if (attribute.empty() || attribute == *colors[c].attribute) {
        found.push_back({nullptr, slots, 3, -2 - static_cast<int>(c)});
        any = true;
      }
    slots += any ? 3 : 0;
  }
  return found;
}

/// Of the textures of a shader, and of its colours by their names; empty: none is unknown.
std::vector<ImageSlots> image_slots_of(const Material& material,
                                       const std::vector<UnknownMap>& unknown,
                                       const std::vector<UnknownColors>& colors) {
  if (unknown.empty()) return {};
  const Shader& shader = *material.shader;
  std::vector<ImageSlots> slots(shader.textures.size() + shader.names.size());
  for (const UnknownMap& one : unknown) {
    if (one.map) {
      slots[static_cast<std::size_t>(one.map->field)] = {one.slot, one.count};
      continue;
    }
    const std::string& attribute = *colors[static_cast<std::size_t>(-2 - one.field)].attribute;
    for (std::size_t name = 0; name < shader.names.size(); ++name)
      if (shows_colors(shader, name) &&
          (shader.names[name].empty() || shader.names[name] == attribute))
        slots[shader.textures.size() + name] = {one.slot, one.count};
  }
  return slots;
}

}  // namespace

int map_slots(const Scene& scene, std::span<const FieldRef> fields, int material) {
  int slots = 0;
  for (const UnknownMap& one : unknown_maps_of(scene, fields, material))
    slots = std::max(slots, one.slot + one.count);
  return slots;
}

int field_number(std::span<const FieldRef> fields, const FieldRef& ref) {
  const auto found = std::find(fields.begin(), fields.end(), ref);
  return found == fields.end() ? -1 : static_cast<int>(found - fields.begin());
}

template <int L>
std::vector<PreparedMaterial<L>> prepare_materials(const Scene& scene, const SlotLayout& layout,
                                                   std::span<const FieldRef> unknown) {
  const auto fields = parameter_table(OwnerKind::kMaterial).size();
  std::vector<PreparedMaterial<L>> materials;
  for (std::size_t m = 0; m < scene.appearance.materials.size(); ++m) {
    const Material& material = scene.appearance.materials[m];
    const auto index = static_cast<int>(m);
    PreparedMaterial<L> prepared;
    prepared.flavour = material.flavour;
    prepared.maps = &material.maps;
    std::vector<std::vector<int>> local(fields + material.constants.size());
    if constexpr (L > 0) {
      for (int i = 0; i < static_cast<int>(layout.slots.size()); ++i) {
        const ParameterRef& ref = layout.slots[i].parameter;
        if (ref.kind != OwnerKind::kMaterial || ref.owner != index) continue;
        if (prepared.count == 0) prepared.first = i;
        local[ref.field].push_back(prepared.count++);
      }
    }
    const std::vector<double> flat = flatten(material.values);
    Seed<L> seed{flat, local};
    MaterialParameters<PathScalar<L>>::fields(prepared.values, seed);
    const auto& values = prepared.values;
    prepared.transparent = value_of(values.alpha) < 1 || has_slope(values.alpha) ||
                           material.map_of(material_field(&MaterialValues::alpha));
    prepared.mesh_colors = &scene.appearance.mesh_colors;
    if constexpr (is_taped(L)) {
      prepared.unknown_maps = unknown_maps_of(scene, unknown, index);
      prepared.unknown_colors = unknown_colors_of(scene, unknown);
      // Alpha and coats dim it; a base colour leaves it alone.
      prepared.unknown_emission =
          std::ranges::any_of(prepared.unknown_maps, [&](const UnknownMap& one) {
            return material.shader || one.map->field != material_field(&MaterialValues::base_color);
          });
    }
    if (material.shader) {
      prepared.shader = std::make_shared<const PreparedShader<PathScalar<L>>>(
          material, seeded_constants<L>(material, local, fields),
          image_slots_of(material, prepared.unknown_maps, prepared.unknown_colors));
      prepared.transparent = prepared.shader->may_pass();
      if (prepared.shader->may_enter()) prepare_inside(*scene.geometry, index);
    }
    if (value_of(values.subsurface_weight) > 0 || has_slope(values.subsurface_weight) ||
        material.map_of(material_field(&MaterialValues::subsurface_weight)))
      prepare_inside(*scene.geometry, index);
    prepared.albedo_field = field_number(unknown, GridRef{index, GridKind::kAlbedo});
    prepared.density_field = field_number(unknown, GridRef{index, GridKind::kDensity});
    prepare_medium(material, *scene.geometry, prepared);
    materials.push_back(prepared);
  }
  return materials;
}

template <int L>
PreparedMaterial<L> white_material() {
  PreparedMaterial<L> white;
  white.values.specular_level = PathScalar<L>(0);
  white.values.base_color = Color<PathScalar<L>>(PathScalar<L>(1));
  static const std::vector<FieldMap> none;
  static const MeshColors no_colors;
  white.maps = &none;
  white.mesh_colors = &no_colors;
  return white;
}

template <int L>
void prepare_plain(const Material& from, PreparedMaterial<L>& material) {
  material.plain = material.count == 0 && !from.shader && from.maps.empty() &&
                   !material.transparent && !material.emissive &&
                   !(from.values.subsurface_weight > 0);
  if (material.count > 0) return;
  const std::vector<double> flat = flatten(from.values);
  const std::vector<std::vector<int>> none(parameter_table(OwnerKind::kMaterial).size());
  Seed<0> seed{flat, none};
  Principled<float>::fields(material.plain_values, seed);
}

template struct PreparedMaterial<0>;
template std::vector<PreparedMaterial<0>> prepare_materials(const Scene&, const SlotLayout&,
                                                            std::span<const FieldRef>);
template PreparedMaterial<0> white_material();
template void prepare_plain(const Material&, PreparedMaterial<0>&);
template struct PreparedMaterial<kTaped>;
template std::vector<PreparedMaterial<kTaped>> prepare_materials(const Scene&, const SlotLayout&,
                                                                 std::span<const FieldRef>);
template PreparedMaterial<kTaped> white_material();
template void prepare_plain(const Material&, PreparedMaterial<kTaped>&);
template struct PreparedMaterial<kTapedMaps>;
template std::vector<PreparedMaterial<kTapedMaps>> prepare_materials(const Scene&,
                                                                     const SlotLayout&,
                                                                     std::span<const FieldRef>);
template PreparedMaterial<kTapedMaps> white_material();
template void prepare_plain(const Material&, PreparedMaterial<kTapedMaps>&);
template struct PreparedMaterial<2>;
template std::vector<PreparedMaterial<2>> prepare_materials(const Scene&, const SlotLayout&,
                                                            std::span<const FieldRef>);
template PreparedMaterial<2> white_material();
template void prepare_plain(const Material&, PreparedMaterial<2>&);
template struct PreparedMaterial<4>;
template std::vector<PreparedMaterial<4>> prepare_materials(const Scene&, const SlotLayout&,
                                                            std::span<const FieldRef>);
template PreparedMaterial<4> white_material();
template void prepare_plain(const Material&, PreparedMaterial<4>&);
template struct PreparedMaterial<8>;
template std::vector<PreparedMaterial<8>> prepare_materials(const Scene&, const SlotLayout&,
                                                            std::span<const FieldRef>);
template PreparedMaterial<8> white_material();
template void prepare_plain(const Material&, PreparedMaterial<8>&);
template struct PreparedMaterial<16>;
template std::vector<PreparedMaterial<16>> prepare_materials(const Scene&, const SlotLayout&,
                                                             std::span<const FieldRef>);
template PreparedMaterial<16> white_material();
template void prepare_plain(const Material&, PreparedMaterial<16>&);

}  // namespace selenite
