// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <random>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "model/bsdf.h"

// Materials and views that several tests of the model share.
namespace selenite::cases {

/// A kind of material as a function of one roughness, so that every lobe is seen at every width.
struct Family {
  std::string name;
  bool backfacing = false;
  void (*set)(Principled<double>& m, double roughness);
  Flavour::Version version = Flavour::Version::kV2;

  Principled<double> material(double roughness) const {
    Principled<double> m;
    m.base_color = {0.9, 0.5, 0.2};
    m.roughness = roughness;
    set(m, roughness);
    return m;
  }
};

inline const std::vector<Family>& families() {
  using M = Principled<double>;
  static const std::vector<Family> all{
      {"diffuse", false, [](M& m, double r) { m.specular_level = 0, m.diffuse_roughness = r; }},
      {"plastic", false, [](M&, double) {}},
      {"metal", false,
       [](M& m, double) {
         m.metallic = 1, m.specular_tint = {0.9, 0.4, 0.7};
       }},
      {"glass", false, [](M& m, double) { m.transmission = 1; }},
      {"glass_inside", true, [](M& m, double) { m.transmission = 1; }},
      {"bubble", false, [](M& m, double) { m.transmission = 1, m.ior = 0.7; }},
      {"coat", false,
       [](M& m, double r) {
         m.coat_weight = 0.8, m.coat_roughness = r, m.coat_tint = {0.4, 0.9, 1}, m.roughness = 0.4;
       }},
      {"sheen", false,
       [](M& m, double r) {
         m.sheen_weight = 0.9, m.sheen_roughness = r, m.sheen_tint = {1, 0.4, 0.7};
         m.specular_level = 0, m.base_color = Color<double>(0.1);
       }},
      {"mixture", false,
       [](M& m, double) {
         m.metallic = 0.3, m.transmission = 0.5, m.coat_weight = 0.6, m.diffuse_roughness = 0.5;
         m.sheen_weight = 0.5, m.sheen_roughness = 0.3;
         m.coat_roughness = 0.2, m.alpha = 0.7;
       }},
      {"mixture_inside", true,
       [](M& m, double) {
         m.metallic = 0.2, m.transmission = 0.6, m.ior = 1.8, m.specular_level = 0.8;
       }},
      {"version1", false,
       [](M& m, double) {
         m.metallic = 0.2, m.transmission = 0.6, m.specular_tint = Color<double>(0.5);
         m.transmission_roughness = 0.3;
       },
       Flavour::Version::kV1},
      {"version1_inside", true, [](M& m, double) { m.transmission = 1; }, Flavour::Version::kV1},
  };
  return all;
}

/// In the frame of a flat surface; z is the normal on the viewer's side.
inline Vec3d direction(double cos_theta, double phi = 0.3) {
  const double s = std::sqrt((1 - cos_theta) * (1 + cos_theta));
  return {s * std::cos(phi), s * std::sin(phi), cos_theta};
}
inline SurfacePoint<double> flat(const Vec3d& wi, bool backfacing) {
  return {{0, 0, 1}, {0, 0, 1}, wi, backfacing};
}

/// Uniform on the unit sphere.
template <class Engine>
Vec3d random_direction(Engine& engine) {
  std::uniform_real_distribution<double> u;
  return direction(2 * u(engine) - 1, 2 * kPi<double> * u(engine));
}

/// Whether a parameter is one of a lobe of `TopLobes`.
inline bool is_of_top_lobe(std::string_view name) {
  const TopLobeParameters<double> none;
  bool found = false;
  TopLobeParameters<double>::fields(
      none, [&](const Parameter& p, const auto&) { found = found || p.name == name; });
  return found;
}

/// A material with every parameter drawn from [lower, upper] of a moderate range. Half of them leave
/// whole lobes out, so that each lobe is also seen alone.
template <class Engine>
Principled<double> random_material(Engine& engine) {
  std::uniform_real_distribution<double> u;
  Principled<double> m;
  Principled<double>::fields(m, [&](const Parameter& p, auto& member) {
    const double hi = std::min(p.upper, 2.5), lo = std::max(p.lower, hi > 1 ? 1.05 : 0.0);
    const auto draw = [&](auto& x) { x = lo + (0.1 + 0.8 * u(engine)) * (hi - lo); };
    if constexpr (requires { member.r; }) {
      draw(member.r), draw(member.g), draw(member.b);
    } else {
      draw(member);
    }
  });
  if (u(engine) < 0.5) {
    for (auto x : {&Principled<double>::metallic, &Principled<double>::transmission,
                   &Principled<double>::coat_weight, &Principled<double>::diffuse_roughness})
      if (u(engine) < 0.6) m.*x = 0;
    TopLobeParameters<double>::fields(m, [&](const Parameter& p, auto& member) {
      if (p.name.ends_with("_weight") && u(engine) < 0.6)
        member = std::remove_reference_t<decltype(member)>(0);
    });
    if (u(engine) < 0.3) m.base_color = Color<double>(0);
  }
  return m;
}

}  // namespace selenite::cases
