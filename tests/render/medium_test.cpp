// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "render/media_scenes.h"
#include "render/picture_statistics.h"

namespace selenite {
namespace {

class Absorption : public testing::TestWithParam<double> {};

TEST_P(Absorption, FollowsBeersLawWithItsDerivative) {
  const double size = GetParam();
  const Color<double> sigma = Color<double>{0.3, 1, 3} / size;
  const Scene scene = slab(fog(sigma, 0), size);
  const SlotLayout layout = ticked(scene, {{"Medium", "extinction"}});
  const Film film = render_view(scene, settings_of(4, 4000), layout);
  ASSERT_TRUE(complete(film));
  for (int c = 0; c < 3; ++c) {
    const double depth = 2 * size, want = std::exp(-sigma[c] * depth);
    const Estimate light = mean_of(film, c), slope = slope_of(film, 0, c);
    EXPECT_LT(std::abs(light.mean - want), 4 * light.error + 1e-3 * want) << c;
    EXPECT_LT(std::abs(slope.mean + depth * want), 4 * slope.error + 1e-3 * depth * want) << c;
  }
}
INSTANTIATE_TEST_SUITE_P(Sizes, Absorption, testing::Values(1e-4, 1.0, 1e5));

struct Furnace {
  double extinction, g, roughness, ior;
};
class MediumFurnace : public testing::TestWithParam<Furnace> {};

TEST_P(MediumFurnace, WhiteMediumLosesNothing) {
  const auto [extinction, g, roughness, ior] = GetParam();
  const Film film =
      render_view(ball(filled_glass(roughness, ior, extinction, 1, g)), settings_of(8, 300));
  ASSERT_TRUE(complete(film));
  const Estimate e = mean_of(film);
  // The compensation tables of glass give 0.1 % here; roulette and free paths the rest.
  EXPECT_LT(std::abs(e.mean - 1), 4 * e.error + 2e-3) << e.mean << " +- " << e.error;
}
INSTANTIATE_TEST_SUITE_P(Media, MediumFurnace,
                         testing::Values(Furnace{0.1, 0, 0, 1.5}, Furnace{3, 0, 0, 1.5},
                                         Furnace{3, 0.9, 0.05, 1.35}, Furnace{3, -0.9, 0, 1},
                                         Furnace{100, 0, 0, 1.3}, Furnace{3, 0.4, 0.3, 1.35}));

struct Slope {
  std::string parameter;
  double extinction, albedo;
};
void PrintTo(const Slope& s, std::ostream* out) {
  *out << s.parameter << ", extinction " << s.extinction << ", albedo " << s.albedo;
}

class MediumGradient : public testing::TestWithParam<Slope> {};

TEST_P(MediumGradient, AgreesWithDifferencesOfRenders) {
  const Slope& p = GetParam();
  const Scene base = lit_ball(filled_glass(0.3, 1.35, p.extinction, p.albedo, 0.3));
  const ParameterRef ref = base.find("Medium", p.parameter);
  const Parameter& row = base.description(ref);
  const SlotLayout layout(base, {ref});
  const double here = base.get(ref)[0];
  const double h = p.parameter == "extinction" ? std::max(0.1 * here, 0.02) : 0.02;
  // At an end of the range a one-sided difference, of second order.
  const double side = here - h < row.lower ? 1 : here + h > row.upper ? -1 : 0;
  const auto render_at = [&](double step, const RenderSettings& settings) {
    const std::vector<double> value(base.get(ref).size(), here + step);
    return mean_of(render_view(base.with({{ref, value}}), settings)).mean;
  };
  Tally gap, size;
  for (int seed = 0; seed < 12; ++seed) {
    const RenderSettings settings = settings_of(6, 200, 70 + seed);
    const Film film = render_view(base, settings, layout);
    ASSERT_TRUE(complete(film));
    const double want = side == 0
                            ? (render_at(h, settings) - render_at(-h, settings)) / (2 * h)
                            : side *
                                  (4 * render_at(side * h, settings) - 3 * mean_of(film).mean -
                                   render_at(2 * side * h, settings)) /
                                  (2 * h);
    gap.add(slope_of(film, 0).mean - want);
    size.add(std::abs(want));
  }
  const Estimate e = gap.estimate();
  RecordProperty("error_per_slope", std::to_string(e.error / size.mean()));
  // Student's t of 11 degrees of freedom beyond 4.4: 1 false alarm in 1000. 2 % for the curvature.
  EXPECT_LT(std::abs(e.mean), 4.4 * e.error + 0.02 * size.mean() + 1e-6)
      << e.mean << " +- " << e.error << ", slope is about " << size.mean();
  // A missing derivative would be noticed.
  EXPECT_LT(e.error, 0.25 * size.mean() + 0.03);
}

std::vector<Slope> slopes() {
  std::vector<Slope> all;
  for (const char* parameter : {"extinction", "albedo", "anisotropy"})
    for (double extinction : {0.0, 0.1, 3.0, 100.0})
      for (double albedo : {0.0, 0.5, 1.0})
        if (extinction < 100 || albedo < 1) all.push_back({parameter, extinction, albedo});
  for (const char* parameter : {"ior", "roughness"}) all.push_back({parameter, 3, 0.8});
  return all;
}
INSTANTIATE_TEST_SUITE_P(Media, MediumGradient, testing::ValuesIn(slopes()));

}  // namespace
}  // namespace selenite
