// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "math/color.h"
#include "math/vec.h"
#include "model/parameter.h"
#include "model/ray_kind.h"
#include "scene/lights/sun_disc.h"

namespace selenite {

struct WorldParameters {
  Color<double> color{0, 0, 0};
  double strength = 1;
  double rotation = 0;  ///< radians about the image's own Z; see World::to_map_frame

  template <class Self, class Visit>
  static constexpr void fields(Self& p, Visit&& visit) {
    visit(Parameter{.name = "strength",
                    .sockets = "Strength",
                    .unit = "1",
                    .lower = 0,
                    .upper = 1e9,
                    .fit_lower = 0.001,
                    .fit_upper = 1000,
                    .initial = 1,
                    .scale = Scale::kLog,
                    .effect = Effect::kEmission,
                    .help = "Strength of the background; multiplies its colour or image"},
          p.strength);
    visit(
        Parameter{
            .name = "color",
            .sockets = "Color",
            .unit = "1",
            .lower = 0,
            .upper = 1e6,
            .fit_lower = 0.001,
            .fit_upper = 1,
            .initial = 0.05,
            .effect = Effect::kEmission,
            .help = "Colour of the background, linear Rec. 709; tints the image if there is one"},
        p.color);
    visit(Parameter{.name = "rotation",
                    .sockets = "Rotation",
                    .unit = "rad",
                    .lower = -2 * kPi<double>,
                    .upper = 2 * kPi<double>,
                    .fit_lower = -2 * kPi<double>,
                    .fit_upper = 2 * kPi<double>,
                    .initial = 0,
                    .scale = Scale::kAngle,
                    .effect = Effect::kEmission,
                    .help = "Rotation of the background's image about Z, as of a Mapping node"},
          p.rotation);
  }
};

/// Equirectangular picture with its table for importance sampling. Immutable, shared.
/// u = 1/2 - atan2(y, x)/(2 pi), v = 1/2 + asin(z)/pi from the bottom; bilinear, u repeats.
/// A negative pixel (resampled pictures have them, those that Blender brings along too) is negative
/// light, as Cycles shows it, and is not sampled. InvalidArgument: a pixel that is not finite.
/// Source: docs/method/rendering.md, "World".
class EnvironmentMap {
 public:
  /// Of the samples of an image that is unknown: the share that goes to all directions evenly. What
  /// is dark now may turn out to be bright.
  static constexpr float kUnknownEven = 0.5f;

  /// Share of the samples that Cycles gives to the sun disc of a sky.
  static constexpr float kCyclesSunShare = 0.8f;

  /// pixels: row 0 at the top. even: share of the samples that goes to all directions evenly. sun:
  /// adds its light to that of the pixels.
  EnvironmentMap(int width, int height, std::vector<Colorf> pixels, float even = 0,
                 std::optional<SunDisc> sun = {});

  int width() const { return width_; }
  int height() const { return height_; }
  const std::vector<Colorf>& pixels() const { return pixels_; }

  Colorf radiance(const Vec3f& map_direction) const;
  float density(const Vec3f& map_direction) const;  ///< of `sample`, per solid angle
  /// By which Cycles samples the map: by the mean of the channels at the middle of each pixel.
  float cycles_density(const Vec3f& map_direction) const;
  Vec3f sample(float u1, float u2, float& density) const;
  /// Derivative of `radiance` by the azimuth of the direction, per radian.
  Colorf azimuth_slope(const Vec3f& map_direction) const;
  float mean_luminance() const { return mean_; }  ///< over the sphere
  /// The derivative by the radiance of a direction, as those by the pixels that it is interpolated
  /// from: calls `sink(pixel, part)`.
  template <class Sink>
  void spread(const Vec3f& map_direction, const Colorf& derivative, Sink&& sink) const {
    for (const auto& [pixel, share] : corners(map_direction).at) sink(pixel, derivative * share);
  }

 private:
  struct Corner {
    std::uint32_t pixel;
    float share;
  };
  /// Between which the image is interpolated.
  struct Corners {
    std::array<Corner, 4> at;  ///< left and right above, left and right below
    float down;                ///< share of the lower two
  };
  Corners corners(const Vec3f& map_direction) const;
  float image_density(const Vec3f& map_direction) const;  // of the samples of the image alone
  Vec3f sample_image(float u1, float u2) const;
  /// The pixel of a direction, and the density per solid angle if it had all of the samples.
  struct Place {
    int x, y;
    float per_share;  ///< 0 at the poles
  };
  Place place(const Vec3f& map_direction) const;

  int width_, height_;
  std::vector<Colorf> pixels_;
  std::vector<float> row_cdf_, column_cdf_;
  float mean_ = 0;
  std::optional<SunDisc> sun_;
  float sun_share_ = 0;    // of the samples
  double cycles_sum_ = 0;  // over the pixels, times the sine of their row
};

/// What the background is to some of the rays, where it is not to them what it is to light samples.
struct Backdrop {
  RayKinds seen_by = kCameraRay;  ///< by rays of exactly these kinds, as `PathFacts` has them
  std::shared_ptr<const EnvironmentMap> map;
  std::array<Vec3f, 3> to_map{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  ///< as of a World
  bool scaled = false;  ///< colour and strength of the world multiply it too

  /// Radiance, but for these.
  Colorf factor(const Vec3f& d) const {
    return map->radiance({dot(to_map[0], d), dot(to_map[1], d), dot(to_map[2], d)});
  }
};

/// Background: constant, or an image times the colour.
struct World {
  WorldParameters values;
  bool on = true;  ///< else it is black: see LightState
  std::shared_ptr<const EnvironmentMap> map;
  /// At rotation 0. Rows; orthonormal.
  std::array<Vec3f, 3> to_map{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  RayKinds visible_to = kAllRays;
  int max_bounces = std::numeric_limits<int>::max();  ///< light sampling after more passes it over
  /// The camera sees nothing where it sees no object; see `film_roughness`.
  bool transparent_film = false;
  /// With a transparent film the world is not seen either through glass that is at most that rough.
  /// Negative: it is.
  double film_roughness = -1;
  std::vector<Backdrop> backdrops;  ///< none of them moves with `rotation`

  void check() const;
  /// What rays of these kinds see; null: what `factor` says.
  const Backdrop* backdrop(RayKinds kinds) const {
    for (const Backdrop& one : backdrops)
      if (one.seen_by == kinds) return &one;
    return nullptr;
  }
  /// A direction as the image has it: by `to_map`, then rotated about Z.
  Vec3f to_map_frame(const Vec3f& d) const {
    return rotated({dot(to_map[0], d), dot(to_map[1], d), dot(to_map[2], d)}, values.rotation);
  }
  /// Radiance at colour 1 and strength 1; 0 where it is off.
  Colorf factor(const Vec3f& direction) const;
  /// Its derivative by the rotation, the direction held.
  Colorf rotation_slope(const Vec3f& direction) const;
  float density(
      const Vec3f& direction) const;  ///< 0 where there is no image: not sampled as a light
  float cycles_density(const Vec3f& direction) const;  ///< likewise
  Vec3f sample(float u1, float u2, float& density) const;
  /// The same with the rotation in `to_map`, where it costs no lookup anything.
  World at_rotation_0() const;

 private:
  static Vec3f rotated(const Vec3f& d, double angle) {
    if (angle == 0) return d;
    const auto c = static_cast<float>(std::cos(angle)), s = static_cast<float>(std::sin(angle));
    return {c * d.x - s * d.y, s * d.x + c * d.y, d.z};
  }
};

}  // namespace selenite
