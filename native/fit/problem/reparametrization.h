// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "fit/problem/unknowns.h"

namespace selenite {

/// What is rougher than that does not look sharp: alpha is 0.001.
inline constexpr double kLowRoughness = 0.03;

/// Reparametrization in which the picture is closest to linear, as the table says
/// (Parameter::coordinate): x, log x or log(x - 1), the logarithms shifted where the bounds reach
/// their pole, log(x^3 + 0.15^3) / 3 of a roughness, or the diffuse reflectance of a half-space with
/// albedo x.
class Reparametrization {
 public:
  explicit Reparametrization(const Unknowns& unknowns);

  Vector from_values(const Vector& x) const;
  Vector to_values(const Vector& u) const;
  /// dx/du at x, per component.
  Vector slope(const Vector& x) const;

  const Vector& minimum() const { return minimum_; }  ///< of u
  const Vector& maximum() const { return maximum_; }
  /// Farthest that one step may go, per component: what the linear model is trusted for.
  const Vector& cap() const { return cap_; }

  /// Diffuse reflectance of a half-space that scatters evenly with that albedo, in [0, 1]: 0 at 0,
  /// 1 at 1, where its slope is infinite. Source: van de Hulst 1980, "Multiple Light Scattering",
  /// similarity form; docs/method/optimisation.md, "Reparametrization".
  static double reflectance(double albedo);
  static double albedo_of(double reflectance);

 private:
  struct Axis {
    enum class Kind { kLinear, kLogarithm, kRoughness, kReflectance } kind;
    double shift = 0;  ///< u = log(x + shift), log(x^3 + shift^3) / 3

    double from_value(double x) const;
    double to_value(double u) const;
    double slope(double x) const;
  };
  template <class F>
  Vector each(const Vector& in, F&& f) const;

  std::vector<Axis> axes_;
  Vector minimum_, maximum_, cap_;
};

}  // namespace selenite
