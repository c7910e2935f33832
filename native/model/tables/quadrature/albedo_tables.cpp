// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/tables/albedo_tables.h"

#include <algorithm>
#include <array>

#include "math/parallel_for.h"
#include "model/fresnel.h"
#include "model/tables/gauss_legendre.h"
#include "model/tables/quadrature/albedo_view.h"

namespace selenite {
namespace {

// Cosines of the mean over the viewer's direction, in each of the intervals between kSplits.
constexpr int kCosines = 5;
constexpr std::array<double, 8> kSplits{0, 0.04, 0.15, 0.3, 0.45, 0.6, 0.8, 1};
// Where Cycles evaluated the ends of its axes.
constexpr double kLeast = 1e-4, kMostAxis = 0.99;

double node(int i, int nodes) { return std::max(static_cast<double>(i) / (nodes - 1), kLeast); }

/// n from z = sqrt((n - 1) / (n + 1)).
double index_of_refraction(int k, int nodes) {
  const double z = std::min(node(k, nodes), kMostAxis);
  return (1 + z * z) / (1 - z * z);
}

/// Calls point(cosine, weight) for a cosine-weighted mean over the hemisphere.
template <class Point>
void over_hemisphere(const Point& point) {
  const GaussLegendre<kCosines> rule;
  for (std::size_t i = 1; i < kSplits.size(); ++i) {
    const double from = kSplits[i - 1], span = kSplits[i] - from;
    for (int g = 0; g < kCosines; ++g) {
      const double c = from + span * rule.x[g];
      point(c, 2 * c * span * rule.weight[g]);
    }
  }
}

}  // namespace

AlbedoTables::AlbedoTables() {
  // The rows with the most work come first.
  parallel_for(kCoarse + kFine, 0,
               [this](int row) { row < kCoarse ? fill_coarse(row) : fill_fine(row - kCoarse); });
}

void AlbedoTables::fill_fine(int i) {
  const double roughness = node(i, kFine);
  // At the least roughness the lobe is a mirror: nothing is lost.
  mirror_[i].fill(1);
  mirror_mean_[i] = 1;
  if (i == 0) return;
  for (int j = 0; j < kFine; ++j)
    mirror_[i][j] = static_cast<float>(AlbedoView(roughness, node(j, kFine)).mirror());
  double mean = 0;
  over_hemisphere([&](double c, double w) { mean += w * AlbedoView(roughness, c).mirror(); });
  mirror_mean_[i] = static_cast<float>(mean);
}

void AlbedoTables::fill_coarse(int i) {
  for (int j = 0; j < kCoarse; ++j) fill_glass(i, j);
  for (int k = 0; k < kCoarse; ++k) glass_mean_[0][i][k] = glass_mean_[1][i][k] = 1;
  if (i == 0) return;
  std::array<std::array<double, kCoarse>, 2> mean{};
  over_hemisphere([&](double c, double w) {
    const AlbedoView view(node(i, kCoarse), c);
    for (int k = 0; k < kCoarse; ++k) {
      const double n = index_of_refraction(k, kCoarse);
      mean[0][k] += k ? w * view.glass(n) : w;
      mean[1][k] += k ? w * view.glass(1 / n) : w;
    }
  });
  for (int k = 0; k < kCoarse; ++k)
    for (int side = 0; side < 2; ++side)
      glass_mean_[side][i][k] = static_cast<float>(mean[side][k]);
}

/// The entries of one roughness and one cosine.
void AlbedoTables::fill_glass(int i, int j) {
  const double cosine = node(j, kCoarse);
  if (i == 0) {
    for (int k = 0; k < kCoarse; ++k) {
      const double n = index_of_refraction(k, kCoarse);
      rise_[i][j][k] = k == 0 ? 0 : static_cast<float>(dielectric_rise(cosine, (n - 1) * (n + 1)));
      glass_[0][i][j][k] = glass_[1][i][j][k] = 1;
    }
    return;
  }
  const AlbedoView view(node(i, kCoarse), cosine);
  for (int k = 0; k < kCoarse; ++k) {
    const double n = index_of_refraction(k, kCoarse);
    rise_[i][j][k] = static_cast<float>(view.rise(n));
    const bool bends = k > 0;
    glass_[0][i][j][k] = bends ? static_cast<float>(view.glass(n)) : 1;
    glass_[1][i][j][k] = bends ? static_cast<float>(view.glass(1 / n)) : 1;
  }
}

const AlbedoTables& AlbedoTables::get() {
  static const AlbedoTables tables;
  return tables;
}

}  // namespace selenite
