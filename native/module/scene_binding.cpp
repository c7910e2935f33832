// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include <algorithm>
#include <map>

#include "module/arrays.h"
#include "module/bindings.h"
#include "module/one_of.h"
#include "scene/scene_builder.h"

namespace py = pybind11;
using namespace pybind11::literals;

namespace selenite {
namespace {

using NamedArrays = std::vector<std::pair<std::string, Array<float>>>;
using StoredColors = std::map<std::string, std::pair<Array<float>, Array<int>>>;

int add_mesh(SceneBuilder& b, const std::string& name, const Array<float>& positions,
             const Array<int>& triangles, const Array<float>& normals, const Array<int>& slots,
             const NamedArrays& uv_maps, const NamedArrays& colors, const NamedArrays& vectors,
             const StoredColors& stored) {
  const std::string who = "Mesh '" + name + "': ";
  Mesh mesh;
  mesh.name = name;
  mesh.positions = rows<Vec3f>(positions, who + "positions");
  mesh.triangles = rows<std::array<int, 3>>(triangles, who + "triangles");
  mesh.corner_normals = rows<Vec3f>(normals, who + "corner normals");
  require_shape(slots, who + "material slots", {-1});
  mesh.material_slots.assign(slots.data(), slots.data() + slots.size());
  for (const auto& [map, values] : uv_maps)
    mesh.uvs.push_back({map, rows<Vec2f>(values, who + "UV map '" + map + "'")});
  for (const auto& [attribute, values] : colors) {
    const std::string what = who + "colour attribute '" + attribute + "'";
    std::vector<Colorf> own;
    std::vector<int> elements;
    if (const auto found = stored.find(attribute); found != stored.end()) {
      own = rows<Colorf>(found->second.first, what + ", stored");
      require_shape(found->second.second, what + ", elements", {-1});
      elements.assign(found->second.second.data(),
                      found->second.second.data() + found->second.second.size());
    }
    mesh.colors.push_back(
        {attribute, rows<Colorf>(values, what), std::move(own), std::move(elements)});
  }
  for (const auto& [attribute, values] : vectors)
    mesh.vectors.push_back({attribute, rows<Vec3f>(values, who + "vectors '" + attribute + "'")});
  return b.add_mesh(std::move(mesh));
}

Light lamp(LightKind kind, const std::string& name, const Array<double>& matrix, double power,
           const Array<double>& color, const std::string& units, double radiance_scale) {
  const std::string who = "Light '" + name + "': ";
  Light light;
  light.name = name;
  light.kind = kind;
  light.to_world = transform_of(matrix, who + "matrix");
  light.values.power = power;
  light.values.color = color_of(color, who + "colour");
  light.units = one_of<LightUnits>(who + "light_units", units,
                                   {{"v3", LightUnits::kBlender3}, {"v4", LightUnits::kBlender4}});
  light.radiance_scale = radiance_scale;
  return light;
}

int add_camera(SceneBuilder& b, const std::string& name, const Array<double>& matrix,
               const std::string& kind, double lens, double sensor_width, double sensor_height,
               const std::string& fit, double shift_x, double shift_y, double ortho_scale,
               double clip_start, double clip_end, double aspect_x, double aspect_y) {
  const std::string who = "Camera '" + name + "': ";
  Camera c;
  c.name = name;
  c.orthographic = one_of<bool>(who + "kind", kind, {{"PERSP", false}, {"ORTHO", true}});
  c.lens_mm = lens;
  c.sensor_width_mm = sensor_width;
  c.sensor_height_mm = sensor_height;
  c.sensor_fit = one_of<SensorFit>(who + "sensor_fit", fit,
                                   {{"AUTO", SensorFit::kAuto},
                                    {"HORIZONTAL", SensorFit::kHorizontal},
                                    {"VERTICAL", SensorFit::kVertical}});
  c.shift_x = shift_x;
  c.shift_y = shift_y;
  c.ortho_scale = ortho_scale;
  c.clip_start = clip_start;
  c.clip_end = clip_end;
  c.pixel_aspect_x = aspect_x;
  c.pixel_aspect_y = aspect_y;
  c.to_world = transform_of(matrix, who + "matrix");
  return b.add_camera(std::move(c));
}

py::array_t<double> get(const Scene& scene, const std::string& owner,
                        const std::string& parameter) {
  const auto values = scene.get(scene.find(owner, parameter));
  return py::array_t<double>(static_cast<py::ssize_t>(values.size()), values.data());
}

Scene with_values(const Scene& scene,
                  const std::map<std::pair<std::string, std::string>, Array<double>>& changes) {
  std::vector<std::pair<ParameterRef, std::vector<double>>> list;
  for (const auto& [key, value] : changes)
    list.emplace_back(scene.find(key.first, key.second),
                      std::vector<double>(value.data(), value.data() + value.size()));
  return scene.with(list);
}

template <class List>
std::vector<std::string> names_of(const List& list) {
  std::vector<std::string> names;
  for (const auto& item : list) names.push_back(item.name);
  return names;
}

void bind_builder(py::module_& m) {
  py::class_<SceneBuilder> builder(m, "SceneBuilder",
                                   "Collects a scene in Blender's units; see `build`.");
  bind_visibility(builder);
  bind_world(builder);
  bind_materials(builder);
  builder.def(py::init<>())
      .def("add_mesh", &add_mesh, "name"_a, "positions"_a, "triangles"_a, "corner_normals"_a,
           "material_slots"_a, "uv_maps"_a = NamedArrays{}, "colors"_a = NamedArrays{},
           "vectors"_a = NamedArrays{}, "stored_colors"_a = StoredColors{},
           py::call_guard<py::gil_scoped_release>(),
           "(n,3) float32, (m,3) int32, (3m,3) float32 unit, (m,) int32, UV maps [(name, (3m,2))] "
           "and linear colour attributes [(name, (3m,3))], the active ones first; vectors that a "
           "shader asks for by name, likewise; object space. stored_colors: {colour attribute: "
           "((n,3) the "
           "values that it holds, (3m,) the one that each corner shows)}, of those that a fit "
           "changes.")
      .def(
          "add_point_light",
          [](SceneBuilder& b, const std::string& name, const Array<double>& matrix, double power,
             const Array<double>& color, double radius, bool soft, const std::string& units,
             double scale) {
            Light light = lamp(LightKind::kPoint, name, matrix, power, color, units, scale);
            light.radius = radius;
            light.soft_falloff = soft;
            return b.add_light(light);
          },
          "name"_a, "matrix"_a, "power"_a, "color"_a, "radius"_a, "soft_falloff"_a, py::kw_only(),
          "light_units"_a = "v4", "radiance_scale"_a = 1.0)
      .def(
          "add_sun_light",
          [](SceneBuilder& b, const std::string& name, const Array<double>& matrix, double strength,
             const Array<double>& color, double angle, const std::string& units, double scale) {
            Light light = lamp(LightKind::kSun, name, matrix, strength, color, units, scale);
            light.angle = angle;
            return b.add_light(light);
          },
          "name"_a, "matrix"_a, "strength"_a, "color"_a, "angle"_a, py::kw_only(),
          "light_units"_a = "v4", "radiance_scale"_a = 1.0)
      .def(
          "add_spot_light",
          [](SceneBuilder& b, const std::string& name, const Array<double>& matrix, double power,
             const Array<double>& color, double radius, bool soft, double size, double blend,
             const std::string& units, double scale) {
            Light light = lamp(LightKind::kSpot, name, matrix, power, color, units, scale);
            light.radius = radius;
            light.soft_falloff = soft;
            light.spot_size = size;
            light.spot_blend = blend;
            return b.add_light(light);
          },
          "name"_a, "matrix"_a, "power"_a, "color"_a, "radius"_a, "soft_falloff"_a, "size"_a,
          "blend"_a, py::kw_only(), "light_units"_a = "v4", "radiance_scale"_a = 1.0)
      .def(
          "add_area_light",
          [](SceneBuilder& b, const std::string& name, const Array<double>& matrix, double power,
             const Array<double>& color, const std::string& shape, double size_x, double size_y,
             double spread, const std::string& units, double scale) {
            Light light = lamp(LightKind::kArea, name, matrix, power, color, units, scale);
            light.ellipse = one_of<bool>(
                "Light '" + name + "': shape", shape,
                {{"SQUARE", false}, {"RECTANGLE", false}, {"DISK", true}, {"ELLIPSE", true}});
            light.size_x = size_x;
            light.size_y = shape == "SQUARE" || shape == "DISK" ? size_x : size_y;
            light.spread = spread;
            return b.add_light(light);
          },
          "name"_a, "matrix"_a, "power"_a, "color"_a, "shape"_a, "size_x"_a, "size_y"_a, "spread"_a,
          py::kw_only(), "light_units"_a = "v4", "radiance_scale"_a = 1.0)
      .def("add_camera", &add_camera, "name"_a, "matrix"_a, "kind"_a, "lens_mm"_a, "sensor_width"_a,
           "sensor_height"_a, "sensor_fit"_a, "shift_x"_a, "shift_y"_a, "ortho_scale"_a,
           "clip_start"_a, "clip_end"_a, "pixel_aspect_x"_a = 1.0, "pixel_aspect_y"_a = 1.0)
      .def("build", &SceneBuilder::build, py::call_guard<py::gil_scoped_release>(),
           "The finished scene with its acceleration structure.");
}

}  // namespace

void bind_scene(py::module_& m) {
  bind_builder(m);
  py::class_<Scene> scene(m, "Scene", py::release_gil_before_calling_cpp_dtor(),
                          "Immutable scene; `with_values` shares its geometry.");
  bind_lights(scene);
  bind_shaders(scene);
  bind_vertices(scene);
  scene.def_property_readonly("cameras", [](const Scene& s) { return names_of(s.cameras); })
      .def_property_readonly("materials",
                             [](const Scene& s) { return names_of(s.appearance.materials); })
      .def_property_readonly("lights", [](const Scene& s) { return names_of(s.appearance.lights); })
      .def_property_readonly("objects",
                             [](const Scene& s) { return names_of(s.geometry->instances()); })
      .def_property_readonly("triangle_count",
                             [](const Scene& s) { return s.geometry->triangle_count(); })
      .def_property_readonly("dropped_triangles",
                             [](const Scene& s) {
                               py::dict out;
                               for (const auto& [name, count] : s.geometry->dropped())
                                 out[py::str(name)] = count;
                               return out;
                             })
      .def("get", &get, "owner"_a, "parameter"_a, "(1,) or (3,) float64. KeyError: no such name.")
      .def("with_values", &with_values, "values"_a,
           "{(owner, parameter): value} -> Scene. ValueError: not finite or out of range.")
      .def(
          "with_grid",
          [](const Scene& s, const std::string& material, const std::string& use,
             const Array<float>& values) {
            const auto kind = one_of<GridKind>(
                "use", use, {{"albedo", GridKind::kAlbedo}, {"density", GridKind::kDensity}});
            return s.with_grid({s.material(material), kind},
                               std::vector<float>(values.data(), values.data() + values.size()));
          },
          "material"_a, "use"_a, "values"_a,
          "Scene with other values in a material's grid, (nz, ny, nx, channels). use: albedo, "
          "density. ValueError: it has none, another size, or a value out of range.")
      .def(
          "with_image",
          [](const Scene& s, const std::string& material, const Array<float>& pixels,
             const std::string& parameter) {
            const ImageRef ref = s.image_named(s.material(material), parameter);
            const Texture& image = *s.image(ref).texture;
            require_shape(pixels, "pixels", {image.height(), image.width(), s.channels(ref)});
            if (s.channels(ref) == 3) return s.with_image(ref, colors_of(pixels));
            return s.with_image(ref,
                                std::vector<Colorf>(pixels.data(), pixels.data() + pixels.size()));
          },
          "material"_a, "pixels"_a, "parameter"_a = kBaseColorTexture,
          "Scene with other texels of an image, (h, w, 3), or (h, w, 1) of a number, as it holds "
          "them, row 0 at the top. KeyError: no such name. ValueError: no such image, another "
          "size, "
          "a number that is not finite.")
      .def(
          "with_vertex_colors",
          [](const Scene& s, const std::string& object, const Array<float>& colors) {
            const int mesh =
                s.geometry->instances()[static_cast<std::size_t>(s.object(object))].mesh;
            return s.with_vertex_colors({mesh}, rows<Colorf>(colors, "colors"));
          },
          "object"_a, "colors"_a,
          "Scene with other colours of a mesh, (n, 3) linear, one for each vertex or corner. "
          "KeyError: no such object. ValueError: no colour attribute, another number, one that is "
          "not finite.")
      .def(
          "project",
          [](const Scene& s, const std::string& camera, int width, int height,
             const Array<double>& points) {
            const PixelCamera pixels(s.camera(camera), width, height);
            const auto world = rows<Vec3d>(points, "points");
            py::array_t<double> out({static_cast<py::ssize_t>(world.size()), py::ssize_t{2}});
            for (std::size_t i = 0; i < world.size(); ++i) {
              const auto p = pixels.project(world[i] - s.geometry->origin());
              out.mutable_at(i, 0) = p.x;
              out.mutable_at(i, 1) = p.y;
            }
            return out;
          },
          "camera"_a, "width"_a, "height"_a, "points"_a,
          "(n,3) world points -> (n,2) pixels from the top left; NaN behind the camera.");
}

}  // namespace selenite
