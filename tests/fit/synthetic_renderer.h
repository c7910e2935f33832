// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "fit/run/fit.h"
#include "math/dual.h"
#include "math/error.h"
#include "math/rng.h"

// A picture whose truth is known: three smooth lobes per material, with noise of a renderer's kind.
namespace selenite {

inline constexpr int kSyntheticSlots = 4;  // base_color, roughness, transmission, ior
using SyntheticDual = Dual<double, kSyntheticSlots>;

inline int synthetic_slot(std::string_view parameter) {
  if (parameter == "base_color") return 0;
  if (parameter == "roughness") return 1;
  if (parameter == "transmission") return 2;
  if (parameter == "ior") return 3;
  return -1;
}

/// Pixels of a column strip show one material. A sample is sum_l lobe_l xi_l with independent xi_l
/// of mean 1, and its derivative sum_l lobe_l' xi_l times more noise: image and Jacobian correlate.
struct SyntheticRenderer {
  double noise = 0.5;           ///< standard deviation of xi
  double jacobian_noise = 0.0;  ///< of the factor on a derivative

  static std::array<SyntheticDual, 3> lobes(const Principled<double>& m, int channel, double u,
                                            double v) {
    const auto base = SyntheticDual::variable(m.base_color[channel], 0);
    const auto roughness = SyntheticDual::variable(m.roughness, 1);
    const auto transmission = SyntheticDual::variable(m.transmission, 2);
    const auto ior = SyntheticDual::variable(m.ior, 3);
    const SyntheticDual width = 0.05 + 0.4 * roughness * roughness;
    const SyntheticDual ratio = (ior + -1.0) / (ior + 1.0);
    const double distance2 = square(u - 0.5) + square(v - 0.4);
    return {base * (1.0 + -transmission) * (0.3 + 0.7 * u),
            base * transmission * (0.2 + 0.8 * v) * (1.0 + 0.5 * (ior + -1.0) * (u * v)),
            10.0 * ratio * ratio * exp(-(distance2 / (2.0 * width * width))) / (width + 0.3)};
  }

  double draw(const Random& random, std::uint32_t dimension, double deviation) const {
    return 1 + deviation * (-std::log(1 - random.uniform(dimension)) - 1);
  }

  Film operator()(const Scene& scene, const Camera& camera, const SlotLayout& layout,
                  const RenderSettings& settings, Progress* progress) const {
    if (layout.slots.size() > static_cast<std::size_t>(kMaxSlots))
      throw InvalidArgument("synthetic renderer: too many slots");
    if (progress && progress->cancelled) throw Cancelled("cancelled");
    Film film;
    film.width = settings.width;
    film.height = settings.height;
    film.spp = settings.spp;
    const std::size_t size = static_cast<std::size_t>(settings.width) * settings.height;
    film.mean.resize(size);
    film.half_a.resize(size);
    film.variance.resize(size);
    film.slots.resize(layout.slots.size());
    for (SlotFilm& s : film.slots) {
      s.mean.resize(size);
      s.half_a.resize(size);
      s.variance.resize(size);
      s.covariance.resize(size);
    }
    const bool turned = camera.name == "Right";
    for (std::size_t i = 0; i < size; ++i) {
      const int x = static_cast<int>(i) % settings.width, y = static_cast<int>(i) / settings.width;
      double u = (x + 0.5) / settings.width, v = (y + 0.5) / settings.height;
      const std::size_t count = scene.appearance.materials.size();
      const int owner = static_cast<int>(u * static_cast<double>(count));
      if (turned) {
        u = 1 - u;
        std::swap(u, v);
      }
      for (int c = 0; c < 3; ++c) pixel(scene, layout, settings, i, owner, c, u, v, film);
    }
    return film;
  }

 private:
  struct Sums {
    double all = 0, even = 0, square = 0, cross = 0;
    void add(double value, double image, int sample) {
      all += value;
      if (sample % 2 == 0) even += value;
      square += value * value;
      cross += value * image;
    }
  };

  void pixel(const Scene& scene, const SlotLayout& layout, const RenderSettings& settings,
             std::size_t i, int owner, int c, double u, double v, Film& film) const {
    const auto lobe =
        lobes(scene.appearance.materials[static_cast<std::size_t>(owner)].values, c, u, v);
    const int n = settings.spp;
    Sums image;
    std::vector<Sums> slots(layout.slots.size());
    for (int sample = 0; sample < n; ++sample) {
      Random random(settings.seed, static_cast<std::uint32_t>(i),
                    static_cast<std::uint32_t>(sample));
      double value = 0;
      std::array<double, kSyntheticSlots> slope{};
      for (std::uint32_t l = 0; l < 3; ++l) {
        const double xi = draw(random, l, noise);
        value += lobe[l].v * xi;
        for (std::uint32_t k = 0; k < kSyntheticSlots; ++k)
          slope[k] += lobe[l].d[k] * xi * draw(random, 10 + 10 * l + k, jacobian_noise);
      }
      image.add(value, value, sample);
      for (std::size_t s = 0; s < slots.size(); ++s) {
        const ParameterRef& ref = layout.slots[s].parameter;
        const int k = ref.kind == OwnerKind::kMaterial && ref.owner == owner
                          ? synthetic_slot(scene.description(ref).name)
                          : -1;
        slots[s].add(k < 0 ? 0 : slope[static_cast<std::size_t>(k)], value, sample);
      }
    }
    const double half = (n + 1) / 2, pairs = n > 1 ? 1.0 / (n * (n - 1.0)) : 0;
    film.mean[i][c] = static_cast<float>(image.all / n);
    film.half_a[i][c] = static_cast<float>(image.even / half);
    film.variance[i][c] =
        static_cast<float>(std::max((image.square - image.all * image.all / n) * pairs, 0.0));
    for (std::size_t s = 0; s < slots.size(); ++s) {
      const Sums& sum = slots[s];
      film.slots[s].mean[i][c] = static_cast<float>(sum.all / n);
      film.slots[s].half_a[i][c] = static_cast<float>(sum.even / half);
      film.slots[s].variance[i][c] =
          static_cast<float>(std::max((sum.square - sum.all * sum.all / n) * pairs, 0.0));
      film.slots[s].covariance[i][c] =
          static_cast<float>((sum.cross - sum.all * image.all / n) * pairs);
    }
  }
};

/// A film whose picture and slopes, one a slot, are `at(i)` in pixel i; a number is all slots' slope.
/// Samples of the picture are evenly spread, with a standard deviation of `noise`; slopes have none.
template <class At>
Film evenly_noisy_film(const SlotLayout& layout, const RenderSettings& settings, double noise,
                       At&& at) {
  Film film(settings.width, settings.height, settings.spp, static_cast<int>(layout.slots.size()));
  const int even = (settings.spp + 1) / 2;
  for (std::size_t i = 0; i < film.size(); ++i) {
    const auto [value, slopes] = at(i);
    for (int c = 0; c < 3; ++c) {
      Random random(settings.seed, static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(c));
      double all = 0, half = 0;
      for (int s = 0; s < settings.spp; ++s) {
        const double sample = noise * std::sqrt(12.0) * (random.uniform(s) - 0.5);
        all += sample;
        if (s % 2 == 0) half += sample;
      }
      film.mean[i][c] = static_cast<float>(value + all / settings.spp);
      film.half_a[i][c] = static_cast<float>(value + half / even);
      film.variance[i][c] = static_cast<float>(noise * noise / settings.spp);
      for (std::size_t s = 0; s < film.slots.size(); ++s) {
        SlotFilm& slot = film.slots[s];
        if constexpr (std::is_arithmetic_v<decltype(slopes)>)
          slot.mean[i][c] = slot.half_a[i][c] = static_cast<float>(slopes);
        else
          slot.mean[i][c] = slot.half_a[i][c] = static_cast<float>(slopes[s]);
      }
    }
  }
  return film;
}

inline Scene synthetic_scene(int materials = 1) {
  Scene scene;
  for (const char* name : {"Left", "Right"}) {
    Camera camera;
    camera.name = name;
    scene.cameras.push_back(camera);
  }
  for (int i = 0; i < materials; ++i) {
    Material material;
    material.name = i == 0 ? "Body" : "Body" + std::to_string(i);
    material.values.base_color = {0.4, 0.6, 0.8};
    material.values.roughness = 0.4;
    material.values.transmission = 0.6;
    material.values.ior = 1.5;
    scene.appearance.materials.push_back(material);
  }
  return scene;
}

inline constexpr int kSyntheticSize = 16;

/// Photo of `scene` without noise, or with that of `spp` samples.
inline Photo synthetic_capture(const Scene& scene, const std::string& camera,
                               int size = kSyntheticSize, int spp = 0, std::uint64_t seed = 0) {
  RenderSettings settings;
  settings.width = settings.height = size;
  settings.spp = std::max(spp, 1);
  settings.seed = seed;
  Photo photo;
  photo.camera = camera;
  photo.width = photo.height = size;
  photo.reference = SyntheticRenderer{spp > 0 ? 0.5 : 0.0, 0}(scene, scene.camera(camera),
                                                              SlotLayout(), settings, nullptr)
                        .mean;
  return photo;
}

/// A photo that is 0.5 all over.
inline Photo grey_capture(int size = kSyntheticSize) {
  Photo photo;
  photo.camera = "Left";
  photo.width = photo.height = size;
  photo.reference.assign(static_cast<std::size_t>(size) * size, Colorf(0.5f));
  return photo;
}

inline std::vector<UnknownParameter> synthetic_unknowns() {
  return {{"Body", "base_color", {0.2, 0.2, 0.2}, 0.001, 0.999, 0.03},
          {"Body", "roughness", {0.6}, 0.02, 0.999, 0.03},
          {"Body", "transmission", {0.3}, 0.001, 0.999, 0.03},
          {"Body", "ior", {1.7}, 1.0, 2.5, 0.03}};
}

inline Vector synthetic_truth() { return Vector{{0.4, 0.6, 0.8, 0.4, 0.6, 1.5}}; }

/// One number to fit.
inline std::vector<UnknownParameter> roughness_from(double start) {
  return {{"Body", "roughness", {start}, 0.02, 0.999, 0.03}};
}

/// Gauss-Newton with pictures of `renderer`, whose derivatives are exact.
inline FitSettings exact_settings(Renderer renderer, int iterations) {
  FitSettings settings;
  settings.optimiser = "gauss-newton";
  settings.iterations = iterations;
  settings.tolerance = 0;
  settings.threads = 1;
  settings.finite_differences = false;
  settings.renderer = std::move(renderer);
  return settings;
}

inline FitSettings synthetic_settings(SyntheticRenderer renderer = {}) {
  FitSettings settings;
  settings.optimiser = "adam";
  settings.threads = 1;
  settings.tolerance = 0;
  settings.search = settings.refinement = "off";
  settings.finite_differences = false;
  settings.renderer = renderer;
  return settings;
}

}  // namespace selenite
