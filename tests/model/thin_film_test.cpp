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
    const ThinFilm<double> thin{1e-5, 2.};
    const ConductorFresnel<double> metal{Colord(0.4), Colord(2.5), true};
    EXPECT_NEAR(filmed_metal(1, thin, MetalBelow<double>{0.4, 2.5}, c), metal.at(c).g, 1e-6);
    const MetalFresnel<double> gold(Colord(0.8), Colord(0.9));
    const double edge = MetalFresnel<double>::curve(gold.f0.g, gold.bump.g, 1. / 7);
    EXPECT_NEAR(filmed_metal(1, thin, metal_of_colors(0.8, edge), c), gold.at(c).g, 1e-6);
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

/// Rendered by Cycles 5.0.1 under a sun of strength 1.
struct ProbeOf5 {
  Closure<double> closure;
  Flavour::Distribution distribution;
  Vec3d wi, wo;  ///< in the frame of the face
  Colord seen;
};
closures::FullPrincipled<double> principled(Colord color, double roughness, double ior, Colord tint,
                                            double metallic, double transmission,
                                            ThinFilm<double> film) {
  closures::FullPrincipled<double> m;
  m.base_color = color, m.roughness = roughness, m.ior = ior, m.specular_tint = tint;
  m.metallic = metallic, m.transmission = transmission, m.film = film;
  return m;
}
std::vector<ProbeOf5> probes_of_5() {
  namespace c = closures;
  using enum Flavour::Distribution;
  return {
      {principled({0.445032, 0.4676259, 0.1407477}, 0.7830018, 1.765559,
                  {0.563793, 0.3572212, 0.1485376}, 0, 0, {234.1304, 2.199176}),
       kMultiGgx,
       {-0.124245822, -0.721858442, 0.680795789},
       {0.303779185, 0.281268209, 0.910277963},
       {0.1488805, 0.1316517, 0.04305113}},
      {principled({0.8598079, 0.4531642, 0.5437207}, 0.6914215, 1.364157,
                  {0.4914528, 0.9767676, 0.9079098}, 0, 0, {673.6825, 1.260803}),
       kMultiGgx,
       {-0.140114129, 0.336596519, 0.931166112},
       {0.556602538, 0.277752012, 0.78297323},
       {0.2117521, 0.1145102, 0.1348518}},
      {principled({0.7112634, 0.8830797, 0.3045867}, 0.6333577, 1.5,
                  {0.562871, 0.9277907, 0.4385287}, 1, 0, {826.8138, 2.072195}),
       kMultiGgx,
       {-0.563948393, 0.592913568, 0.574818373},
       {0.330756813, -0.690130591, 0.643676996},
       {0.3139396, 0.5195623, 0.1195259}},
      {principled({0.4930003, 0.2829276, 0.3924484}, 0.3111103, 1.5,
                  {0.8244973, 0.4007198, 0.7020184}, 1, 0, {764.3507, 1.516452}),
       kMultiGgx,
       {0.385981351, -0.288543165, 0.876219571},
       {0.151425302, 0.435985118, 0.887122869},
       {0.0381112, 0.01629676, 0.02764306}},
      {principled({0.3119648, 0.3878062, 0.8198916}, 0.3894232, 1.5,
                  {0.8191072, 0.6691265, 0.8793637}, 1, 0, {554.9477, 1.706385}),
       kMultiGgx,
       {-0.62278533, 0.447353393, 0.641882658},
       {0.830273151, -0.0751896724, 0.55226171},
       {0.06414406, 0.04414804, 0.1203501}},
      {principled({0.9399015, 0.1772432, 0.8604341}, 0.4417165, 1.210175, {1, 1, 1}, 0, 1,
                  {457.5165, 2.151023}),
       kGgx,
       {-0.673759818, 0.212847829, 0.707632363},
       {0.768711448, 0.481982827, 0.420446366},
       {0.0008961632, 0.01274119, 0.005660052}},
      {c::Metallic<double>{{0.4594827, 0.9427979, 0.6005438},
                           {0.4680947, 0.8189952, 0.7720728},
                           0.7105231,
                           0,
                           {524.6771, 1.421889}},
       kGgx,
       {-0.266023666, -0.313517421, 0.911558211},
       {-0.50042665, -0.766879618, 0.401831925},
       {0.008016705, 0.04004538, 0.02184266}},
      {c::Metallic<double>{{0.6768461, 0.1963805, 0.723},
                           {0.7447708, 0.5635588, 0.8589663},
                           0.4164153,
                           0,
                           {473.3212, 1.997934}},
       kGgx,
       {-0.440964758, 0.13206172, 0.887755454},
       {0.51500386, 0.362103522, 0.776950419},
       {0.1569866, 0.02059085, 0.1419008}},
      {c::Conductor<double>{
           {1.203379, 2.168448, 1.876302}, {2.828903, 2.975862, 2.198661}, 0.7853063, 0, {0, 1.33}},
       kMultiGgx,
       {0.17952621, -0.194736674, 0.964286029},
       {-0.243096128, -0.865238965, 0.438480824},
       {0.05610264, 0.04610928, 0.03457117}},
      {c::Conductor<double>{{0.5433086, 2.167382, 2.558111},
                            {1.66478, 2.257675, 1.970002},
                            0.8751138,
                            0,
                            {422.0945, 1.602085}},
       kGgx,
       {-0.189515993, -0.170437306, 0.966971993},
       {-0.679806948, 0.259422362, 0.685975671},
       {0.03442866, 0.01512339, 0.03587563}},
      {c::Conductor<double>{{0.1026674, 1.318535, 1.931165},
                            {3.746348, 3.702339, 1.376664},
                            0.8933166,
                            0,
                            {331.3725, 2.023252}},
       kGgx,
       {0.240335092, -0.140128374, 0.960522473},
       {-0.395860583, -0.706670165, 0.586440206},
       {0.07657779, 0.03268057, 0.02642206}},
      {c::Glass<double>{
           {0.2415335, 0.4645888, 0.166126}, 0.8148234, 1.780159, {297.8525, 1.727106}},
       kMultiGgx,
       {0.196847975, -0.563930631, -0.802018404},
       {0.172136262, 0.408174604, 0.896528244},
       {0.03818696, 0.08216118, 0.02529904}},
      {c::Glass<double>{
           {0.3323273, 0.5425981, 0.5978854}, 0.3637572, 1.805063, {395.0874, 1.647123}},
       kMultiGgx,
       {-0.0799913332, 0.323473781, 0.942849934},
       {0.161593974, -0.440250278, -0.883214056},
       {0.04960831, 0.08463553, 0.09119295}},
      {c::Glass<double>{
           {0.1515327, 0.1024707, 0.2756436}, 0.5050051, 1.849679, {822.8098, 1.680501}},
       kMultiGgx,
       {-0.513911724, -0.130894214, -0.847798049},
       {0.915789068, 0.268729031, 0.298521519},
       {0.09506273, 0.06661886, 0.1821821}},
  };
}

TEST(ThinFilm, OfBlender5IsThatOfCyclesOnEveryShader) {
  int row = 0;
  for (const ProbeOf5& probe : probes_of_5()) {
    const Vec3d n{0, 0, std::copysign(1., probe.wi.z)};
    Flavour flavour{probe.distribution};
    flavour.blender5 = true;
    const cases::Mixture one{{probe.closure, flavour, 1, n}};
    const Colord got = SurfaceBsdf<double>(one, {n, n, probe.wi, probe.wi.z < 0}).value(probe.wo);
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(got[k], probe.seen[k], 1e-4 * max_channel(probe.seen)) << row;
    ++row;
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

class FilmSlopes : public testing::TestWithParam<bool> {};

TEST_P(FilmSlopes, AreThoseOfDifferencesByAllThatShapesIt) {
  namespace c = closures;
  Flavour flavour;
  flavour.blender5 = GetParam();
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
      m.metallic = D(i % 5 ? 0.3 : 0);
      auto point = cases::flat(cases::direction(0.2 + 0.8 * u(engine)), i % 3 == 0);
      const Vec3d wo = cases::random_direction(engine);
      const auto value = [&](double x) {
        slope.of(m) = D::variable(x, 0);
        std::vector<PlacedClosure<D>> one(1);
        one[0] = {m, flavour, D(1), {0, 0, 1}};
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
INSTANTIATE_TEST_SUITE_P(ThinFilm, FilmSlopes, testing::Bool(), [](const auto& info) {
  return std::string(info.param ? "Blender5" : "Blender4");
});

TEST(ThinFilm, OnAConductorHasDerivativesByItsIndex) {
  for (const bool extinction : {false, true})
    for (const double c : {0.2, 0.7, 1.}) {
      const auto at = [&](double x) {
        closures::Conductor<D> m;
        m.film = {D(350), D(1.6)};
        (extinction ? m.extinction : m.ior) = Color<D>(D::variable(x, 0));
        return ClosureLayers<D>::conductor_fresnel(m, true).at(c).g;
      };
      const double h = 1e-5;
      EXPECT_NEAR(at(1.4).d[0], (at(1.4 + h).v - at(1.4 - h).v) / (2 * h), 1e-6) << c;
    }
}

}  // namespace
}  // namespace selenite
