// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "fit/problem/unknowns.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "ReparametrizationOptions".
struct ReparametrizationOptions {
  /// Longest steps: what the linear model is trusted for. Of logarithms and roughnesses, of the log of
  /// an excess, and otherwise a share of the range.
  double cap_log = 0.25, cap_log_excess = 0.2, cap_linear = 0.3;
  double cap_angle = 0.1;  ///< of a rotation, radians
  /// Of log(x^3 + shift^3) / 3, the scale of a roughness x. Pictures change with about x^4 next to 0
  /// and with log x far above. Of (power, shift) from (2, 0.1) to (4, 0.3) this keeps what
  /// `render_derivatives` measures closest to the slope.
  double roughness_shift = 0.15;
  double least_roughness = 0.01;  ///< of a slope, which is infinite at 0
  /// Least argument of log(x - 1 + shift): nearer to 1 an index of refraction shows in nothing.
  double least_excess = 0.05;
  double shift_at_zero =
      1e-3;  ///< of a logarithm whose lower bound is 0, as a share of the upper one
  /// Least sqrt(1 - albedo) of a slope, which is 0 at albedo 1: no step from there would ever help.
  double least_root = 0.01;
  double low_roughness = 0.03;  ///< what is rougher does not look perfectly sharp: alpha is 0.001
};

/// Coordinates u of the unknowns in which pictures are closest to linear, by `Parameter::scale`: x, log x
/// or log(x - 1), the logarithms shifted where the bounds reach their pole; log(x^3 + shift^3) / 3 of a
/// roughness; or the diffuse reflectance of a half-space with albedo x.
class Reparametrization {
 public:
  explicit Reparametrization(const Unknowns& unknowns,
                             const ReparametrizationOptions& options = {});

  Vector from_values(const Vector& x) const;
  Vector to_values(const Vector& u) const;
  /// The same for component k alone.
  double from_value(Eigen::Index k, double x) const { return axis(k).from_value(x); }
  double to_value(Eigen::Index k, double u) const { return axis(k).to_value(u); }
  double slope(Eigen::Index k, double x) const { return axis(k).slope(x); }
  /// dx/du at x, per component.
  Vector slope(const Vector& x) const;

  const Vector& minimum() const { return minimum_; }  ///< of u
  const Vector& maximum() const { return maximum_; }
  /// Longest step of each component.
  const Vector& cap() const { return cap_; }

  /// Diffuse reflectance of a half-space that scatters evenly with that albedo: 0 at 0, and 1 at 1,
  /// where its slope is infinite. Source: van de Hulst 1980, "Multiple Light Scattering",
  /// similarity form; docs/method/optimisation.md, "Reparametrization".
  static double reflectance(double albedo);
  static double albedo_of(double reflectance);

 private:
  struct Axis {
    enum class Kind { kLinear, kLogarithm, kRoughness, kReflectance } kind;
    double shift = 0;  ///< u = log(x + shift), log(x^3 + shift^3) / 3
    double least = 0;  ///< of what a slope has its pole or its root in

    double from_value(double x) const;
    double to_value(double u) const;
    double slope(double x) const;
  };
  const Axis& axis(Eigen::Index k) const { return axes_[static_cast<std::size_t>(k)]; }
  template <class F>
  Vector each(const Vector& in, F&& f) const;

  std::vector<Axis> axes_;
  Vector minimum_, maximum_, cap_;
};

}  // namespace selenite
