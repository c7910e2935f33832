// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include "render/media/lamp_target.h"
#include "scene/geometry.h"

namespace selenite {

/// Finds where a ray from inside a body must meet its surface to be refracted to a target. One
/// refraction has a continuum of such places, one for each micronormal that it may take; to the
/// micronormal along the surface's normal belongs the one of a smooth surface.
///
/// Source: Hanika, Droske and Fascione 2015, "Manifold Next Event Estimation"; Zeltner, Georgiev and
/// Jakob 2020, "Specular Manifold Sampling" (micronormals off the normal). docs/method/rendering.md.
class RefractedExit {
 public:
  struct Place {
    Hit hit;
    Surface surface;
    Vec3f direction;  ///< of the ray that meets it
  };
  /// In the plane across the surface's shading normal: two components of a unit vector.
  struct Micronormal {
    double x = 0, y = 0;
    double z2() const { return 1 - x * x - y * y; }
  };
  struct Refraction {
    Micronormal micronormal;
    /// |d micronormal / d direction|, per solid angle around the ray's origin.
    double change = 0;
    /// |d micronormal / d outgoing direction|, at the surface.
    double change_beyond = 0;
  };

  /// `from`: inside of the instance's closed surface. `eta`: index of refraction beyond over within.
  RefractedExit(const Geometry& geometry, int instance, const Vec3f& from, const LampTarget& target)
      : geometry_(geometry), instance_(instance), from_(from), target_(target) {}

  const LampTarget& target() const { return target_; }
  /// Places that it has looked at: each is a ray, and equations where the ray arrives.
  int visited() const { return visited_; }
  /// Where the search begins: on the straight line to the target, or, for a body that has several
  /// such places, on lines beside it.
  static constexpr int kStarts = 5;
  /// Empty if anything else is in the way.
  std::optional<Place> start(int which) const;
  /// Newton's method from a start; empty where it does not arrive within `tolerance`.
  std::optional<Place> find(Place start, double eta, const Micronormal& wanted,
                            double tolerance) const;
  /// What refracts the ray that meets a place to the target; empty if no visible micronormal does.
  std::optional<Refraction> refraction(const Place& at, double eta) const;

 private:
  /// What changes with a place that moves over the plane of its triangle.
  struct Tangent;

  std::optional<Place> meet(const Vec3f& direction) const;
  Tangent tangent(const Place& at, double eta) const;

  const Geometry& geometry_;
  int instance_;
  Vec3f from_;
  LampTarget target_;
  mutable int visited_ = 0;
};

}  // namespace selenite
