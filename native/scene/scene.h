// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "model/field_index.h"
#include "model/medium.h"
#include "model/principled.h"
#include "scene/geometry.h"
#include "scene/grid.h"
#include "scene/light.h"
#include "scene/shader/shader.h"
#include "scene/texture.h"
#include "scene/vertex_colors.h"
#include "scene/world.h"

namespace selenite {

/// All that a material can be fitted by: its surface and the medium behind it.
template <class T>
struct MaterialParameters : Principled<T>, Medium<T> {
  template <class Self, class Visit>
  static constexpr void fields(Self& m, Visit&& visit) {
    Principled<T>::fields(m, visit);
    Medium<T>::fields(m, visit);
  }
};

using MaterialValues = MaterialParameters<double>;
template <class Value, class Base>
consteval int material_field(Value Base::*member) {
  return field_index<MaterialValues>(member);
}

/// What a grid of a medium gives.
enum class GridKind { kAlbedo, kDensity };
/// Its name among the parameters of a material: "albedo_grid", "density_grid".
const char* grid_name(GridKind kind);
/// A grid of a scene.
struct GridRef {
  int material;
  GridKind kind;
  bool operator==(const GridRef&) const = default;
};

/// An image of a material: the one that gives a parameter of its surface, see `material_field`, or one
/// of its shader. The latter follow as constants do, see `constant_field`.
struct ImageRef {
  int material;
  int field = material_field(&MaterialValues::base_color);
  bool operator==(const ImageRef&) const = default;
};
/// The name of a base colour's image among the parameters of a material.
inline constexpr const char* kBaseColorTexture = "base_color_texture";
/// Whether an image of a material can have this name: a parameter's of its surface and "_texture", or
/// that of a node of its shader and ".image".
bool is_image_name(std::string_view name);

/// The colour attribute of a mesh that materials look up.
struct VertexColorsRef {
  int mesh;
  bool operator==(const VertexColorsRef&) const = default;
};
/// Its name among the parameters of an object.
inline constexpr const char* kVertexColors = "vertex_colors";

/// The image of the world.
struct EnvironmentRef {
  bool operator==(const EnvironmentRef&) const = default;
};
/// Its name among the parameters of the world.
inline constexpr const char* kEnvironment = "environment";
/// The world among the owners of parameters.
inline constexpr const char* kWorldName = "World";
/// What can be unknown with a value at every place.
using FieldRef = std::variant<GridRef, ImageRef, EnvironmentRef, VertexColorsRef>;

/// An image of a shader that can be unknown.
struct ShaderImage {
  std::string name;  ///< among the parameters of the material
  FieldMap map;      ///< `field`: its number among the shader's textures
  int channels = 3;  ///< 1: all that the shader takes of it is one number
};

struct Material {
  std::string name;
  MaterialValues values;
  Flavour flavour;
  std::vector<FieldMap> maps;       ///< parameters with a texture or vertex colours
  PlacedGrid albedo_grid;           ///< of the medium, in place of `albedo`; values at most 1
  PlacedGrid density_grid;          ///< numbers by which the medium's `extinction` is multiplied
  bool transparent_shadows = true;  ///< shadow rays pass straight through where others do (alpha)
  /// What the surface is made of in place of the Principled BSDF of `values`; null: nothing else.
  std::shared_ptr<const Shader> shader;
  std::vector<Color<double>> constants;  ///< of the shader: what a fit changes of it
  std::vector<ShaderImage> images;       ///< likewise

  const PlacedGrid& grid(GridKind kind) const;
  PlacedGrid& grid(GridKind kind);
  /// Null: the parameter has one value. `field`: see `material_field`.
  const FieldMap* map_of(int field) const;
};

/// What of a scene has parameters. Every switch over it lists all kinds, so that the compiler names the
/// places where another one has to be handled. What is no part of the scene, as a property of a photo,
/// is none of them: a render never sees it.
enum class OwnerKind { kMaterial, kLight, kWorld };

/// Where a parameter lives in a scene. `field` counts the owner's `fields` in their order; after
/// those of a material come the constants of its shader.
struct ParameterRef {
  OwnerKind kind;
  int owner;
  int field;
  bool operator==(const ParameterRef&) const = default;
  bool same_owner(const ParameterRef& o) const { return kind == o.kind && owner == o.owner; }
};

/// Everything that a fit can change: small, copied for every set of values.
struct Appearance {
  std::vector<Material> materials;
  std::vector<Light> lights;
  World world;
  MeshColors mesh_colors;
};

/// A scene: values only. Nothing writes into a scene that is being rendered; `with` makes another.
struct Scene {
  std::shared_ptr<const Geometry> geometry;
  std::vector<Camera> cameras;
  Appearance appearance;

  const Camera& camera(std::string_view name) const;  ///< UnknownName lists the cameras there are
  /// Owner: name of a material or light, or "World". UnknownName names what exists.
  ParameterRef find(std::string_view owner, std::string_view parameter) const;
  std::string owner_name(const ParameterRef& ref) const;
  const Parameter& description(const ParameterRef& ref) const;
  int width(const ParameterRef& ref) const;  ///< numbers: 1 or 3
  /// InvalidArgument when a texture, vertex colours or a grid take the place of the one value, or of a
  /// rotation where the world has no image.
  void require_constant(const ParameterRef& ref) const;
  /// One or three values.
  std::vector<double> get(const ParameterRef& ref) const;
  /// This scene with other values; InvalidArgument when one is not finite, out of range or not
  /// constant over the surface.
  Scene with(const std::vector<std::pair<ParameterRef, std::vector<double>>>& values) const;
  /// The number of a material. UnknownName lists those there are.
  int material(std::string_view name) const;
  /// The grid itself; InvalidArgument when the material has none of this kind.
  const PlacedGrid& grid(const GridRef& ref) const;
  /// The number of an object. UnknownName lists those there are.
  int object(std::string_view name) const;
  /// The image of this name. UnknownName: the material has no parameter or image of it.
  ImageRef image_named(int material, std::string_view name) const;
  std::string image_name(const ImageRef& ref) const;
  /// An image, and how it lies on the surface. InvalidArgument when the material has none, or one with
  /// alpha, whose texels' derivatives are not told.
  const FieldMap& image(const ImageRef& ref) const;
  /// The numbers of a texel that are unknown: 3 of a colour, 1 of a number.
  int channels(const ImageRef& ref) const;
  /// The colours of a mesh. InvalidArgument when no material looks up an attribute of it, or several.
  const VertexColors& vertex_colors(const VertexColorsRef& ref) const;
  /// The image of the world. InvalidArgument when it has none, or one that a colour tints: then it
  /// is not the radiance at strength 1.
  const EnvironmentMap& environment() const;
  /// This scene with other values of a grid; InvalidArgument when there is none, or a value is not
  /// finite or out of range: [0, 1] for an albedo, at least 0 for a density.
  Scene with_grid(const GridRef& ref, std::vector<float> values) const;
  /// This scene with other colours in an image, as the image holds them. InvalidArgument as `image`,
  /// or when their number is another or one is not finite.
  Scene with_image(const ImageRef& ref, std::vector<Colorf> pixels) const;
  /// This scene with other colours of a mesh. InvalidArgument as `vertex_colors`, or when their number
  /// is another or one is not finite.
  Scene with_vertex_colors(const VertexColorsRef& ref, std::vector<Colorf> values) const;
  /// This scene with other radiance in the image of the world, of which light sampling finds dark
  /// pixels too. InvalidArgument as `environment`, or when their number is another, or one is
  /// negative or not finite.
  Scene with_environment(std::vector<Colorf> pixels) const;
};

/// The field of a ParameterRef that is a constant of a material's shader.
int constant_field(int constant);
/// The constant that a field of a material is; -1: it is one of MaterialValues.
int shader_constant(int field);

/// InvalidArgument unless the grids of a material fit their use.
void check_grids(const Material& material);

/// Throws InvalidArgument naming `owner:parameter`, the value and the permitted range.
void check_value(std::string_view owner, const Parameter& parameter, double value);

/// The table of one kind of owner, in the order of its `fields`.
const std::vector<Parameter>& parameter_table(OwnerKind kind);
/// 1 or 3 components, beside `parameter_table`.
const std::vector<int>& parameter_widths(OwnerKind kind);

}  // namespace selenite
