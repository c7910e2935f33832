// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <vector>

namespace selenite {

/// Albedos of single-scattering GGX lobes seen from one direction: means over the visible
/// micronormals, by quadrature to about 1e-6.
///
/// The micronormal m makes the angle b with the viewer and is turned by phi about it. The Fresnel term
/// depends on b alone, and every limit (of visibility, of what is reflected below the horizon) is an
/// explicit limit of cos phi, so that nothing jumps inside an interval of integration.
class AlbedoView {
 public:
  /// cosine: of the viewer, > 0.
  AlbedoView(double roughness, double cosine);

  /// Reflection with reflectance 1.
  double mirror() const;
  /// Rise of the reflectance of index of refraction n > 1; reflections below the horizon count 0.
  double rise(double n) const;
  /// White glass, reflection and refraction; n: the far side over the viewer's side. Towards an
  /// optically thinner side a micronormal may refract to the wrong side of the surface. Cycles drops
  /// such a sample, yet its table counts it; so does this.
  double glass(double n) const;

 private:
  static constexpr int kTurns = 18;  // points around the viewer, in half a turn

  /// The micronormals at one angle from the viewer.
  struct Ring {
    double cos_b = 0, weight = 0;    // weight: G1 sin b cos b db / cos_i
    double mirrored = 0, above = 0;  // integrals of D G2 / G1 and D of those reflected up
    std::array<double, kTurns> m_z{}, share{};  // of the visible ones
  };

  void add_rings(double from, double to, std::vector<Ring>& rings) const;
  Ring ring(double b, double weight) const;
  double sum(const std::vector<Ring>& rings, double n) const;
  template <class Point>
  void around(double cos_b, double sin_b, double least_cos_phi, const Point& point) const;
  double shadowing(double cosine) const;

  double cos_i_, sin_i_, theta_i_, width2_, lambda_i_, masking_;
  std::vector<double> edges_;  // of the intervals of b
  std::vector<Ring> rings_;    // all of them, in order
};

}  // namespace selenite
