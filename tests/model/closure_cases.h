// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "model/cases.h"
#include "model/closures/surface_bsdf.h"

// Mixtures of closures that several tests share.
namespace selenite::cases {

using Mixture = std::vector<PlacedClosure<double>>;

/// Mixtures as functions of one roughness.
struct MixtureFamily {
  std::string name;
  Mixture (*make)(double roughness);
  double ior = 1.5;
  bool backfacing = false;
  bool low = false;      ///< see density_check::View
  double grazing = 0.1;  ///< the least cosine at which enough light is left to be counted
};

inline PlacedClosure<double> placed(const Closure<double>& closure, double weight = 1,
                                    const Vec3d& n = {0, 0, 1}) {
  return {closure, Flavour{.evaluate_unphysical_refraction = false}, weight, n};
}

inline Mixture of(Flavour::Distribution distribution, const Closure<double>& closure,
                  const Vec3d& tangent = {}) {
  Mixture one{placed(closure)};
  one[0].flavour.distribution = distribution;
  one[0].tangent = tangent;
  return one;
}

inline const std::vector<MixtureFamily>& mixture_families() {
  namespace c = closures;
  using Colord = Color<double>;
  using enum Flavour::Distribution;
  static const std::vector<MixtureFamily> all{
      {"diffuse",
       [](double r) -> Mixture {
         return {placed(c::Diffuse<double>{{.9, .5, .2}, r})};
       }},
      {"glossy",
       [](double r) -> Mixture {
         return {placed(c::Glossy<double>{{.9, .5, .2}, r})};
       }},
      {"glass",
       [](double r) -> Mixture {
         return {placed(c::Glass<double>{{.9, .5, .2}, r, 1.5})};
       }},
      {"glass_inside",
       [](double r) -> Mixture {
         return {placed(c::Glass<double>{{.9, .5, .2}, r, 1.5})};
       },
       1.5, true},
      {"refraction",
       [](double r) -> Mixture {
         return {placed(c::Refraction<double>{{.9, .5, .2}, r, 1.5})};
       },
       1.5, false, false, 0.3},
      {"refraction_inside",
       [](double r) -> Mixture {
         return {placed(c::Refraction<double>{{.9, .5, .2}, r, 1.5})};
       },
       1.5, true, false, 0.9},
      {"glossy_beckmann",
       [](double r) -> Mixture {
         return of(kBeckmann, c::Glossy<double>{{.9, .5, .2}, r});
       }},
      {"glossy_ashikhmin_shirley",
       [](double r) -> Mixture {
         return of(kAshikhminShirley, c::Glossy<double>{{.9, .5, .2}, r});
       }},
      {"glossy_stretched",
       [](double r) -> Mixture {
         return of(kMultiGgx, c::Glossy<double>{{.9, .5, .2}, r, .6}, {1, 2, 0});
       }},
      {"glossy_ashikhmin_shirley_stretched",
       [](double r) -> Mixture {
         return of(kAshikhminShirley, c::Glossy<double>{{.9, .5, .2}, r, -.6}, {1, 2, 0});
       }},
      {"metallic_beckmann_stretched",
       [](double r) -> Mixture {
         return of(kBeckmann, c::Metallic<double>{{.9, .5, .2}, {.9, .4, .7}, r, .8}, {1, 2, 0});
       }},
      {"glass_beckmann",
       [](double r) -> Mixture {
         return of(kBeckmann, c::Glass<double>{{.9, .5, .2}, r, 1.5});
       }},
      {"refraction_beckmann",
       [](double r) -> Mixture {
         return of(kBeckmann, c::Refraction<double>{{.9, .5, .2}, r, 1.5});
       },
       1.5, false, false, 0.3},
      {"translucent",
       [](double) -> Mixture {
         return {placed(c::Translucent<double>{{.9, .5, .2}})};
       }},
      {"metallic",
       [](double r) -> Mixture {
         return {placed(c::Metallic<double>{{.9, .5, .2}, {.9, .4, .7}, r})};
       }},
      {"conductor",
       [](double r) -> Mixture {
         return {placed(c::Conductor<double>{{.2, 2.5, 1}, {3.9, 3, 0}, r})};
       }},
      {"sheen_and_diffuse",
       [](double r) -> Mixture {
         return {placed(c::Sheen<double>{{.9, .5, .2}, r}, .8),
                 placed(c::Diffuse<double>{Colord(.1), 0}, .2)};
       },
       1.5, false, true},
      {"diffuse_and_glossy",
       [](double r) -> Mixture {
         return {placed(c::Diffuse<double>{{.8, .3, .1}, .4}, .7),
                 placed(c::Glossy<double>{{.5, .6, .7}, r}, .3)};
       }},
      {"principled_stretched",
       [](double r) -> Mixture {
         c::FullPrincipled<double> m;
         m.metallic = 0.3, m.transmission = 0.4, m.coat_weight = 0.5, m.coat_roughness = 0.3;
         m.roughness = r, m.anisotropic = 0.8;
         return of(kMultiGgx, m, {1, 2, 0});
       }},
      {"principled_filmed",
       [](double r) -> Mixture {
         c::FullPrincipled<double> m;
         m.metallic = 0.2, m.transmission = 0.5, m.coat_weight = 0.4, m.coat_roughness = 0.3;
         m.roughness = r, m.film = {400, 1.7};
         return {placed(m)};
       }},
      {"filmed_glass_inside",
       [](double r) -> Mixture {
         c::FullPrincipled<double> m;
         m.base_color = {.9, .5, .2}, m.transmission = 1, m.roughness = r, m.film = {250, 1.4};
         return {placed(m)};
       },
       1.5, true},
      {"principled_glass_and_translucent",
       [](double r) -> Mixture {
         Principled<double> m;
         m.metallic = 0.4, m.roughness = 0.4;
         return {placed(m, .5), placed(c::Glass<double>{Colord(1), r, 1.5}, .3),
                 placed(c::Translucent<double>{{.2, .8, .4}}, .2)};
       }},
  };
  return all;
}

}  // namespace selenite::cases
