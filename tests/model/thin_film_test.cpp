// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/thin_film.h"

#include <gtest/gtest.h>

#include "model/closure_cases.h"

namespace selenite {
namespace {

using Colord = Color<double>;
using D = Dual<double, 1>;

TEST(ThinFilm, ReflectsAtNormalIncidenceAsInCycles) {
  struct Row {
    double eta, ior, thickness;
    Colord seen;
  };
  for (const Row& row : {Row{1.5, 1.33, 12.020345, {0.039547, 0.039273, 0.038917}},
                         Row{1.5, 1.33, 150.031708, {0.008119, 0.022265, 0.037417}},
                         Row{1.5, 1.33, 699.851196, {0.043166, 0.013441, 0.030296}},
                         Row{1.5, 1.33, 2499.786621, {0.023537, 0.023521, 0.023525}},
                         Row{2.5, 0.5, 60.395557, {0.263406, 0.300469, 0.347192}},
                         Row{2.5, 0.5, 319.741180, {0.686249, 0.654142, 0.562241}},
                         Row{2.5, 0.5, 2499.902344, {0.390006, 0.535184, 0.526799}}}) {
    const auto got = film_reflectance(row.thickness, row.ior, row.eta, 1.);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(got[k], row.seen[k], 5e-6) << row.thickness;
  }
}

TEST(ThinFilm, OfTheIndexOfEitherSideIsNone) {
  for (const double eta : {1.5, 1 / 1.5, 3.})
    for (const double c : {0.1, 0.5, 1.}) {
      const double want = fresnel_dielectric(c, eta * eta - 1);
      for (const double thickness : {20., 100., 500.}) {
        EXPECT_NEAR(film_reflectance(thickness, 1., eta, c)[1], want, 1e-12);
        if (thickness < 30) continue;  // it fades, and so does its index
        EXPECT_NEAR(film_reflectance(thickness, eta, eta, c)[1], want, 1e-12);
      }
    }
}

TEST(ThinFilm, FadesWithItsThickness) {
  for (const double c : {0.2, 1.}) {
    const double bare = fresnel_dielectric(c, 1.25);
    for (const double x : film_reflectance(1e-3, 2., 1.5, c)) EXPECT_NEAR(x, bare, 1e-8);
  }
}

/// A Principled BSDF with a film, as it was rendered by Cycles 4.5.15 under a sun of strength 1.
struct Probe {
  ThinFilm<double> film;
  double ior, specular_level;
  Colord specular_tint, base_color;
  double roughness, transmission;
  bool back;
  Vec3d wi, wo;  ///< in the frame of the face
  Colord seen;
};
const std::vector<Probe> kProbes{
    {{1077.789, 1.586133},
     1.89633,
     .3454774,
     {.2310221, .6182731, .9220516},
     {.9574049, .9760624, .1281949},
     .8153499,
     0,
     true,
     {.0732046169, -.584628775, -.807991509},
     {.300382963, -.274807734, -.9133733},
     {.2712761, .2793383, .04237869}},
    {{600.1486, 1.477365},
     1.874172,
     .4095491,
     {.3676099, .7146444, .7006828},
     {.9179327, .561794, .2483081},
     .3651324,
     1,
     false,
     {.0910311364, -.859553497, .502872864},
     {-.125558332, -.641755942, .756560914},
     {.0003136384, .000245327, .0003658105}},
    {{538.756, 1.639324},
     1.875599,
     .3568407,
     {.9031403, .6770381, .2404755},
     {.9348623, .8851637, .6672817},
     .8240463,
     .5,
     true,
     {-.363733222, -.242128367, -.899484295},
     {-.181382639, .103257835, -.977976563},
     {.1476864, .1415408, .1044071}},
    {{523.8436, 1.160129},
     1.484078,
     .4274279,
     {.4931588, .9314543, .6590707},
     {.3808177, .5411686, .8444328},
     .7170093,
     0,
     false,
     {-.329305877, -.835389466, .440093263},
     {-.558125247, -.559012963, .613188972},
     {.07344609, .1036316, .1604799}},
    {{976.4515, 1.607345},
     1.548868,
     .5,
     Colord(1),
     {.9733887, .4665844, .4171371},
     .4272941,
     1,
     false,
     {-.240726352, .664644617, .70731772},
     {.471148651, -.783626585, -.404905327},
     {.02842239, .01980407, .01869595}},
    {{1197.449, 2.150333},
     1.792794,
     .5,
     Colord(1),
     {.9623157, .8274506, .6804929},
     .7921788,
     1,
     true,
     {.289136146, .0391479874, -.956487179},
     {-.518985704, -.320208553, .792540423},
     {.5821031, .5507701, .4707294}},
    {{309.8769, 1.908722},
     1.275519,
     .5,
     Colord(1),
     {.4777526, .9966992, .8764312},
     .693733,
     1,
     false,
     {.576413411, -.575271305, .580353776},
     {-.438773641, .309750555, -.843523731},
     {.6474471, 1.282685, 1.027273}},
    {{458.0124, 1.233975},
     1.816561,
     .5,
     Colord(1),
     {.7502112, .871675, .6285943},
     .3744179,
     1,
     true,
     {-.85822247, -.273818725, -.434139952},
     {.834218798, -.109351613, .540482398},
     {.009061601, .009511642, .008068457}},
};

TEST(ThinFilm, OfThePrincipledIsThatOfCycles) {
  for (const Probe& probe : kProbes) {
    closures::FullPrincipled<double> m;
    m.film = probe.film, m.ior = probe.ior, m.specular_level = probe.specular_level;
    m.specular_tint = probe.specular_tint, m.base_color = probe.base_color;
    m.roughness = probe.roughness, m.transmission = probe.transmission;
    const Vec3d n{0, 0, probe.back ? -1. : 1.};
    const cases::Mixture one{{m, Flavour{}, 1, n}};
    const Colord got = SurfaceBsdf<double>(one, {n, n, probe.wi, probe.back}).value(probe.wo);
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(got[k], probe.seen[k], 1e-4 * max_channel(probe.seen)) << probe.ior;
  }
}

TEST(ThinFilm, OnSmoothGlassLosesNothing) {
  closures::FullPrincipled<double> m;
  m.transmission = 1, m.base_color = Colord(1), m.roughness = 0, m.film = {400, 1.8};
  const cases::Mixture one{cases::placed(m)};
  const SurfaceBsdf<double> bsdf(one, cases::flat(cases::direction(0.6), false));
  Colord sum(0);
  bool reflected = false, passed = false;
  for (int i = 0; i < 200; ++i) {
    const auto s = bsdf.sample((i + 0.5) / 200, 0.4, 0.5);
    ASSERT_TRUE(s);
    bool& seen = s->transmits ? passed : reflected;
    if (!seen) sum += s->weight * s->density;
    seen = true;
  }
  EXPECT_TRUE(reflected && passed);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(sum[k], 1, 1e-12);
}

TEST(ThinFilm, HasDerivativesByAllThatShapesIt) {
  namespace c = closures;
  struct Slope {
    const char* name;
    D& (*of)(c::FullPrincipled<D>&);
    double x;
  };
  const std::vector<Slope> slopes{
      {"thickness", [](auto& m) -> D& { return m.film.thickness; }, 321},
      {"thin", [](auto& m) -> D& { return m.film.thickness; }, 12},
      {"index", [](auto& m) -> D& { return m.film.ior; }, 1.6},
      {"ior", [](auto& m) -> D& { return m.ior; }, 1.45},
      {"roughness", [](auto& m) -> D& { return m.roughness; }, 0.43},
      {"level", [](auto& m) -> D& { return m.specular_level; }, 0.3},
      {"tint", [](auto& m) -> D& { return m.specular_tint.g; }, 0.6},
      {"color", [](auto& m) -> D& { return m.base_color.g; }, 0.6},
  };
  std::mt19937_64 engine(31);
  std::uniform_real_distribution<double> u;
  for (const Slope& slope : slopes) {
    int moved = 0;
    for (int i = 0; i < 100; ++i) {
      c::FullPrincipled<D> m;
      m.film = {D(100 + 500 * u(engine)), D(1.2 + u(engine))};
      m.roughness = D(0.3 + 0.5 * u(engine)), m.transmission = D(i % 2 ? 0.7 : 0);
      auto point = cases::flat(cases::direction(0.2 + 0.8 * u(engine)), i % 3 == 0);
      const Vec3d wo = cases::random_direction(engine);
      const auto value = [&](double x) {
        slope.of(m) = D::variable(x, 0);
        std::vector<PlacedClosure<D>> one(1);
        one[0] = {m, Flavour{}, D(1), {0, 0, 1}};
        return SurfaceBsdf<D>(one, point).value(wo).g;
      };
      const D here = value(slope.x);
      const double h = 1e-5 * std::max(1., 0.1 * slope.x);
      const auto difference = [&](double step) {
        return (value(slope.x + step).v - value(slope.x - step).v) / (2 * step);
      };
      const double coarse = difference(2 * h), fine = difference(h);
      const double scale = std::abs(here.d[0]) + std::abs(here.v) + 1e-3;
      moved += here.d[0] != 0;
      if (std::abs(coarse - fine) > 1e-5 * scale) continue;  // a node of a table
      EXPECT_NEAR(here.d[0], fine, 1e-4 * scale) << slope.name << " " << i;
    }
    EXPECT_GT(moved, 30) << slope.name;
  }
}

}  // namespace
}  // namespace selenite
