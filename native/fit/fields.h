// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fit/adam.h"
#include "fit/loss.h"
#include "fit/unknowns.h"
#include "render/field_gradient.h"

namespace selenite {

/// Values of all fields, each as long as its grid's.
using FieldValues = std::vector<Vector>;

/// Unknowns with a value at every voxel instead of one: albedo and density grids. They start at the
/// values that the scene has, or where a search of `EvenGrids` ends, and are always fitted with Adam.
class Fields {
 public:
  /// Which grid an unknown is, by its name among the parameters of a material; empty: none.
  static std::optional<GridKind> kind_of(const UnknownParameter& one);
  static bool is_field(const UnknownParameter& one) { return kind_of(one).has_value(); }

  /// Takes those of `wanted` that are fields. Reports all problems at once, one line each:
  /// InvalidArgument, or UnknownName when names that do not exist are the only problem.
  Fields(const Scene& scene, const std::vector<UnknownParameter>& wanted);

  bool empty() const { return refs_.empty(); }
  /// "Body:albedo_grid", one a field.
  const std::vector<std::string>& names() const { return names_; }
  const std::vector<GridRef>& refs() const { return refs_; }
  const std::vector<UnknownParameter>& wanted() const { return wanted_; }
  const FieldValues& start() const { return start_; }
  /// The lattice of a field: its values are those of the scene at the start.
  const Grid& grid(std::size_t field) const { return *grids_[field]; }

  Scene scene_with(const Scene& scene, const FieldValues& values) const;
  /// Mean of each field, three channels a field (equal ones where it holds numbers).
  std::vector<Color<double>> means(const FieldValues& values) const;

 private:
  std::vector<GridRef> refs_;
  std::vector<std::string> names_;
  std::vector<UnknownParameter> wanted_;
  std::vector<std::shared_ptr<const Grid>> grids_;
  FieldValues start_;
};

/// Adam over all fields; a copy is its whole state.
class FieldAdam {
 public:
  explicit FieldAdam(const Fields& fields);
  /// One step along the gradient of each field, `rate` times its learning rate long. Throws
  /// std::runtime_error naming field and voxel when a derivative is not finite.
  void step(FieldValues& values, const std::vector<std::vector<double>>& gradients,
            double rate = 1);
  void members(SavedState& state);

 private:
  const Fields* fields_;
  std::vector<AdamMoments> moments_;
};

/// Picture, and the loss's derivative by every voxel, from the same samples: in one pass where the
/// loss is a sum over pixels, else in two.
FieldGradient loss_field_gradient(const Scene& scene, const Camera& camera, const Fields& fields,
                                  const Capture& capture, const Loss& loss,
                                  const RenderSettings& settings, Progress* progress);

}  // namespace selenite
