// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fit/problem/fields.h"
#include "fit/problem/problem.h"
#include "fit/problem/reparametrization.h"

namespace selenite {

/// A fit whose grids, images and meshes are still of one colour each, seen as a fit of few numbers: in
/// place of an albedo grid stands the one albedo of its material, of an image or the colours of a mesh the
/// one value of its parameter, of the world's image a colour that multiplies it. A search can
/// go through these, and voxels and texels by their thousands start from what it finds. Otherwise
/// whatever else darkens a body (extinction, IOR, roughness) is fitted to make up for them while they
/// are far off.
class UniformFields {
 public:
  /// None where voxels or texels of a material differ (something told where they start), where no scalar or no colour
  /// is unknown, or where there are more than kFewUnknowns numbers. All arguments but the first two must
  /// outlive it.
  static std::unique_ptr<UniformFields> of(const Scene& scene,
                                           const std::vector<UnknownParameter>& wanted,
                                           const Fields& fields, const std::vector<Photo>& photos,
                                           const Loss& loss, int iterations);
  UniformFields(const UniformFields&) = delete;  // the problem refers to members
  UniformFields& operator=(const UniformFields&) = delete;

  /// The scalars of the fit in their order, then a colour or number for each field. That of the
  /// world's image stays within `kTintFactor` of 1.
  const Problem& problem() const { return problem_; }
  const Reparametrization& reparametrization() const { return reparametrization_; }
  /// Without the albedo grids and images that are unknown.
  Scene scene_at(const Vector& x) const { return unknowns_.scene_with(scene_, x); }
  /// Those of the fit.
  Vector scalars(const Vector& x) const { return x.head(scalars_); }
  /// The light that the colour of the world's image multiplies from now on.
  void set_light(const FieldValues& fields);
  /// The fields of the fit: the colours of x in all voxels and texels, densities as they start.
  FieldValues fields(const Vector& x) const;

 private:
  static constexpr double kTintFactor = 2;
  /// A field for which one colour stands.
  struct Colour {
    std::size_t field;
    std::string owner, parameter;
    int width;        ///< 1 or 3 numbers
    int map_of = -1;  ///< the parameter of the material that has the map; -1: an albedo grid
    std::shared_ptr<const Texture> image{};  ///< none: a grid, a mesh, or the world's image
    bool tints = false;                      ///< it multiplies what the field starts with
    /// As the field holds it, from linear light, and back.
    Color<double> stored(const Color<double>& linear) const;
    Color<double> linear(const Color<double>& stored) const;
  };
  UniformFields(const Scene& scene, const std::vector<UnknownParameter>& wanted,
                const Fields& fields, const std::vector<Photo>& photos, const Loss& loss,
                int iterations);
  /// None: the field stays as it starts.
  static std::optional<Colour> colour_of(const Scene& scene, std::size_t field,
                                         const ImageRef& ref);
  static std::optional<Colour> colour_of(const Scene& scene, std::size_t field, const GridRef& ref);
  static std::optional<Colour> colour_of(const Scene& scene, std::size_t field,
                                         const EnvironmentRef& ref);
  static std::optional<Colour> colour_of(const Scene& scene, std::size_t field,
                                         const VertexColorsRef& ref);
  /// Nothing like one colour stands for any other.
  static std::optional<Colour> colour_of(const Scene&, std::size_t, const auto&) {
    return std::nullopt;
  }
  static std::vector<Colour> colours_of(const Scene& scene, const Fields& fields);
  static Eigen::Index width_of(const std::vector<Colour>& colours);
  static std::vector<UnknownParameter> few_of(const std::vector<UnknownParameter>& wanted,
                                              const Fields& fields,
                                              const std::vector<Colour>& colours);
  static Scene without(Scene scene, const std::vector<Colour>& colours);

  const Fields& fields_;
  std::vector<Colour> colours_;
  FieldValues base_;  ///< what colours multiply
  Scene scene_;
  Unknowns unknowns_;
  Eigen::Index scalars_;
  SlotLayout layout_;
  Problem problem_;
  Reparametrization reparametrization_;
};

}  // namespace selenite
