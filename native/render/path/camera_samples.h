// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <optional>

#include "math/rng.h"
#include "render/film/render_settings.h"
#include "render/prepared/prepared.h"

namespace selenite {

/// The samples of a row of pixels one after another, with their camera rays and what these meet.
/// Neighbours are traced together: a camera ray then takes a third of the time.
class CameraSamples {
 public:
  struct Sample {
    Random random;
    Ray ray;
    std::optional<Hit> hit;
  };

  /// Pixels x0 to x1 - 1 of row y.
  template <int L>
  CameraSamples(const Prepared<L>& prepared, const PixelCamera& camera,
                const RenderSettings& settings, int y, int x0, int x1)
      : geometry_(prepared.geometry),
        any_medium_(prepared.any_medium),
        camera_(camera),
        settings_(settings),
        y_(y),
        x_(x0),
        end_(x1) {}

  /// For each pixel that is rendered as many as there are samples a pixel.
  Sample& next() {
    if (at_ == count_) trace_more();
    return *samples_[at_++];
  }

 private:
  void trace_more() {
    std::array<Ray, Geometry::kTogether> rays;
    std::array<std::optional<Hit>, Geometry::kTogether> hits;
    at_ = count_ = 0;
    while (count_ < Geometry::kTogether && x_ < end_) {
      const auto pixel = static_cast<std::size_t>(y_) * settings_.width + x_;
      if (!settings_.has(pixel)) {
        ++x_;
        continue;
      }
      const Random random(settings_.seed, static_cast<std::uint32_t>(pixel),
                          static_cast<std::uint32_t>(sample_));
      Ray& ray = rays[count_];
      Vec2<float> at{static_cast<float>(x_) + random.uniform(0),
                     static_cast<float>(y_) + random.uniform(1)};
      if (camera_.cuts_photo())
        at = camera_.in_photo(at.x, at.y, random.uniform(2), random.uniform(3));
      ray = camera_.ray(at.x, at.y);
      // Before the near clip plane there is no medium either, as in Cycles.
      if (any_medium_)
        ray = {ray.origin + ray.direction * ray.t_min, ray.direction, 0, ray.t_max - ray.t_min};
      samples_[count_++] = Sample{random, ray, {}};
      if (++sample_ == settings_.spp) sample_ = 0, ++x_;
    }
    geometry_.intersect_camera_rays({rays.data(), static_cast<std::size_t>(count_)}, hits.data());
    for (int i = 0; i < count_; ++i) samples_[i]->hit = hits[i];
  }

  const Geometry& geometry_;
  bool any_medium_;
  const PixelCamera& camera_;
  const RenderSettings& settings_;
  int y_, x_, end_;
  int sample_ = 0;  // of pixel x_: the next to be traced
  std::array<std::optional<Sample>, Geometry::kTogether> samples_;
  int at_ = 0, count_ = 0;
};

}  // namespace selenite
