// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <limits>
#include <optional>
#include <string>

#include "math/box.h"
#include "math/color.h"
#include "model/parameter.h"
#include "model/ray_kind.h"
#include "scene/light_link.h"
#include "scene/transform.h"

namespace selenite {

/// The parameters of a light that can be fitted. Radiance is color * power * (a factor that only the
/// light's shape decides), so both derivatives are products.
struct LightParameters {
  Color<double> color{1, 1, 1};
  double power = 10;

  template <class Self, class Visit>
  static constexpr void fields(Self& p, Visit&& visit) {
    visit(Parameter{.name = "power",
                    .sockets = "",
                    .unit = "W",
                    .lower = 0,
                    .upper = 1e9,
                    .fit_lower = 0.001,
                    .fit_upper = 10000,
                    .initial = 10,
                    .scale = Scale::kLog,
                    .effect = Effect::kEmission,
                    .help = "Power of the lamp in watts; for a sun its irradiance in W/m2"},
          p.power);
    visit(Parameter{.name = "color",
                    .sockets = "",
                    .unit = "1",
                    .lower = 0,
                    .upper = 1e6,
                    .fit_lower = 0,
                    .fit_upper = 1,
                    .initial = 1,
                    .effect = Effect::kEmission,
                    .help = "Colour of the light, linear Rec. 709; multiplies the power"},
          p.color);
  }
};

enum class LightKind { kPoint, kSun, kSpot, kArea };
/// Which Blender's conventions the numbers follow (docs/method/rendering.md, "Lamps").
enum class LightUnits { kBlender3, kBlender4 };

/// Towards a light, from a point that is lit.
struct LightSample {
  Vec3f direction;
  float distance;  ///< infinite for a sun
  float density;   ///< per solid angle; 1 for a delta light
  float factor;    ///< radiance (delta light: irradiance) per power and colour
  bool delta;
};
struct LightHit {
  float density, factor;  ///< as in LightSample
  float distance;
};

/// A lamp. Lamps never hide anything: rays see their radiance and go on.
struct Light {
  std::string name;
  std::string object{};  ///< that places it; empty: called as the lamp
  bool on = true;        ///< else it is as if it were not there: see LightState
  LightKind kind = LightKind::kPoint;
  LightUnits units = LightUnits::kBlender4;
  LightParameters values;
  double radiance_scale = 1;  ///< 2^exposure and whatever else multiplies the power
  Transform to_world;
  double radius = 0;         ///< point, spot
  bool soft_falloff = true;  ///< point, spot: disc that faces the lit point instead of a sphere
  double angle = 0;          ///< sun: angular diameter, radians
  double spot_size = 0.785, spot_blend = 0.15;
  bool ellipse = false;  ///< area
  double size_x = 1, size_y = 1;
  double spread = kPi<double>;
  RayKinds visible_to = kScatteredRays;  ///< shadow rays tell nothing of a lamp
  bool casts_shadows = true;
  bool met_by_rays = true;  ///< else only light sampling finds it, and mirrors do not show it
  int max_bounces = std::numeric_limits<int>::max();  ///< light sampling after more passes it over
  /// Whether paths inside bodies with a medium aim at it through the surface; it changes noise and
  /// time of a picture alone. Empty: not decided, see render/driver/aim_pilot.h.
  std::optional<bool> aimed{};
  LinkedSets links;

  // Worked out by `prepare`.
  Vec3f position, axis;  ///< axis: the direction of emission, local -Z
  Vec3f u, v;            ///< area: half edges; spot: local x, y
  float area = 0, scale = 0, cos_outer = 0, one_minus_cos_sun = 0, tan_spread = 0, spread_norm = 1;

  /// Checks every value (InvalidArgument) and derives the rest; `origin` is the geometry's.
  void prepare(const Vec3d& origin);
  bool is_delta() const;
  const std::string& place() const { return object.empty() ? name : object; }
  bool has_place() const { return kind != LightKind::kSun; }
  /// A box around the lamp; not for a sun.
  Box bounds() const;
  /// Rough flux for choosing between lights: W, for a scene of the given radius.
  float flux(float scene_radius) const;
  std::optional<LightSample> sample(const Vec3f& point, float u1, float u2) const;
  /// The light met by a ray between t_min and t_max, with the density that `sample(origin)` has for
  /// its direction.
  std::optional<LightHit> intersect(const Vec3f& origin, const Vec3f& direction, float t_min,
                                    float t_max) const;
};

}  // namespace selenite
