// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "fit/problem/fit_problem.h"
#include "fit/state/fit_result.h"

namespace selenite {

/// A part of a run that fits some of its unknowns, with samples and pictures of its own.
struct Stage {
  std::string name;  ///< "" for the only one of a run
  /// Names of the unknowns that it fits, as "Body:roughness". The others keep their values.
  std::vector<std::string> parameters;
  /// Names of the run's fields that are in its scene; the others wait for one colour.
  std::vector<std::string> fields;
  Scene scene;
  std::vector<Photo> photos;  ///< at the size of this stage
  FitSettings settings;
};

/// Where a run stands: the values of its scalars and fields, by name, in the order of its unknowns. A
/// field that waits for one colour to be fitted first holds that colour everywhere.
struct RunPoint {
  std::vector<std::pair<std::string, std::vector<double>>> scalars;
  std::vector<std::pair<std::string, Vector>> fields;

  const std::vector<double>& scalar(const std::string& name) const;
  /// Takes the values that a fit of some of these has.
  void take(const FitProblem& problem, const Vector& x, const FieldValues& values);
};

/// The unknowns of a run, and how one of its stages starts at values that others have found.
class RunUnknowns {
 public:
  /// `stages`: of which each field is in the scene of one at least.
  RunUnknowns(std::vector<UnknownParameter> wanted, const std::vector<Stage>& stages);

  RunPoint start() const;
  /// The same without its fields, which can be large.
  RunPoint scalars_at_start() const;
  /// Of each field by name, as `Fields::means`.
  std::vector<std::pair<std::string, Color<double>>> means_at_start() const;
  /// Fields that no stage up to this one fits, and in whose place one colour is fitted, filled with it.
  void fill_waiting(RunPoint& point, const std::vector<Stage>& stages, std::size_t stage) const;
  /// The scene of a stage at a point.
  Scene scene_at(const Stage& stage, const RunPoint& point) const;
  /// What a stage fits, from a point on.
  std::vector<UnknownParameter> unknowns_at(const Stage& stage, const RunPoint& point) const;
  /// (nz, ny, nx, channels) of a grid, (height, width, 3) of an image.
  const std::vector<std::ptrdiff_t>& shape(const std::string& field) const;

 private:
  struct Field {
    UnknownParameter wanted;
    std::shared_ptr<const Fields> alone;  ///< in the first scene that has it
    std::string colour;                   ///< name of the scalar that stands for it; "": none
  };
  const Field& field(const std::string& name) const;

  std::vector<UnknownParameter> scalars_;
  std::vector<Field> fields_;
};

/// A stage that has ended.
struct EndedStage {
  std::shared_ptr<const FitProblem> problem;
  std::string optimiser;
  FitResult result;
  double seconds = 0;
};

}  // namespace selenite
