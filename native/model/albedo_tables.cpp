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

/// The lobe's view from one direction: its visible micronormals, with everything that does not depend
/// on the index of refraction. One array per quantity, so that the loops over them vectorise.
class View {
 public:
  /// The entries for one index of refraction on the axis z.
  struct Entries {
    double rise = 0;
    std::array<double, 2> glass{1, 1};  // towards the optically denser and the thinner side
  };

  View(double roughness, double cosine, const Lattice& lattice) : lattice_(lattice) {
    const double width = roughness * roughness;
    cos_i_ = cosine > kLeastCosine ? cosine : kLeastCosine;
    width2_ = width * width;
    const Vec3d wi{safe_sqrt(1 - cos_i_ * cos_i_), 0, cos_i_};
    lambda_i_ = ggx_lambda(tangent2(wi), width2_);
    const std::size_t count = lattice.points.size();
    cos_m_.resize(count), m_z_.resize(count), mirrored_.resize(count), terms_.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3d m = ggx_sample_visible(wi, width, lattice.points[i].turn, lattice.points[i].u);
      const double cos_m = dot(m, wi), out_z = 2 * cos_m * m.z - wi.z;
      cos_m_[i] = static_cast<float>(cos_m);
      m_z_[i] = static_cast<float>(m.z);
      mirrored_[i] = out_z > 0 ? shadowing(static_cast<float>(out_z)) : 0;
    }
  }

  double mirror() const {
    return mean([&](std::size_t i) { return mirrored_[i]; });
  }

  Entries entries(double z) {
    if (z <= 0) return {};  // nothing is reflected, nothing bent, nothing lost
    Entries result;
    const bool conductor = z >= 1;
    const double n = conductor ? 1 : index_of_refraction(z);
    const auto e = static_cast<float>(n * n - 1), f0 = static_cast<float>(square(z * z));
    result.rise = mean([&](std::size_t i) {
      const float f = conductor ? 1 : fresnel_dielectric(cos_m_[i], e);
      return mirrored_[i] > 0 ? fresnel_rise(f, conductor ? 0 : f0) : 0;
    });
    if (width2_ <= kSingularWidth2) return result;
    if (conductor) return {result.rise, {mirror(), mirror()}};
    for (const bool thinner : {false, true})
      result.glass[thinner] = glass(static_cast<float>(thinner ? 1 / n : n), thinner);
    return result;
  }

 private:
  /// G2 / G1 for an outgoing direction whose cosine has the absolute value c:
  /// (1 + L_i) / (1 + L_i + L_o) with L_o = (sqrt(c^2 + width2 (1 - c^2)) - c) / (2 c).
  float shadowing(float c) const {
    const auto lambda = static_cast<float>(lambda_i_), width2 = static_cast<float>(width2_);
    const float root = std::sqrt(width2 + (1 - width2) * c * c);
    return 2 * c * (1 + lambda) / (c * (1 + 2 * lambda) + root);
  }
  /// Refraction towards the optically thinner side may leave a micronormal on the wrong side of the
  /// surface. Cycles drops such a sample, yet its table counts it; so does this one.
  double glass(float eta, bool thinner) {
    const float e = (eta - 1) * (eta + 1), inverse = 1 / eta;
    const auto cos_i = static_cast<float>(cos_i_);
    return mean([&](std::size_t i) {
      const float c = cos_m_[i], g2 = e + c * c, g = std::sqrt(g2 > 0 ? g2 : 0);
      const float f = fresnel_dielectric(c, e);
      const float out_z = (m_z_[i] * (c - g) - cos_i) * inverse;
      const float through = (1 - f) * shadowing(std::abs(out_z));
      return f * mirrored_[i] + (thinner || out_z < 0 ? through : 0);
    });
  }
  template <class Term>
  double mean(const Term& term) const {
    for (std::size_t i = 0; i < terms_.size(); ++i) terms_[i] = term(i);
    double sum = 0;
    for (std::size_t i = 0; i < terms_.size(); ++i) sum += lattice_.points[i].weight * terms_[i];
    return sum;
  }

  const Lattice& lattice_;
  double cos_i_, width2_, lambda_i_;
  std::vector<float> cos_m_;     // m.wi
  std::vector<float> m_z_;       // m.z
  std::vector<float> mirrored_;  // G2 / G1 of the reflection, 0 below the horizon
  mutable std::vector<float> terms_;
};

}  // namespace

AlbedoTables::AlbedoTables() {
  const Gauss gauss;
  // What means and smooth tables need, and what the jumps of the others need, for errors of 1e-4.
  const Lattice coarse(1597, 2584), fine(6765, 10946);
  for (int i = 0; i < kFine; ++i) {
    for (int j = 0; j < kFine; ++j)
      mirror_[i][j] = static_cast<float>(View(node(i, kFine), node(j, kFine), fine).mirror());
    double mean = 0;
    for (int g = 0; g < kCosines; ++g)
      mean += 2 * gauss.weight[g] * gauss.x[g] * View(node(i, kFine), gauss.x[g], coarse).mirror();
    mirror_mean_[i] = static_cast<float>(mean);
  }
  for (int i = 0; i < kCoarse; ++i) {
    for (int j = 0; j < kCoarse; ++j) {
      View view(node(i, kCoarse), node(j, kCoarse), fine);
      for (int k = 0; k < kCoarse; ++k) {
        const View::Entries entries = view.entries(node(k, kCoarse));
        rise_[i][j][k] = static_cast<float>(entries.rise);
        for (int thinner = 0; thinner < 2; ++thinner)
          glass_[thinner][i][j][k] = static_cast<float>(entries.glass[thinner]);
      }
    }
    std::array<std::array<double, kCoarse>, 2> mean{};
    for (int g = 0; g < kCosines; ++g) {
      View view(node(i, kCoarse), gauss.x[g], coarse);
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
