// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "fit/solver/adam.h"
#include "fit/problem/loss.h"
#include "fit/problem/unknowns.h"
#include "render/driver/field_gradient.h"

namespace selenite {

/// Values of all fields, each in the order of its grid's or image's numbers.
using FieldValues = std::vector<Vector>;

/// Unknowns with a value at every place instead of one: the voxels of albedo and density grids, the
/// texels of base colours, as their images hold them. They start at the values that the scene has, or
/// where a search of `UniformFields` ends, and are fitted with Adam, or by `FieldGaussNewton`.
class Fields {
 public:
  /// By its name among the parameters of a material.
  static bool is_field(const UnknownParameter& one);

  /// Takes those of `wanted` that are fields. Reports all problems at once, one line each:
  /// InvalidArgument, or UnknownName when names that do not exist are the only problem.
  Fields(const Scene& scene, const std::vector<UnknownParameter>& wanted);

  bool empty() const { return refs_.empty(); }
  /// "Body:albedo_grid", one a field.
  const std::vector<std::string>& names() const { return names_; }
  const std::vector<FieldRef>& refs() const { return refs_; }
  const std::vector<UnknownParameter>& wanted() const { return wanted_; }
  const FieldValues& start() const { return start_; }
  /// (nz, ny, nx, channels) of a grid, (height, width, 3) of an image.
  const std::vector<std::ptrdiff_t>& shape(std::size_t field) const { return shapes_[field]; }
  int channels(std::size_t field) const { return static_cast<int>(shapes_[field].back()); }
  /// As it is at the start; null: a grid.
  const Texture* image(std::size_t field) const { return images_[field].get(); }

  Scene scene_with(const Scene& scene, const FieldValues& values) const;
  /// Mean of each field, of an image in linear light; three channels a field (equal ones where it
  /// holds numbers).
  std::vector<Color<double>> means(const FieldValues& values) const;

 private:
  std::vector<FieldRef> refs_;
  std::vector<std::string> names_;
  std::vector<UnknownParameter> wanted_;
  std::vector<std::vector<std::ptrdiff_t>> shapes_;
  std::vector<std::shared_ptr<const Texture>> images_;  ///< at the start; none: a grid
  FieldValues start_;
};

/// A step of a field.
struct FieldStep {
  double rate = 1;  ///< in learning rates
  /// Of an image, the share over which its gradient is smoothed: the area of a Gaussian, 4 pi sigma^2.
  /// Neighbours are alike more often than not, and what one photo tells of few texels is mostly noise.
  double spread = 0;
};

/// Adam over all fields; a copy is its whole state.
class FieldAdam {
 public:
  explicit FieldAdam(const Fields& fields);
  /// One step along the gradient of each field, one `how` a field. Throws std::runtime_error naming
  /// field and number when a derivative is not finite.
  void step(FieldValues& values, const std::vector<std::vector<double>>& gradients,
            const std::vector<FieldStep>& how);
  void members(SavedState& state);

 private:
  const Fields* fields_;
  std::vector<AdamMoments> moments_;
};

/// Picture, and the loss's derivative by every value of the fields, from the same samples: in one pass
/// where the loss is a sum over pixels, else in two.
FieldGradient loss_field_gradient(const Scene& scene, const Camera& camera, const Fields& fields,
                                  const Photo& photo, const Loss& loss,
                                  const RenderSettings& settings, Progress* progress);

}  // namespace selenite
