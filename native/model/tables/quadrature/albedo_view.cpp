// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/tables/quadrature/albedo_view.h"

#include <algorithm>
#include <cmath>

#include "model/fresnel.h"
#include "model/micronormals.h"
#include "model/tables/gauss_legendre.h"

namespace selenite {
namespace {

constexpr int kSteps = 6;         // points in an interval of b
constexpr double kGrading = 3.5;  // ratio of neighbouring intervals towards a peak or a root

const GaussLegendre<kSteps>& steps() {
  static const GaussLegendre<kSteps> rule;
  return rule;
}

/// Edges of intervals that shrink towards `centre` down to `least`, inside (from, to).
void grade(double centre, double least, double from, double to, std::vector<double>& edges) {
  for (const double side : {-1., 1.})
    for (double d = least; d < to - from; d *= kGrading) {
      const double edge = centre + side * d;
      if (edge > from && edge < to) edges.push_back(edge);
    }
  if (centre > from && centre < to) edges.push_back(centre);
}

}  // namespace

AlbedoView::AlbedoView(double roughness, double cosine)
    : cos_i_(cosine), sin_i_(std::sqrt((1 - cosine) * (1 + cosine))) {
  const double width = roughness * roughness, quarter = kPi<double> / 2;
  theta_i_ = std::atan2(sin_i_, cos_i_);
  width2_ = width * width;
  lambda_i_ = ggx_lambda(square(sin_i_ / cos_i_), width2_);
  masking_ = 1 / (1 + lambda_i_);
  edges_ = {0, quarter};
  grade(theta_i_, width / 2, 0, quarter, edges_);  // the lobe's peak
  // Where the whole turn is no longer reflected upwards, and where nothing is: roots.
  const double height = quarter - theta_i_;
  grade(height / 2, std::max(height, 1e-4) / 40, 0, quarter, edges_);
  grade(quarter - height / 2, std::max(height, 1e-4) / 300, 0, quarter, edges_);
  if (height > 0 && height < quarter) edges_.push_back(height);  // some are no longer visible
  std::sort(edges_.begin(), edges_.end());
  edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
  for (std::size_t i = 1; i < edges_.size(); ++i) add_rings(edges_[i - 1], edges_[i], rings_);
}

void AlbedoView::add_rings(double from, double to, std::vector<Ring>& rings) const {
  for (int k = 0; k < kSteps; ++k)
    rings.push_back(ring(from + (to - from) * steps().x[k], (to - from) * steps().weight[k]));
}

/// Calls point(k, m_z, cos phi, share) for the points of a half turn with cos phi above a limit; the
/// shares sum up to the integral of the density of micronormals D over the whole turn.
///
/// D has the factor 1 / (p - q cos phi)^2, a peak at phi = 0. tan(phi/2) = k tan(psi/2) with
/// k^2 = (p - q) / (p + q) gives (p - q cos phi) (p + q cos psi) = p^2 - q^2, which has none.
template <class Point>
void AlbedoView::around(double cos_b, double sin_b, double least_cos_phi,
                        const Point& point) const {
  static const GaussLegendre<kTurns> rule;
  const double a = cos_b * cos_i_, b = sin_b * sin_i_;
  const double root = std::sqrt(1 - width2_), p = 1 - root * a, q = root * b;
  const double pq2 = (p - q) * (p + q);
  double end = 1;  // tan(psi / 4), which spares a cosine per point
  if (least_cos_phi > -1) {
    const double cos_psi = (p * least_cos_phi - q) / (p - q * least_cos_phi);
    end = std::tan(std::acos(std::clamp(cos_psi, -1., 1.)) / 4);
  }
  // D dphi = width2 / pi / (1 + root m_z)^2 (p + q cos psi) / (p^2 - q^2)^(3/2) dpsi, on both sides.
  // Towards the end of the turn, where the shadowing is steep, the points are crowded: 1 - y^2.
  const double scale = 2 * width2_ * kInvPi<double> / (pq2 * std::sqrt(pq2));
  for (int k = 0; k < kTurns; ++k) {
    const double y = 1 - rule.x[k], t = end * (1 - y * y), inverse = 1 / (1 + t * t);
    const double cos_half = (1 - t * t) * inverse;
    const double cos_psi = 2 * cos_half * cos_half - 1, d = p + q * cos_psi;
    const double cos_phi = (p * cos_psi + q) / d, m_z = a + b * cos_phi;
    point(k, m_z, cos_phi,
          scale * rule.weight[k] * 8 * y * end * inverse * d / square(1 + root * m_z));
  }
}

AlbedoView::Ring AlbedoView::ring(double b, double weight) const {
  const double cos_b = std::cos(b), sin_b = std::sin(b);
  Ring r;
  r.cos_b = cos_b;
  r.weight = weight * sin_b * cos_b * masking_ / cos_i_;
  // Height of the mirror image of the viewer: along + across cos phi.
  const double along = (2 * cos_b * cos_b - 1) * cos_i_, across = 2 * sin_b * cos_b * sin_i_;
  const auto limit = [](double constant, double slope) {
    return slope > std::abs(constant) ? -constant / slope : constant > 0 ? -1. : 1.;
  };
  const double lowest = limit(along, across);
  if (lowest < 1)
    around(cos_b, sin_b, lowest, [&](int, double, double cos_phi, double share) {
      r.above += share;
      r.mirrored += share * shadowing(along + across * cos_phi);
    });
  around(cos_b, sin_b, limit(cos_b * cos_i_, sin_b * sin_i_),
         [&](int k, double m_z, double, double share) {
           r.m_z[k] = m_z;
           r.share[k] = share;
         });
  return r;
}

/// G2 / G1 for an outgoing direction of that height:
/// (1 + L_i) / (1 + L_i + L_o) with L_o = (sqrt(c^2 + width2 (1 - c^2)) - c) / (2 c).
double AlbedoView::shadowing(double cosine) const {
  const double c = std::abs(cosine);
  const double root = std::sqrt(width2_ + (1 - width2_) * c * c);
  return 2 * c * (1 + lambda_i_) / (c * (1 + 2 * lambda_i_) + root);
}

double AlbedoView::mirror() const {
  double total = 0;
  for (const Ring& r : rings_) total += r.weight * r.mirrored;
  return total;
}

double AlbedoView::rise(double n) const {
  const double e = (n - 1) * (n + 1);
  double total = 0;
  for (const Ring& r : rings_) total += r.weight * r.above * dielectric_rise(r.cos_b, e);
  return total;
}

double AlbedoView::sum(const std::vector<Ring>& rings, double n) const {
  const double e = (n - 1) * (n + 1), inverse = 1 / n;
  double total = 0;
  for (const Ring& r : rings) {
    const double f = fresnel_dielectric(r.cos_b, e);
    double through = 0;
    if (f < 1) {
      const double bend = (r.cos_b - safe_sqrt(e + r.cos_b * r.cos_b)) * inverse;
      const double height = cos_i_ * inverse;
      for (int k = 0; k < kTurns; ++k) through += r.share[k] * shadowing(r.m_z[k] * bend - height);
    }
    total += r.weight * (f * r.mirrored + (1 - f) * through);
  }
  return total;
}

double AlbedoView::glass(double n) const {
  if (n >= 1) return sum(rings_, n);
  // Beyond the critical angle all is reflected; the transmittance begins there as a root. From the
  // second angle on, refraction may lead to the wrong side. Around both the intervals are cut finer.
  const double height = kPi<double> / 2 - theta_i_;
  const double critical = std::asin(n);
  const double horizontal =
      std::min(std::atan2(std::sin(height), 1 / n - std::cos(height)), critical);
  const auto width = [this](std::ptrdiff_t i) { return edges_[i + 1] - edges_[i]; };
  const auto after = [this](double b) {
    return std::upper_bound(edges_.begin(), edges_.end(), b) - edges_.begin();
  };
  std::ptrdiff_t first = after(horizontal) - 1, last = after(critical);
  while (first > 0 && horizontal - edges_[first] < width(first - 1) / kGrading) --first;
  while (last + 1 < std::ssize(edges_) && edges_[last] - critical < width(last) / kGrading) ++last;
  std::vector<double> edges(edges_.begin() + first, edges_.begin() + last + 1);
  const double from = edges.front(), to = edges.back();
  for (const double root : {critical, horizontal}) grade(root, (to - from) / 300, from, to, edges);
  std::sort(edges.begin(), edges.end());
  std::vector<Ring> rings(rings_.begin(), rings_.begin() + first * kSteps);
  for (std::size_t i = 1; i < edges.size(); ++i) add_rings(edges[i - 1], edges[i], rings);
  rings.insert(rings.end(), rings_.begin() + last * kSteps, rings_.end());
  return sum(rings, n);
}

}  // namespace selenite
