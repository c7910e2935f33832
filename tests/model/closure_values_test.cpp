// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "model/closure_cases.h"

namespace selenite {
namespace {

namespace c = closures;
using cases::Mixture;
using Colord = Color<double>;

// Noise-free values of a plane under a sun of no size, rendered by Cycles 4.5.15 in 32 bits.
TEST(Closures, AreThoseOfCycles) {
  const Colord col{.9, .5, .2};
  const auto multi = Flavour::Distribution::kMultiGgx, single = Flavour::Distribution::kGgx;
  struct Row {
    Closure<double> closure;
    Flavour::Distribution distribution;
    bool backfacing, through;
    Colord value;
    Vec3d tangent{};
  };
  const auto beckmann = Flavour::Distribution::kBeckmann,
             shirley = Flavour::Distribution::kAshikhminShirley;
  const Vec3d x{1, 0, 0};
  const Row rows[] = {
      {c::Diffuse<double>{col, .4}, multi, false, false, {0.1685871, 0.08861844, 0.03472263}},
      {c::Glossy<double>{col, .6}, multi, false, false, {0.1705832, 0.08577862, 0.03200223}},
      {c::Glossy<double>{col, .6}, single, false, false, {0.1377657, 0.0765365, 0.0306146}},
      {c::Glass<double>{col, .6, 1.5},
       multi,
       false,
       false,
       {0.006909681, 0.003756191, 0.001478575}},
      {c::Glass<double>{col, .6, 1.5}, multi, false, true, {0.7157884, 0.3891118, 0.1531687}},
      {c::Glass<double>{col, .6, 1.5}, multi, true, false, {0.1761491, 0.08729259, 0.03222443}},
      {c::Glass<double>{col, .6, 1.5}, multi, true, true, {0.05895756, 0.02921706, 0.0107856}},
      {c::Glass<double>{col, .6, 1.5},
       single,
       false,
       false,
       {0.006583634, 0.003657574, 0.00146303}},
      {c::Glass<double>{col, .6, 1.5}, single, false, true, {0.6820124, 0.3788958, 0.1515583}},
      {c::Glass<double>{col, .6, 1.5}, single, true, false, {0.1377658, 0.07653656, 0.03061462}},
      {c::Glass<double>{col, .6, 1.5}, single, true, true, {0.04611057, 0.02561699, 0.01024679}},
      {c::Refraction<double>{col, .6, 1.5}, single, false, true, {0.7437119, 0.4131733, 0.1652693}},
      {c::Refraction<double>{col, .6, 1.5},
       single,
       true,
       true,
       {0.05028204, 0.02793447, 0.01117379}},
      {c::Translucent<double>{col}, multi, false, true, {0.2291832, 0.127324, 0.05092959}},
      {c::Metallic<double>{col, {.4, .8, 1}, .6},
       multi,
       false,
       false,
       {0.1668872, 0.08584642, 0.03244474}},
      {c::Conductor<double>{{.2, 2.5, 1}, {3.9, 3, .5}, .6},
       multi,
       false,
       false,
       {0.1826704, 0.09103587, 0.01280726}},
      {c::Sheen<double>{col, .4}, multi, false, false, {0.004172584, 0.002318102, 0.0009272409}},
      {c::Glossy<double>{col, .6}, beckmann, false, false, {0.1712009, 0.09511161, 0.03804464}},
      {c::Glossy<double>{col, .6}, shirley, false, false, {0.1319695, 0.07331638, 0.02932655}},
      {c::Glass<double>{col, .6, 1.5},
       beckmann,
       false,
       false,
       {0.008181456, 0.004545253, 0.001818101}},
      {c::Glass<double>{col, .6, 1.5}, beckmann, false, true, {0.5328567, 0.2960315, 0.1184126}},
      {c::Glass<double>{col, .6, 1.5}, beckmann, true, false, {0.1712009, 0.09511161, 0.03804464}},
      {c::Refraction<double>{col, .6, 1.5},
       beckmann,
       false,
       true,
       {0.5810626, 0.3228126, 0.129125}},
      {c::Metallic<double>{col, {.4, .8, 1}, .6},
       beckmann,
       false,
       false,
       {0.1707515, 0.09511125, 0.03823931}},
      {c::Conductor<double>{{.2, 2.5, 1}, {3.9, 3, .5}, .6},
       beckmann,
       false,
       false,
       {0.1808812, 0.1001792, 0.01550686}},
      {c::Glossy<double>{col, .5, .5}, single, false, false, {0.2548749, 0.1415972, 0.05663886}, x},
      {c::Glossy<double>{col, .5, -.7},
       single,
       false,
       false,
       {0.001048355, 0.0005824196, 0.0002329678},
       x},
      {c::Glossy<double>{col, .5, .99},
       single,
       false,
       false,
       {5.720031e-06, 3.177795e-06, 1.271118e-06},
       x},
      {c::Glossy<double>{col, .5, .5}, multi, false, false, {0.2882501, 0.1513816, 0.05814764}, x},
      {c::Glossy<double>{col, .5, -.7},
       multi,
       false,
       false,
       {0.001185635, 0.0006226653, 0.0002391738},
       x},
      {c::Glossy<double>{col, .5, .5},
       beckmann,
       false,
       false,
       {0.2735658, 0.151981, 0.06079239},
       x},
      {c::Glossy<double>{col, .5, .5}, shirley, false, false, {0.2167326, 0.120407, 0.04816281}, x},
      {c::Glossy<double>{col, .5, .5},
       single,
       false,
       false,
       {0.008187405, 0.004548558, 0.001819423},
       {1, 2, 0}},
      {c::Metallic<double>{col, {.4, .8, 1}, .5, .6},
       single,
       false,
       false,
       {0.0277725, 0.01546971, 0.006219571},
       x},
      {c::Metallic<double>{col, {.4, .8, 1}, .9, 1},
       single,
       false,
       false,
       {0.02095678, 0.01167325, 0.004693209},
       x},
      {c::Metallic<double>{col, {.4, .8, 1}, .9, 1},
       multi,
       false,
       false,
       {0.02838561, 0.01390531, 0.005080805},
       x},
      {c::Metallic<double>{col, {.4, .8, 1}, .9, 1},
       beckmann,
       false,
       false,
       {0.01313348, 0.007315551, 0.002941204},
       x},
  };
  for (const Row& row : rows) {
    SCOPED_TRACE(kClosureNames[row.closure.index()]);
    const Mixture one{
        {row.closure, Flavour{.distribution = row.distribution}, 1, {0, 0, 1}, row.tangent}};
    const SurfaceBsdf<double> bsdf(one, cases::flat(cases::direction(.6), row.backfacing));
    const Colord f = bsdf.value(row.through ? cases::direction(-.8, 3) : cases::direction(.7, 2.5));
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(f[k], row.value[k], 1e-5 * row.value.r);
  }
}

}  // namespace
}  // namespace selenite
