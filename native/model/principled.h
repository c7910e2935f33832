// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>

#include "math/color.h"
#include "model/parameter.h"
#include "model/top_lobes.h"

namespace selenite {

/// What a material has beside the numbers on its sockets.
struct Flavour {
  enum class Distribution { kGgx, kMultiGgx, kBeckmann, kAshikhminShirley };
  enum class Version { kV1, kV2 };
  enum class Subsurface { kRandomWalk, kRandomWalkSkin };

  /// Blender's "GGX" is single scattering; "Multiscatter GGX" scales it by its missing energy. Only
  /// closures of a mixture may have the others.
  Distribution distribution = Distribution::kMultiGgx;
  /// Which Principled node: that of Blender 3.x or that of 4.x and 5.x. Of version 1 only the
  /// distribution GGX is closed form and modelled (Multiscatter GGX is rendered as GGX), without
  /// clearcoat and sheen; its tint is a number: set the three channels equal.
  Version version = Version::kV2;
  Subsurface subsurface = Subsurface::kRandomWalk;
  /// Cycles evaluates refraction towards a light for every pair of directions, also for those whose
  /// half vector no visible micronormal can have; its sampling never produces them. True renders what
  /// Cycles renders: `value` and `density` then include those pairs, so the density integrates to
  /// more than one on rough glass. False keeps what sampling can reach, and the density normalised.
  bool evaluate_unphysical_refraction = true;
  /// As the Cycles of Blender 5: films have other colours and lie on metal as well, conductors have
  /// Fresnel's equations, and light that was scattered diffusely goes under surfaces, too.
  bool blender5 = false;
  /// Glass that is seen from outside is drawn as if it reflected nearly all light: for pictures of what
  /// surfaces reflect at once. Its value stays.
  bool draws_reflections = false;
};

/// Values of Blender's Principled BSDF node, without anisotropy and thin film.
/// Members start at the defaults of the node in Blender 4.5.
template <class T>
struct Principled : TopLobeParameters<T> {
  Color<T> base_color{T(0.8)};
  T roughness{0.5};
  T metallic{0};
  T ior{1.5};
  T alpha{1};
  T transmission{0};
  T specular_level{0.5};
  Color<T> specular_tint{T(1)};
  T diffuse_roughness{0};
  T coat_weight{0};
  T coat_roughness{T(0.03)};
  T coat_ior{1.5};
  Color<T> coat_tint{T(1)};
  T transmission_roughness{0};
  Color<T> emission_color{T(1)};
  T emission_strength{0};
  T subsurface_weight{0};
  Color<T> subsurface_radius{T(1)};  // the node starts at 1, 0.2, 0.1: skin
  T subsurface_scale{0.05};
  T subsurface_ior{1.4};
  T subsurface_anisotropy{0};

  /// The one description of each parameter: `visit(Parameter, T&)` or `visit(Parameter, Color<T>&)`.
  template <class Self, class Visit>
  static constexpr void fields(Self& m, Visit&& visit) {
    using enum Scale;
    visit(Parameter{.name = "base_color",
                    .sockets = "Base Color",
                    .unit = "1",
                    .lower = 0,
                    .upper = 1,
                    .fit_lower = 0,
                    .fit_upper = 1,
                    .initial = 0.8,
                    .help = "Colour of diffuse reflection, of metal and of light passing through"},
          m.base_color);
    visit(Parameter{.name = "roughness",
                    .sockets = "Roughness",
                    .unit = "1",
                    .lower = 0,
                    .upper = 1,
                    .fit_lower = 0.02,
                    .fit_upper = 1,
                    .initial = 0.5,
                    .scale = kRoughness,
                    .twin = "coat_roughness",
                    .help = "Square root of the GGX width; at or below 0.0037 a perfect mirror, "
                            "which has no derivative"},
          m.roughness);
    visit(Parameter{.name = "metallic",
                    .sockets = "Metallic",
                    .unit = "1",
                    .lower = 0,
                    .upper = 1,
                    .fit_lower = 0,
                    .fit_upper = 1,
                    .initial = 0,
                    .optional = true,
                    .help = "Share of metal"},
          m.metallic);
    visit(Parameter{.name = "ior",
                    .sockets = "IOR",
                    .unit = "1",
                    .lower = 1e-5,
                    .upper = 10,
                    .fit_lower = 1,
                    .fit_upper = 2.5,
                    .initial = 1.5,
                    .scale = kLogExcess,
                    .help = "Index of refraction of the inside over the outside"},
          m.ior);
    visit(Parameter{.name = "alpha",
                    .sockets = "Alpha",
                    .unit = "1",
                    .lower = 0,
                    .upper = 1,
                    .fit_lower = 0,
                    .fit_upper = 1,
                    .initial = 1,
                    .help = "Opacity: the rest passes straight through"},
          m.alpha);
    visit(Parameter{.name = "transmission",
                    .sockets = "Transmission Weight|Transmission",
                    .unit = "1",
                    .lower = 0,
                    .upper = 1,
                    .fit_lower = 0,
                    .fit_upper = 1,
                    .initial = 0,
                    .squared = true,
                    .optional = true,
                    .help = "Share of glass in what is not metal"},
          m.transmission);
    visit(Parameter{.name = "specular_level",
                    .sockets = "Specular IOR Level|Specular",
                    .unit = "1",
                    .lower = 0,
                    .upper = 1,
                    .fit_lower = 0,
                    .fit_upper = 1,
                    .initial = 0.5,
                    .help = "Scales the reflection of the opaque part; 0.5 leaves that of the IOR"},
          m.specular_level);
    visit(Parameter{.name = "specular_tint",
                    .sockets = "Specular Tint",
                    .unit = "1",
                    .lower = 0,
                    .upper = 1,
                    .fit_lower = 0,
                    .fit_upper = 1,
                    .initial = 1,
                    .diagonal = false,
                    .help = "Colour of dielectric reflection at normal incidence and of metal near "
                            "its edge"},
          m.specular_tint);
    visit(Parameter{.name = "diffuse_roughness",
                    .sockets = "Diffuse Roughness",
                    .unit = "1",
                    .lower = 0,
                    .upper = 1,
                    .fit_lower = 0,
                    .fit_upper = 1,
                    .initial = 0,
                    .versions = Versions::k2,
                    .help = "Roughness of the diffuse part; 0 is Lambertian"},
          m.diffuse_roughness);
    visit(Parameter{.name = "coat_weight",
                    .sockets = "Coat Weight",
                    .unit = "1",
                    .lower = 0,
                    .upper = 1,
                    .fit_lower = 0,
                    .fit_upper = 1,
                    .initial = 0,
                    .versions = Versions::k2,
                    .optional = true,
                    .help = "Share of the surface under a clear coat"},
          m.coat_weight);
    visit(Parameter{.name = "coat_roughness",
                    .sockets = "Coat Roughness",
                    .unit = "1",
                    .lower = 0,
                    .upper = 1,
                    .fit_lower = 0.02,
                    .fit_upper = 1,
                    .initial = 0.03,
                    .scale = kRoughness,
                    .versions = Versions::k2,
                    .help = "Square root of the GGX width of the coat"},
          m.coat_roughness);
    visit(Parameter{.name = "coat_ior",
                    .sockets = "Coat IOR",
                    .unit = "1",
                    .lower = 1,
                    .upper = 4,
                    .fit_lower = 1,
                    .fit_upper = 2.5,
                    .initial = 1.5,
                    .scale = kLogExcess,
                    .versions = Versions::k2,
                    .help = "Index of refraction of the coat"},
          m.coat_ior);
    visit(Parameter{.name = "coat_tint",
                    .sockets = "Coat Tint",
                    .unit = "1",
                    .lower = 0,
                    .upper = 1,
                    .fit_lower = 0,
                    .fit_upper = 1,
                    .initial = 1,
                    .versions = Versions::k2,
                    .help = "Transmittance of the coat at normal incidence"},
          m.coat_tint);
    TopLobeParameters<T>::fields(m, visit);
    visit(Parameter{.name = "transmission_roughness",
                    .sockets = "Transmission Roughness",
                    .unit = "1",
                    .lower = 0,
                    .upper = 1,
                    .fit_lower = 0,
                    .fit_upper = 1,
                    .initial = 0,
                    .versions = Versions::k1,
                    .help = "Further roughness of the refraction only; Blender 3"},
          m.transmission_roughness);
    visit(Parameter{.name = "emission_color",
                    .sockets = "Emission Color|Emission",
                    .unit = "1",
                    .lower = 0,
                    .upper = 1e6,
                    .fit_lower = 0,
                    .fit_upper = 1,
                    .initial = 1,
                    .effect = Effect::kEmission,
                    .help = "Colour of the emitted light"},
          m.emission_color);
    visit(Parameter{.name = "emission_strength",
                    .sockets = "Emission Strength",
                    .unit = "W/(m^2 sr)",
                    .lower = 0,
                    .upper = 1e6,
                    .fit_lower = 0.001,
                    .fit_upper = 10,
                    .initial = 0,
                    .effect = Effect::kEmission,
                    .help = "Radiance of the emitted light where its colour is 1"},
          m.emission_strength);
    visit(Parameter{.name = "subsurface_weight",
                    .sockets = "Subsurface Weight",
                    .unit = "1",
                    .lower = 0,
                    .upper = 1,
                    .fit_lower = 0,
                    .fit_upper = 1,
                    .initial = 0,
                    .versions = Versions::k2,
                    .optional = true,
                    .help = "Share of the diffuse part that scatters under the surface"},
          m.subsurface_weight);
    visit(Parameter{.name = "subsurface_radius",
                    .sockets = "Subsurface Radius",
                    .unit = "scale",
                    .lower = 0,
                    .upper = 1e6,
                    .fit_lower = 0.001,
                    .fit_upper = 10,
                    .initial = 1,
                    .scale = kLog,
                    .versions = Versions::k2,
                    .help = "How far each colour scatters under the surface, times the scale"},
          m.subsurface_radius);
    visit(Parameter{.name = "subsurface_scale",
                    .sockets = "Subsurface Scale",
                    .unit = "Blender unit",
                    .lower = 0,
                    .upper = 1e6,
                    .fit_lower = 0.0001,
                    .fit_upper = 10,
                    .initial = 0.05,
                    .scale = kLog,
                    .versions = Versions::k2,
                    .help = "Scales the subsurface radius"},
          m.subsurface_scale);
    visit(
        Parameter{.name = "subsurface_ior",
                  .sockets = "Subsurface IOR",
                  .unit = "1",
                  .lower = 1,
                  .upper = 10,
                  .fit_lower = 1.01,
                  .fit_upper = 2.5,
                  .initial = 1.4,
                  .scale = kLogExcess,
                  .versions = Versions::k2,
                  .help = "Index of refraction under the surface of the method Random Walk (Skin)"},
        m.subsurface_ior);
    visit(Parameter{.name = "subsurface_anisotropy",
                    .sockets = "Subsurface Anisotropy",
                    .unit = "1",
                    .lower = 0,
                    .upper = 1,
                    .fit_lower = 0,
                    .fit_upper = 0.9,
                    .initial = 0,
                    .versions = Versions::k2,
                    .help = "Forward scattering under the surface"},
          m.subsurface_anisotropy);
  }
};

/// The same values over another scalar: constants as duals without derivative, or values of duals.
/// `convert(U) -> T` maps one number.
template <class T, class U, class Convert>
constexpr Principled<T> convert_fields(const Principled<U>& from, Convert&& convert) {
  std::array<const U*, 64> number{};
  std::size_t count = 0;
  const auto list = [&](const U& x) { number[count++] = &x; };
  Principled<U>::fields(from, [&](const Parameter&, const auto& member) {
    if constexpr (requires { member.r; }) {
      list(member.r), list(member.g), list(member.b);
    } else {
      list(member);
    }
  });
  Principled<T> to;
  std::size_t next = 0;
  Principled<T>::fields(to, [&](const Parameter&, auto& member) {
    if constexpr (requires { member.r; }) {
      for (int c = 0; c < 3; ++c) member[c] = convert(*number[next++]);
    } else {
      member = convert(*number[next++]);
    }
  });
  return to;
}
template <class T, class U>
constexpr Principled<T> lift(const Principled<U>& from) {
  return convert_fields<T>(from, [](const U& x) { return T(scalar_t<T>(value_of(x))); });
}

}  // namespace selenite
