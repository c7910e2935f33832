// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "render/picture_statistics.h"
#include "scene/small_scenes.h"

namespace selenite {
namespace {

/// Scatters under the surface and does nothing else.
Material wax(const Color<double>& color, double scale) {
  Material m = matte("Wax", 0);
  m.values.base_color = color;
  m.values.roughness = 0.5;
  m.values.subsurface_weight = 1;
  m.values.subsurface_radius = {1, 0.6, 0.4};
  m.values.subsurface_scale = scale;
  return m;
}

/// A large flat slab, thick against every free path, under a sky of radiance 1.
Scene slab(const Material& material) {
  SceneBuilder builder;
  place(builder, box_mesh(50, 50, 50), builder.add_material(material), translation({0, 0, -50}));
  add_view(builder, {0, 0, 8}, {0, 0, 0}, 200);
  set_sky(builder, 1);
  return builder.build();
}

TEST(Subsurface, HalfSpaceReflectsWhatCyclesMeasures) {
  Material m = wax({0.2, 0.5, 0.9}, 1);
  m.values.subsurface_radius = Color<double>(1);
  const Film film = render_view(slab(m), settings_of(8, 2000));
  ASSERT_TRUE(complete(film));
  // Measured in Blender 4.5.15 at normal view with 256 000 samples; standard errors up to 0.0006.
  const double measured[] = {0.1622, 0.4423, 0.8819};
  for (int c = 0; c < 3; ++c) {
    const Estimate e = mean_of(film, c);
    EXPECT_LT(std::abs(e.mean - measured[c]), 4 * std::hypot(e.error, 0.0006)) << e.mean;
  }
}

TEST(Subsurface, NoPathLengthIsDiffuseReflection) {
  Material m = wax({0.2, 0.5, 0.9}, 0);
  const Film film = render_view(slab(m), settings_of(4, 100));
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(mean_of(film, c).mean, m.values.base_color[c], 1e-4);
}

TEST(Subsurface, BlackMaterialIsBlack) {
  const Film film = render_view(slab(wax(Color<double>(0), 1)), settings_of(4, 100));
  for (int c = 0; c < 3; ++c) EXPECT_EQ(mean_of(film, c).mean, 0);
}

/// A ball of wax, lit from one side.
Scene ball(const Material& material, double size = 1) {
  SceneBuilder builder;
  place(builder, sphere_mesh(size, 12), builder.add_material(material));
  Light sun;
  sun.name = "Sun";
  sun.kind = LightKind::kSun;
  sun.values.power = 3;
  sun.to_world = looking_at({3, 0, 2}, {0, 0, 0});
  builder.add_light(sun);
  add_view(builder, {0, -4 * size, size}, {0, 0, 0}, 60);
  builder.cameras.back().clip_start = 1e-3 * size;
  builder.cameras.back().clip_end = 1e3 * size;
  set_sky(builder, 0.5);
  return builder.build();
}

TEST(Subsurface, SizeOfObjectAndPathsTogetherChangeNothing) {
  const double sizes[] = {1e-3, 1, 1e4};
  std::vector<Estimate> means;
  for (double size : sizes) {
    Material m = wax({0.8, 0.5, 0.2}, 0.2 * size);
    const Film film = render_view(ball(m, size), settings_of(8, 300));
    ASSERT_TRUE(complete(film));
    means.push_back(mean_of(film, 0));
  }
  // Same random numbers: only rounding tells them apart, and it sends a few walks another way.
  for (const Estimate& e : means)
    EXPECT_LT(std::abs(e.mean - means[1].mean), 3 * means[1].error + 1e-5);
}

TEST(Subsurface, TinyRadiusTendsToTheHalfSpace) {
  // Where the free path is 1e-4 of the ball, each point of it is a slab. Under a sky alone.
  Material m = wax({0.5, 0.5, 0.5}, 1);
  m.values.subsurface_radius = Color<double>(1);
  SceneBuilder builder;
  m.values.subsurface_scale = 1e-3 * 4 * kPi<double>;
  place(builder, sphere_mesh(1, 64), builder.add_material(m));
  add_view(builder, {0, -4, 0}, {0, 0, 0}, 300);
  set_sky(builder, 1);
  const Film film = render_view(builder.build(), settings_of(8, 1000));
  const Estimate e = mean_of(film, 1);
  EXPECT_LT(std::abs(e.mean - 0.4423), 0.004 + 3 * e.error) << e.mean;
}

TEST(Subsurface, IsDiffuseAfterADiffuseScattering) {
  // Seen by way of a white diffuse wall, wax is the diffuse reflector of its colour.
  const auto seen_by_wall = [](double weight) {
    SceneBuilder builder;
    Material m = wax({0.5, 0.5, 0.5}, 1);
    m.values.subsurface_weight = weight;
    place(builder, quad_mesh(3), builder.add_material(matte("Wall", 0.8)));
    place(builder, sphere_mesh(0.8, 12), builder.add_material(m), translation({0, 0, 1.2}));
    add_view(builder, {2.5, -1, 0.4}, {1.2, 0.5, 0}, 200);
    set_sky(builder, 1);
    return mean_of(render_view(builder.build(), settings_of(6, 4000)));
  };
  const Estimate under = seen_by_wall(1), plain = seen_by_wall(0);
  EXPECT_LT(std::abs(under.mean - plain.mean), 4 * std::hypot(under.error, plain.error));
}

struct Slope {
  std::string parameter;
  double value, step;
  int spp = 500;
  Flavour::Subsurface method = Flavour::Subsurface::kRandomWalk;
};

void PrintTo(const Slope& s, std::ostream* out) { *out << s.parameter << " at " << s.value; }

class SubsurfaceGradient : public testing::TestWithParam<Slope> {};

TEST_P(SubsurfaceGradient, AgreesWithDifferencesOfRenders) {
  const Slope& p = GetParam();
  Material m = wax({0.8, 0.5, 0.15}, 0.5);
  m.flavour.subsurface = p.method;
  m.values.subsurface_weight = 0.7;
  m.values.subsurface_anisotropy = 0.3;
  m.values.ior = 2.2;
  if (p.parameter == "ior") m.values.specular_level = 0.5;  // it takes the entry's IOR along
  const Scene base = ball(m);
  const ParameterRef ref = base.find("Wax", p.parameter);
  const SlotLayout layout(base, {ref});
  const std::size_t width = base.get(ref).size();
  const auto at = [&](double step) {
    return base.with({{ref, std::vector<double>(width, p.value + step)}});
  };
  Tally gap, size;
  for (int seed = 0; seed < 12; ++seed) {
    const RenderSettings settings = settings_of(6, p.spp, 40 + seed);
    const Film film = render_view(at(0), settings, layout);
    ASSERT_TRUE(complete(film));
    const Film up = render_view(at(p.step), settings), down = render_view(at(-p.step), settings);
    double got = 0, want = 0;
    for (int c = 0; c < 3; ++c) {
      got += slope_of(film, 0, c).mean;
      want += (mean_of(up, c).mean - mean_of(down, c).mean) / (2 * p.step);
    }
    gap.add(got - want);
    size.add(std::abs(want));
  }
  const Estimate e = gap.estimate();
  RecordProperty("error_per_slope", std::to_string(e.error / size.mean()));
  // Student's t of 11 degrees of freedom beyond 4.4: 1 false alarm in 1000. 3 % for the curvature.
  EXPECT_LT(std::abs(e.mean), 4.4 * e.error + 0.03 * size.mean())
      << e.mean << " +- " << e.error << ", slope is about " << size.mean();
  EXPECT_LT(e.error, 0.25 * size.mean()) << "a missing derivative would not be noticed";
}

INSTANTIATE_TEST_SUITE_P(
    Parameters, SubsurfaceGradient,
    testing::Values(Slope{"base_color", 0.1, 0.03, 60}, Slope{"base_color", 0.5, 0.05, 60},
                    Slope{"base_color", 0.9, 0.02, 60}, Slope{"subsurface_weight", 0.5, 0.1},
                    Slope{"subsurface_radius", 1, 0.15}, Slope{"subsurface_scale", 0.5, 0.08, 1500},
                    Slope{"subsurface_anisotropy", 0.05, 0.05},
                    Slope{"subsurface_anisotropy", 0.5, 0.03}, Slope{"ior", 1.7, 0.15},
                    Slope{"base_color", 0.5, 0.05, 60, Flavour::Subsurface::kRandomWalkSkin},
                    Slope{"subsurface_ior", 1.5, 0.2, 500, Flavour::Subsurface::kRandomWalkSkin}),
    [](const auto& info) { return info.param.parameter + "_" + std::to_string(info.index); });

}  // namespace
}  // namespace selenite
