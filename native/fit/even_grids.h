// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "fit/coordinates.h"
#include "fit/fields.h"
#include "fit/optimiser.h"

namespace selenite {

/// A fit whose grids are still of one colour each, seen as a fit of few numbers: in place of an albedo
/// grid stands the one albedo of its material. A search can go through these, and voxels by their
/// thousands start from what it finds. Otherwise whatever else darkens a body (extinction, IOR,
/// roughness) is fitted to make up for voxels that are far off.
class EvenGrids {
 public:
  /// None where voxels differ (a file told where they start), where no scalar or no albedo grid is
  /// unknown, or where there are more than kFewUnknowns numbers. All arguments but the first two must
  /// outlive it.
  static std::unique_ptr<EvenGrids> of(const Scene& scene,
                                       const std::vector<UnknownParameter>& wanted,
                                       const Fields& fields, const std::vector<Capture>& captures,
                                       const Loss& loss, int iterations);
  EvenGrids(const EvenGrids&) = delete;  // the problem refers to members
  EvenGrids& operator=(const EvenGrids&) = delete;

  /// The scalars of the fit in their order, then an albedo for each albedo grid.
  const Problem& problem() const { return problem_; }
  const Coordinates& coordinates() const { return coordinates_; }
  /// Without the albedo grids that are unknown.
  Scene scene_at(const Vector& x) const { return unknowns_.scene_with(scene_, x); }
  /// Those of the fit.
  Vector scalars(const Vector& x) const { return x.head(scalars_); }
  /// The fields of the fit: the albedos of x in all voxels, densities as they start.
  FieldValues fields(const Vector& x) const;

 private:
  EvenGrids(Scene scene, const std::vector<UnknownParameter>& wanted, const Fields& fields,
            const std::vector<Capture>& captures, const Loss& loss, int iterations);

  Scene scene_;
  const Fields& fields_;
  Unknowns unknowns_;
  Eigen::Index scalars_;
  SlotLayout layout_;
  Problem problem_;
  Coordinates coordinates_;
};

}  // namespace selenite
