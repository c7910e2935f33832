// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/prepared/light_sampler.h"

#include <algorithm>

namespace selenite {
namespace {

/// What a black light counts for whose derivative is not black: its flux, and the emission of a surface.
constexpr double kLeastFlux = 1e-6, kLeastEmission = 1e-3;

double luminance(const Color<double>& c) { return 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b; }

double sampled_flux(double flux, LightUse use) {
  switch (use) {
    case LightUse::kNone:
      return 0;
    case LightUse::kSampled:
      return std::max(flux, 0.0);
    case LightUse::kDifferentiated:
      return std::max(flux, kLeastFlux);
  }
  return 0;
}

/// Probabilities of lights of some flux: half by power, half evenly.
std::vector<float> shares(const std::vector<double>& flux) {
  double total = 0;
  int active = 0;
  for (const double f : flux) {
    total += f;
    active += f > 0;
  }
  std::vector<float> found;
  for (const double f : flux)
    found.push_back(f > 0 ? static_cast<float>(0.5 * f / total + 0.5 / active) : 0);
  return found;
}

}  // namespace

LightSampler::LightSampler(const Scene& scene, const LightSet& set)
    : world_(scene.appearance.world), emitters_(scene.appearance.materials.size()) {
  const Flux emitted = add_triangles(scene, set);
  const auto& lamps = scene.appearance.lights;
  const float radius = scene.geometry->radius().near;
  std::vector<double> flux;
  for (std::size_t i = 0; i < lamps.size(); ++i)
    flux.push_back(sampled_flux(lamps[i].flux(radius), set.lamps[i]));
  flux.push_back(emitted.all * 2 * kPi<double>);  // both sides emit
  double sky = 0;
  if (world_.map)
    sky = sampled_flux(luminance(world_.values.color) * world_.values.strength *
                           world_.map->mean_luminance() * square(kPi<double>) * square(radius),
                       set.world);
  flux.push_back(sky);

  probability_ = shares(flux);
  double sum = 0;
  for (const float p : probability_) cdf_.push_back(static_cast<float>(sum += p));
  flux[mesh_source()] = emitted.strong * 2 * kPi<double>;
  cycles_probability_ = shares(flux);
}

LightSampler::Flux LightSampler::add_triangles(const Scene& scene, const LightSet& set) {
  const std::vector<LightUse>& materials = set.materials;
  std::vector<double> weight(materials.size(), 0);
  bool any = false;
  for (std::size_t m = 0; m < materials.size(); ++m) {
    if (materials[m] == LightUse::kNone) continue;
    const auto& values = scene.appearance.materials[m].values;
    weight[m] =
        std::max(luminance(values.emission_color) * values.emission_strength, kLeastEmission);
    emitters_[m].strong = max_channel(values.emission_color) * values.emission_strength > 0.5;
    if (const auto shaded = set.shaded.find(static_cast<int>(m)); shaded != set.shaded.end()) {
      weight[m] = std::max(luminance(shaded->second), kLeastEmission);
      emitters_[m].strong = max_channel(shaded->second) > 0.5;
    }
    any = true;
  }
  Flux flux;
  if (!any) return flux;
  std::vector<double> cumulative;
  const Geometry& geometry = *scene.geometry;
  const auto& instances = geometry.instances();
  for (std::size_t i = 0; i < instances.size(); ++i) {
    const Mesh& mesh = geometry.meshes()[instances[i].mesh];
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const int m = instances[i].materials[mesh.material_slots[t]];
      if (weight[m] == 0) continue;
      const auto [a, b, c] = geometry.corners(static_cast<int>(i), static_cast<int>(t));
      const double of_triangle = weight[m] * length(cross(b - a, c - a)) / 2;
      flux.all += of_triangle;
      if (emitters_[m].strong) flux.strong += of_triangle;
      triangles_.push_back({static_cast<int>(i), static_cast<int>(t), m});
      cumulative.push_back(flux.all);
    }
  }
  for (std::size_t m = 0; m < materials.size(); ++m)
    if (weight[m] > 0 && flux.all > 0)
      emitters_[m].density = static_cast<float>(weight[m] / flux.all);
  for (const double x : cumulative) triangle_cdf_.push_back(static_cast<float>(x / flux.all));
  return flux;
}

LightSampler::Choice LightSampler::choose(float u) const {
  const auto it = std::upper_bound(cdf_.begin(), cdf_.end(), u);
  if (it == cdf_.end()) return {};
  const auto i = static_cast<int>(it - cdf_.begin());
  const Source source = i < mesh_source()    ? Source::kLamp
                        : i == mesh_source() ? Source::kMesh
                                             : Source::kWorld;
  return {source, i, probability_[i]};
}

const LightSampler::EmissiveTriangle& LightSampler::choose_triangle(float u) const {
  const auto it = std::upper_bound(triangle_cdf_.begin(), triangle_cdf_.end(), u);
  return triangles_[std::min<std::size_t>(it - triangle_cdf_.begin(), triangles_.size() - 1)];
}

}  // namespace selenite
