// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/albedo_tables.h"

#include <vector>

#include "model/fresnel.h"
#include "model/ggx.h"

namespace selenite {
namespace {

// Cosines of the mean over the viewer's direction; the integrand is smooth.
constexpr int kCosines = 12;
// A direction in the surface has no visible normals; this is close enough to the limit.
constexpr double kLeastCosine = 1e-4;

double node(int i, int nodes) { return static_cast<double>(i) / (nodes - 1); }

/// n from z = sqrt((n - 1) / (n + 1)).
double index_of_refraction(double z) { return (1 + z * z) / (1 - z * z); }

/// Gauss-Legendre nodes and weights on [0, 1].
struct Gauss {
  std::array<double, kCosines> x, weight;
  Gauss() {
    for (int i = 0; i < kCosines; ++i) {
      double t = std::cos(kPi<double> * (i + 0.75) / (kCosines + 0.5)), slope = 0;
      for (int newton = 0; newton < 8; ++newton) {
        double p = 1, q = 0;  // Legendre polynomials of degrees k and k - 1
        for (int k = 1; k <= kCosines; ++k) {
          const double r = ((2 * k - 1) * t * p - (k - 1) * q) / k;
          q = p;
          p = r;
        }
        slope = kCosines * (t * p - q) / (t * t - 1);
        t -= p / slope;
      }
      x[i] = (1 + t) / 2;
      weight[i] = 1 / ((1 - t * t) * slope * slope);
    }
  }
};

/// Points of the quadrature over visible micronormals: a Fibonacci lattice. Kinks and jumps (horizon,
/// critical angle) may run along either axis, and a lattice has as many coordinates on both as points.
/// Half a turn of azimuth suffices by symmetry.
struct Lattice {
  struct Point {
    Vec2<double> turn;
    double u, weight;
  };
  std::vector<Point> points;

  /// Two consecutive Fibonacci numbers.
  Lattice(int previous, int count) {
    long step = 0;
    for (int i = 0; i < count; ++i, step = (step + previous) % count) {
      const double phi = kPi<double> * static_cast<double>(step) / count;
      // The far tail of the micronormals lies at u = 1: crowd the points there, u = 1 - t^2.
      const double t = (i + 0.5) / count;
      points.push_back({{std::cos(phi), std::sin(phi)}, 1 - t * t, 2 * t / count});
    }
  }
};

/// One visible micronormal with everything that does not depend on the index of refraction.
struct Seen {
  double weight;    // of the quadrature; they add up to 1
  double cos_m;     // m.wi
  double m_z;
  double mirrored;  // G2 / G1 of the reflection, 0 below the horizon
};

/// The lobe's view from one direction.
struct View {
  double cos_i, width2, lambda_i;
  std::vector<Seen> normals;

  View(double roughness, double cosine, const Lattice& lattice) {
    const double width = roughness * roughness;
    cos_i = cosine > kLeastCosine ? cosine : kLeastCosine;
    width2 = width * width;
    const Vec3d wi{safe_sqrt(1 - cos_i * cos_i), 0, cos_i};
    lambda_i = ggx_lambda(tangent2(wi), width2);
    normals.reserve(lattice.points.size());
    for (const Lattice::Point& p : lattice.points) {
      const Vec3d m = ggx_sample_visible(wi, width, p.turn, p.u);
      const double cos_m = dot(m, wi);
      const double out_z = 2 * cos_m * m.z - wi.z;
      normals.push_back({p.weight, cos_m, m.z, out_z > 0 ? shadowing(out_z) : 0});
    }
  }
  /// G2 / G1 for an outgoing direction whose cosine has the absolute value c.
  double shadowing(double c) const {
    // (1 + L_i) / (1 + L_i + L_o) with L_o = (sqrt(c^2 + width2 (1 - c^2)) - c) / (2 c).
    const double root = safe_sqrt(width2 + (1 - width2) * c * c);
    return 2 * c * (1 + lambda_i) / (c * (1 + 2 * lambda_i) + root);
  }
  double mirror() const {
    double sum = 0;
    for (const Seen& s : normals) sum += s.weight * s.mirrored;
    return sum;
  }
  /// The entries for one index of refraction on the axis z.
  struct Entries {
    double rise = 0;
    std::array<double, 2> glass{};  // towards the optically denser and the thinner side
  };
  Entries entries(double z) const {
    if (z <= 0) return {0, {1, 1}};  // nothing is reflected, nothing bent, nothing lost
    const bool conductor = z >= 1;
    const double n = conductor ? 1 : index_of_refraction(z), f0 = square(z * z);
    const std::array<double, 2> eta{n, 1 / n};
    Entries sum;
    for (const Seen& s : normals) {
      const double f = conductor ? 1 : fresnel_dielectric(s.cos_m, n * n - 1);
      if (s.mirrored > 0) sum.rise += s.weight * (conductor ? 1 : fresnel_rise(f, f0));
      sum.glass[0] += s.weight * glass(s, f, eta[0], false);
      const double inside = conductor ? 1 : fresnel_dielectric(s.cos_m, eta[1] * eta[1] - 1);
      sum.glass[1] += s.weight * glass(s, inside, eta[1], true);
    }
    if (width2 <= kSingularWidth2) sum.glass = {1, 1};
    return sum;
  }
  /// Refraction towards the optically thinner side may leave a micronormal on the wrong side of the
  /// surface. Cycles drops such a sample, yet its table counts it; so does this one.
  double glass(const Seen& s, double f, double eta, bool thinner) const {
    if (f >= 1) return s.mirrored;
    const double g = std::sqrt((eta - 1) * (eta + 1) + s.cos_m * s.cos_m);
    const double out_z = (s.m_z * (s.cos_m - g) - cos_i) / eta;
    const bool counted = out_z < 0 || thinner;
    return f * s.mirrored + (counted ? (1 - f) * shadowing(std::abs(out_z)) : 0);
  }
};

}  // namespace

AlbedoTables::AlbedoTables() {
  const Gauss gauss;
  // What means and smooth tables need, and what the jumps of the others need, for errors of 1e-4.
  const Lattice coarse(987, 1597), fine(4181, 6765);
  for (int i = 0; i < kFine; ++i) {
    for (int j = 0; j < kFine; ++j)
      mirror_[i][j] = static_cast<float>(View(node(i, kFine), node(j, kFine), coarse).mirror());
    double mean = 0;
    for (int g = 0; g < kCosines; ++g)
      mean += 2 * gauss.weight[g] * gauss.x[g] * View(node(i, kFine), gauss.x[g], coarse).mirror();
    mirror_mean_[i] = static_cast<float>(mean);
  }
  for (int i = 0; i < kCoarse; ++i) {
    for (int j = 0; j < kCoarse; ++j) {
      const View view(node(i, kCoarse), node(j, kCoarse), fine);
      for (int k = 0; k < kCoarse; ++k) {
        const View::Entries entries = view.entries(node(k, kCoarse));
        rise_[i][j][k] = static_cast<float>(entries.rise);
        for (int thinner = 0; thinner < 2; ++thinner)
          glass_[thinner][i][j][k] = static_cast<float>(entries.glass[thinner]);
      }
    }
    std::array<std::array<double, kCoarse>, 2> mean{};
    for (int g = 0; g < kCosines; ++g) {
      const View view(node(i, kCoarse), gauss.x[g], coarse);
      for (int k = 0; k < kCoarse; ++k) {
        const View::Entries entries = view.entries(node(k, kCoarse));
        for (int thinner = 0; thinner < 2; ++thinner)
          mean[thinner][k] += 2 * gauss.weight[g] * gauss.x[g] * entries.glass[thinner];
      }
    }
    for (int thinner = 0; thinner < 2; ++thinner)
      for (int k = 0; k < kCoarse; ++k)
        glass_mean_[thinner][i][k] = static_cast<float>(mean[thinner][k]);
  }
}

const AlbedoTables& AlbedoTables::get() {
  static const AlbedoTables tables;
  return tables;
}

}  // namespace selenite
