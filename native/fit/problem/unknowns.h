// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "scene/scene.h"

namespace selenite {

using Vector = Eigen::VectorXd;

/// One parameter to be fitted, as the user asks for it. Bounds hold for every component.
struct UnknownParameter {
  std::string owner;          ///< material, light or "World"
  std::string parameter;      ///< name in the owner's table
  std::vector<double> start;  ///< 1 or 3 values
  double minimum = 0, maximum = 1;
  double learning_rate = 0.03;  ///< Adam's step in units of the parameter; > 0
};

/// What belongs to one scalar unknown.
struct Component {
  int parameter;     ///< counts `Unknowns::parameters`
  int index;         ///< within the parameter
  std::string name;  ///< "Body:roughness", "Body:base_color[0]"
};

/// A fit's unknowns: a flat vector and where its entries live in a scene.
/// The order is that of the rows of SlotLayout over `parameters()`.
class Unknowns {
 public:
  /// Checks everything and reports all problems at once, one line each: InvalidArgument, or
  /// UnknownName when names that do not exist are the only problem.
  /// Fields (see Fields) are passed over; with nothing else there is nothing to fit, or no unknown.
  Unknowns(const Scene& scene, const std::vector<UnknownParameter>& wanted);

  int size() const { return static_cast<int>(components_.size()); }
  const std::vector<ParameterRef>& parameters() const { return parameters_; }
  const std::vector<Parameter>& descriptions() const { return descriptions_; }
  /// "Body:roughness", one per parameter.
  const std::vector<std::string>& names() const { return names_; }
  const std::vector<Component>& components() const { return components_; }
  const Parameter& description_of(int component) const;
  /// `x` with the values of two parameters exchanged of which one is the other's `Parameter::twin`:
  /// one point for each such pair.
  std::vector<Vector> exchanged(const Vector& x) const;

  const Vector& start() const { return start_; }
  const Vector& minimum() const { return minimum_; }
  const Vector& maximum() const { return maximum_; }
  const Vector& learning_rate() const { return learning_rate_; }

  /// Nearest point of the box.
  Vector project(const Vector& x) const { return x.cwiseMax(minimum_).cwiseMin(maximum_); }
  /// The components of one parameter.
  std::vector<double> values_of(int parameter, const Vector& x) const;
  /// `scene` with the values of `x`.
  Scene scene_with(const Scene& scene, const Vector& x) const;

 private:
  std::vector<ParameterRef> parameters_;
  std::vector<Parameter> descriptions_;
  std::vector<std::string> names_;
  std::vector<Component> components_;
  Vector start_, minimum_, maximum_, learning_rate_;
};

}  // namespace selenite
