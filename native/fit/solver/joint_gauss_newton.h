// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "fit/solver/field_gauss_newton.h"
#include "fit/solver/gauss_newton.h"

namespace selenite {

/// Gauss-Newton for scalars together with the voxels of albedo grids, which can make up for each other.
///
/// The instruments of the scalars are made orthogonal to the Jacobian of the voxels, so that their
/// equations hold wherever the voxels are (`FieldGaussNewton`). Each step of the scalars takes the
/// voxels along. Iterations render either the derivatives by the scalars (`step`) or those by the
/// voxels (`gather_fields`, then `step_by_residuals`); both move all unknowns.
///
/// No step is rejected: the voxels that went along would have to return as well. A copy is the whole
/// state.
class JointGaussNewton {
 public:
  /// Whether the fields are albedo grids of colours, and numbers and photos are not too many.
  static bool applies(const Fields& fields, const std::vector<Photo>& photos,
                      const FieldGaussNewtonOptions& options = {}) {
    return FieldGaussNewton::applies(fields, photos, options);
  }
  /// For fields that it applies to, which start at `start`: there they are expected before any photo.
  /// The problem must outlive it.
  JointGaussNewton(const Problem& problem, const Fields& fields, const FieldValues& start,
                   const GaussNewtonOptions& options = {},
                   const FieldGaussNewtonOptions& field_options = {});

  /// Derivatives of photo i by the fields join the sums.
  /// `samples`: those of an iteration count 1.
  void gather_fields(std::size_t i, FieldJacobian derivatives, double samples = 1);
  /// The next scalars, inside the bounds, from one observation per photo; `fields` are the next fields.
  /// Throws std::runtime_error naming the unknown when a derivative is not finite.
  Vector step(const Vector& x, std::span<const Observation> seen);
  /// The same without derivatives by the scalars. Returns `x` before the first `step`.
  /// `samples` of the observations, in units of those of an iteration.
  Vector step_by_residuals(const Vector& x, std::span<const Observation> seen, double samples = 1);
  /// See `Optimiser`.
  void watch(const Progress* progress) { scalars_.watch(progress); }
  bool converged() const { return scalars_.converged(); }
  void reset_equations() { scalars_.reset_equations(); }

  const FieldValues& fields() const { return fields_.values(); }
  /// Goes on from these fields, at which no residual has been seen.
  void set_fields(const FieldValues& values) { fields_.set_values(values); }
  const GaussNewton& scalars() const { return scalars_; }
  /// Its `shares` and `cell` say what `gather_fields` takes.
  const FieldGaussNewton& field_solver() const { return fields_; }
  void members(SavedState& state);

  /// For refinement passes at fixed values: takes from the instruments of all photos what fields can
  /// make up for. The fields see the residuals of the whole photos; `done`: share of the iterations, `keep`: of the
  /// residuals of the passes before. Returns as `FieldGaussNewton::eliminate_fields` does.
  static Eigen::MatrixXd eliminate_fields(std::vector<GaussNewton::PhotoEquations>& all,
                                          FieldGaussNewton& fields, double done, double keep);

 private:
  /// The fields see the residuals of an iteration.
  void add_residuals(std::span<const Observation> seen, double samples = 1);
  /// `halves`: of the residuals, with the priors of free gains.
  Measurement measure(std::span<const Observation> seen, const std::vector<Halves>& halves);
  /// Derivatives by texels that wait join the sums.
  void gather_waiting();
  bool has_scalars() const;
  /// Share of the equations that is kept once `joined` iterations have joined them.
  double kept(int joined) const;

  const Problem* problem_;
  double aging_, numbers_kept_;
  GaussNewton scalars_;
  FieldGaussNewton fields_;
  struct Waiting {
    std::size_t photo;
    FieldJacobian derivatives;
    double samples;
  };
  std::vector<Waiting> waiting_;  ///< of photos, by texels
  int joined_ = 0;  ///< iterations that have joined the equations, those of the fields included
};

}  // namespace selenite
