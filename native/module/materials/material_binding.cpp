// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include <algorithm>
#include <map>

#include "module/arrays.h"
#include "module/bindings.h"
#include "module/grids.h"
#include "module/materials/shader_arguments.h"
#include "module/one_of.h"
#include "scene/scene_builder.h"

namespace py = pybind11;
using namespace pybind11::literals;

namespace selenite {
namespace {

/// Writes named values into a material; a parameter that is not named keeps its default.
void set_values(Material& material, const py::dict& values) {
  struct Visit {
    const py::dict& values;
    std::size_t used = 0;
    void operator()(const Parameter& p, double& x) {
      const py::str key(std::string(p.name));
      if (!values.contains(key)) return;
      x = values[key].cast<double>();
      ++used;
    }
    void operator()(const Parameter& p, Color<double>& c) {
      const py::str key(std::string(p.name));
      if (!values.contains(key)) return;
      c = color_of(values[key].cast<Array<double>>(), std::string(p.name));
      ++used;
    }
  } visit{values};
  MaterialParameters<double>::fields(material.values, visit);
  if (visit.used == values.size()) return;
  std::string names;
  for (const Parameter& p : parameter_table(OwnerKind::kMaterial))
    names += " " + std::string(p.name);
  throw NotFound("Material '" + material.name + "'", "a value's name is none of" + names);
}

/// One texture or vertex colour: {texture: index or None, attribute: str, uv: (2,3)}.
FieldMap field_map(const SceneBuilder& b, const std::string& material, const std::string& parameter,
                   const py::dict& values) {
  const std::string who = "Material '" + material + "'";
  const auto& table = parameter_table(OwnerKind::kMaterial);
  FieldMap map;
  map.field =
      static_cast<int>(std::find_if(table.begin(), table.end(),
                                    [&](const Parameter& p) { return p.name == parameter; }) -
                       table.begin());
  if (map.field == static_cast<int>(table.size()))
    throw NotFound(who, parameter + " is no parameter of a material");
  if (!values["texture"].is_none()) {
    const int index = values["texture"].cast<int>();
    if (index < 0 || index >= static_cast<int>(b.textures.size()))
      throw Refused(who, parameter + ": texture " + std::to_string(index) + " was not added");
    map.texture = b.textures[index];
  }
  map.attribute = values["attribute"].cast<std::string>();
  if (values.contains("uv")) {
    const auto uv = values["uv"].cast<Array<float>>();
    require_shape(uv, who + ": " + parameter + ": uv", {2, 3});
    std::copy(uv.data(), uv.data() + 6, map.uv.begin());
  }
  return map;
}

int add_texture(SceneBuilder& b, const std::string& name, const Array<float>& pixels, bool encoded,
                const std::string& extension, const std::string& interpolation) {
  const std::string who = "Image '" + name + "': ";
  const bool with_alpha = pixels.ndim() == 3 && pixels.shape(2) == 4;
  require_shape(pixels, who + "pixels", {-1, -1, with_alpha ? 4 : 3});
  const py::ssize_t channels = pixels.shape(2), count = pixels.size() / channels;
  std::vector<Colorf> colors(static_cast<std::size_t>(count));
  std::vector<float> alpha(static_cast<std::size_t>(with_alpha ? count : 0));
  const float* from = pixels.data();
  for (py::ssize_t i = 0; i < count; ++i, from += channels) {
    colors[i] = {from[0], from[1], from[2]};
    if (with_alpha) alpha[i] = from[3];
  }
  b.textures.push_back(std::make_shared<Texture>(
      name, static_cast<int>(pixels.shape(1)), static_cast<int>(pixels.shape(0)), std::move(colors),
      std::move(alpha), encoded,
      one_of<Extension>(who + "extension", extension,
                        {{"REPEAT", Extension::kRepeat},
                         {"EXTEND", Extension::kExtend},
                         {"CLIP", Extension::kClip},
                         {"MIRROR", Extension::kMirror}}),
      one_of<Interpolation>(who + "interpolation", interpolation,
                            {{"Linear", Interpolation::kLinear},
                             {"Closest", Interpolation::kClosest},
                             {"Cubic", Interpolation::kCubic}})));
  return static_cast<int>(b.textures.size()) - 1;
}

int add_material(SceneBuilder& b, const std::string& name, const py::dict& values, bool multi_ggx,
                 const std::string& flavour, const std::string& subsurface,
                 bool physical_refraction, bool transparent_shadows,
                 const std::map<std::string, py::dict>& maps,
                 const std::map<std::string, py::dict>& grids,
                 const std::optional<py::dict>& shader) {
  Material material;
  material.name = name;
  material.flavour = make_flavour(multi_ggx, flavour, subsurface);
  material.flavour.evaluate_unphysical_refraction = !physical_refraction;
  material.transparent_shadows = transparent_shadows;
  set_values(material, values);
  for (const auto& [parameter, value] : maps)
    material.maps.push_back(field_map(b, name, parameter, value));
  for (const auto& [use, value] : grids)
    *one_of<PlacedGrid*>("Material '" + name + "': grids", use,
                         {{"albedo", &material.albedo_grid}, {"density", &material.density_grid}}) =
        placed_grid(name, value);
  if (shader) set_shader(material, b.textures, *shader);
  return b.add_material(std::move(material));
}

}  // namespace

void bind_materials(py::class_<SceneBuilder>& builder) {
  builder
      .def("add_material", &add_material, "name"_a, "values"_a, py::kw_only(), "multi_ggx"_a = true,
           "flavour"_a = "v2", "subsurface"_a = "RANDOM_WALK", "physical_refraction"_a = false,
           "transparent_shadows"_a = true, "maps"_a = std::map<std::string, py::dict>{},
           "grids"_a = std::map<std::string, py::dict>{}, "shader"_a = py::none(),
           "Principled BSDF; `values`: parameter name to number or 3 numbers, the rest takes the "
           "node's defaults. `maps`: parameter name to {texture: index or None for the colour "
           "attribute, attribute: UV map or colour attribute ('' for the active one), uv: (2,3)}. "
           "`grids`: 'albedo' (in place of the medium's, within [0, 1]) or 'density' (times its "
           "extinction) to {name, values: (nz, ny, nx, 1 or 3) float32, to_unit: (4, 4), world to "
           "the unit cube over which the values lie}. "
           "`shader`: what the surface is made of instead, a program; see set_shader in "
           "shader_arguments.h. ValueError: out of range. KeyError: unknown name.")
      .def(
          "add_texture", &add_texture, "name"_a, "pixels"_a, py::kw_only(), "encoded"_a,
          "extension"_a = "REPEAT", "interpolation"_a = "Linear",
          "(h,w,3) float32, row 0 at the top; `encoded`: sRGB values, decoded after interpolation. "
          "A fourth channel is the alpha by which the colours were multiplied: they are divided by "
          "it before decoding.");
}

}  // namespace selenite
