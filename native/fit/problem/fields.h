// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "fit/problem/mesh_graph.h"
#include "fit/problem/unknowns.h"
#include "scene/scene.h"

namespace selenite {

/// Values of all fields, each in the order of its grid's or image's numbers.
using FieldValues = std::vector<Vector>;

/// The vertices of an object. No path carries their derivatives: see `ShapeDescent`.
struct VerticesRef {
  int instance;
  bool operator==(const VerticesRef&) const = default;
};
using FittedFieldRef =
    std::variant<GridRef, ImageRef, EnvironmentRef, VertexColorsRef, VerticesRef>;

/// What a name among the parameters of a material, of an object or of the world stands for.
/// InvalidArgument, UnknownName: there is none.
FittedFieldRef field_named(const Scene& scene, const std::string& owner,
                           const std::string& parameter);
/// (nz, ny, nx, channels) of a grid, (height, width, channels) of an image, (count, 3) of a mesh's
/// colours or vertices.
std::vector<std::ptrdiff_t> shape_of(const Scene& scene, const FittedFieldRef& ref);
/// The scene with other values of a field, in the order of its shape. InvalidArgument: one of them is
/// out of range.
Scene with_field(const Scene& scene, const FittedFieldRef& ref, const Eigen::VectorXf& values);
/// A field whose derivatives paths carry; none: vertices.
std::optional<FieldRef> carried(const FittedFieldRef& ref);

/// Shares of the sphere that the pixels of an equirectangular image of (height, width, ...) have,
/// row by row.
Eigen::VectorXd sphere_shares(const std::vector<std::ptrdiff_t>& shape);

/// Unknowns with a value at every place instead of one: the voxels of albedo and density grids, the
/// texels of materials, as their images hold them, the colours and vertices of meshes, the pixels of
/// the world's image. They start at the values that the scene has, or where a search of
/// `UniformFields` ends, and are fitted with Adam, by `FieldGaussNewton`, or by `ShapeDescent`.
class Fields {
 public:
  /// By its name among the parameters of a material, of an object or of the world.
  static bool is_field(const UnknownParameter& one);

  /// Takes those of `wanted` that are fields. Reports all problems at once, one line each:
  /// InvalidArgument, or UnknownName when names that do not exist are the only problem.
  Fields(const Scene& scene, const std::vector<UnknownParameter>& wanted);

  bool empty() const { return refs_.empty(); }
  /// "Body:albedo_grid", one a field.
  const std::vector<std::string>& names() const { return names_; }
  const std::vector<FittedFieldRef>& refs() const { return refs_; }
  /// Those whose derivatives paths carry: all, or none where vertices are fitted.
  std::vector<FieldRef> carried() const;
  /// Whose vertices are fitted; null: nobody's.
  const VerticesRef* vertices() const;
  const std::vector<UnknownParameter>& wanted() const { return wanted_; }
  const FieldValues& start() const { return start_; }
  bool is_environment(std::size_t field) const {
    return std::holds_alternative<EnvironmentRef>(refs_[field]);
  }
  bool has_environment() const {
    for (std::size_t f = 0; f < refs_.size(); ++f)
      if (is_environment(f)) return true;
    return false;
  }
  /// See `shape_of`.
  const std::vector<std::ptrdiff_t>& shape(std::size_t field) const { return shapes_[field]; }
  int channels(std::size_t field) const { return static_cast<int>(shapes_[field].back()); }
  /// Of a surface, as it is at the start; null: a grid, a mesh, or the world's image.
  const Texture* image(std::size_t field) const { return images_[field].get(); }
  /// Whether it is the image of a colour whose channels act on their own channels of the surface alone.
  bool acts_by_channel(std::size_t field) const;
  /// Whether it is an image of a node whose colours encode unit vectors.
  bool encodes_normals(std::size_t field) const { return normals_[field] != 0; }
  /// Which colours of a mesh lie next to each other; null: it is none.
  const MeshGraph* graph(std::size_t field) const { return graphs_[field].get(); }
  /// Whether it lies on a surface.
  bool on_surface(std::size_t field) const { return image(field) || graph(field); }

  Scene scene_with(const Scene& scene, const FieldValues& values) const;
  /// With other values of one field.
  Scene scene_with_field(const Scene& scene, std::size_t field, const Vector& values) const;
  /// Mean of each field, of an image in linear light, of the world's over the sphere; three channels
  /// a field (equal ones where it holds numbers).
  std::vector<Color<double>> means(const FieldValues& values) const;
  Color<double> mean(std::size_t field, const Vector& values) const;
  /// The numbers of a field with the mean of those that differ from the start's, of each channel, at all places.
  Vector evened(std::size_t field, const Vector& values) const;

 private:
  /// Throws InvalidArgument, UnknownName.
  void add(const Scene& scene, const UnknownParameter& one);

  std::vector<FittedFieldRef> refs_;
  std::vector<std::string> names_;
  std::vector<UnknownParameter> wanted_;
  std::vector<std::vector<std::ptrdiff_t>> shapes_;
  std::vector<std::shared_ptr<const Texture>> images_;    ///< see `image`
  std::vector<char> normals_;                             ///< see `encodes_normals`
  std::vector<std::shared_ptr<const MeshGraph>> graphs_;  ///< see `graph`
  FieldValues start_;
};

}  // namespace selenite
