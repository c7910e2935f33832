// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "fit/photo/photo.h"
#include "render/film/slots.h"
#include "scene/scene.h"

namespace selenite {

using Vector = Eigen::VectorXd;

/// One parameter to be fitted, as the user asks for it. Bounds hold for every component.
struct UnknownParameter {
  std::string owner;          ///< material, light or "World"; the id of a photo
  std::string parameter;      ///< name in the owner's table
  std::vector<double> start;  ///< 1 or 3 values
  double minimum = 0, maximum = 1;
  double learning_rate = 0.03;  ///< Adam's step in units of the parameter; > 0

  /// As "Body:roughness".
  std::string name() const { return owner + ":" + parameter; }
};

/// Where a parameter of a photo lives. `field` counts the `fields` of PhotoParameters.
struct PhotoParameterRef {
  std::string photo;  ///< its id
  int field;
  bool operator==(const PhotoParameterRef&) const = default;
  bool same_owner(const PhotoParameterRef& o) const { return photo == o.photo; }
};
/// Where an unknown lives: in the scene, or in a photo.
using UnknownRef = std::variant<ParameterRef, PhotoParameterRef>;

/// What belongs to one scalar unknown.
struct Component {
  int parameter;     ///< counts `Unknowns::parameters`
  int index;         ///< within the parameter
  std::string name;  ///< "Body:roughness", "Body:base_color[0]"
};

/// A fit's unknowns: a flat vector and where its entries live in a scene and its photos.
class Unknowns {
 public:
  /// Checks everything and reports all problems at once, one line each: InvalidArgument, or
  /// UnknownName when names that do not exist are the only problem.
  /// Fields (see Fields) are passed over; with nothing else there is nothing to fit, or no unknown.
  Unknowns(const Scene& scene, const std::vector<UnknownParameter>& wanted,
           const std::vector<Photo>& photos = {});

  int size() const { return static_cast<int>(components_.size()); }
  const std::vector<UnknownRef>& parameters() const { return parameters_; }
  const std::vector<Parameter>& descriptions() const { return descriptions_; }
  /// "Body:roughness", one per parameter.
  const std::vector<std::string>& names() const { return names_; }
  const std::vector<Component>& components() const { return components_; }
  const Parameter& description_of(int component) const;
  /// The first component of a parameter, if it is unknown.
  std::optional<int> component_of(const UnknownRef& ref) const;
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
  /// The parameters of a photo with the values of `x`.
  PhotoParameters photo_values(const Photo& photo, const Vector& x) const;
  /// Slots and rows of a film with the derivatives by all unknowns; the rows are in the order of the
  /// components. The slots of photos' parameters, which no render fills, stand behind the others:
  /// only rows know of them.
  SlotLayout layout(const Scene& scene) const;
  /// Whether a parameter can show in a photo: one of the photos only in its own.
  bool is_seen(std::size_t parameter, const Scene& scene, const Photo& photo) const;

 private:
  std::vector<UnknownRef> parameters_;
  std::vector<Parameter> descriptions_;
  std::vector<std::string> names_;
  std::vector<Component> components_;
  Vector start_, minimum_, maximum_, learning_rate_;
};

/// How many slots a film has whose rows are those of a layout.
std::size_t film_slots(const SlotLayout& layout);

}  // namespace selenite
