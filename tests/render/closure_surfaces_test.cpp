// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "render/closure_materials.h"
#include "render/lanes/lanes.h"
#include "render/lit_plane.h"
#include "render/picture_statistics.h"

// Materials that are graphs of closures, in whole pictures.
namespace selenite {
namespace {

namespace c = closures;
using Colord = Color<double>;

/// A sphere over a ground, under a lamp and a grey sky.
Scene sphere_scene(const Material& material, double sky = 0.4) {
  SceneBuilder builder;
  place(builder, sphere_mesh(1, 10), builder.add_material(material));
  place(builder, quad_mesh(4), builder.add_material(matte("Ground", 0.5)),
        translation({0, 0, -1.2}));
  Light lamp = area(60, 1.5, {1.5, -1, 3});
  builder.add_light(lamp);
  add_view(builder, {0, -4, 1.5}, {0, 0, 0}, 55);
  set_sky(builder, sky);
  return builder.build();
}

void expect_same_pictures(const Scene& a, const Scene& b, int spp = 64) {
  const Film x = render_view(a, settings_of(8, spp)), y = render_view(b, settings_of(8, spp));
  ASSERT_TRUE(complete(x) && complete(y));
  for (std::size_t i = 0; i < x.mean.size(); ++i)
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(x.mean[i][k], y.mean[i][k], 2e-4 * (x.mean[i][k] + 0.01)) << i;
}

TEST(ClosureSurfaces, PrincipledAloneIsTheMaterialOfItsValues) {
  Material m = plastic("Body");
  m.values.base_color = {0.6, 0.4, 0.3};
  m.values.metallic = 0.3, m.values.transmission = 0.5, m.values.roughness = 0.4;
  m.values.coat_weight = 0.5, m.values.sheen_weight = 0.3;
  expect_same_pictures(
      sphere_scene(m),
      sphere_scene(
          ClosureMaterial().add("P", static_cast<Principled<double>>(m.values)).build("Body")));
}

TEST(ClosureSurfaces, SubsurfaceWalksAsThatOfThePrincipled) {
  Material m = plastic("Body");
  m.values.base_color = {0.8, 0.5, 0.3};
  m.values.specular_level = 0, m.values.subsurface_weight = 1, m.values.subsurface_scale = 0.3;
  m.values.roughness = 0.6;
  c::Subsurface<double> s;
  s.color = m.values.base_color, s.scale = 0.3, s.ior = 1, s.roughness = 0.36;
  expect_same_pictures(sphere_scene(m), sphere_scene(ClosureMaterial().add("S", s).build("Body")));
}

TEST(ClosureSurfaces, ClosedRoomOfEmissionAndDiffuseIsTheSeries) {
  const double rho = 0.5, emission = 0.5;
  SceneBuilder builder;
  const Material wall = ClosureMaterial()
                            .add("Diffuse", c::Diffuse<double>{Colord(rho), 0})
                            .add("Emission", c::Emission<double>{Colord(1), emission})
                            .build("Wall");
  place(builder, box_mesh(1, 1.5, 0.7), builder.add_material(wall));
  add_view(builder, {0.3, -0.4, 0.1}, {-1, 1, -0.3}, 15);
  const Scene scene = builder.build();
  const Film film = render_view(scene, settings_of(8, 1500),
                                ticked(scene, {{"Wall", "Diffuse.color"},
                                               {"Wall", "Emission.strength"},
                                               {"Wall", "Diffuse.share"}}));
  ASSERT_TRUE(complete(film));
  const double light = emission / (1 - rho), by_rho = emission / square(1 - rho);
  EXPECT_NEAR(mean_of(film).mean, light, 0.01 * light);
  EXPECT_LT(std::abs(mean_of(film).z(light)), 4);
  EXPECT_LT(std::abs(slope_of(film, 0).z(by_rho)), 4);
  EXPECT_NEAR(slope_of(film, 0).mean, by_rho, 0.02 * by_rho);
  EXPECT_LT(std::abs(slope_of(film, 1).z(1 / (1 - rho))), 4);
  EXPECT_NEAR(slope_of(film, 2).mean, by_rho * rho, 0.02 * by_rho);
}

TEST(ClosureSurfaces, TransparentSheetTintsShadowsAndViews) {
  const auto lit = [](const Material* through) {
    SceneBuilder builder = plane(matte("Plane", 0.8));
    builder.add_light(sun(1));
    if (through)
      place(builder, quad_mesh(100), builder.add_material(*through), translation({0, 0, 1}));
    const Film film = render_view(builder.build(), settings_of(4, 256));
    EXPECT_TRUE(complete(film));
    return film;
  };
  const Colord tint{0.5, 0.25, 1};
  const Material sheet = ClosureMaterial().add("T", c::Transparent<double>{tint}).build("Sheet");
  const Film bare = lit(nullptr), tinted = lit(&sheet);
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(mean_of(tinted, k).mean / mean_of(bare, k).mean, tint[k] * tint[k], 1e-4);
  // Half of it is black: the rest passes, on the way to the lamp and to the camera.
  const Material half = ClosureMaterial()
                            .add("T", c::Transparent<double>{Colord(1)}, 0.5)
                            .add("D", c::Diffuse<double>{Colord(0), 0}, 0.5)
                            .build("Sheet");
  const Film dimmed = lit(&half);
  EXPECT_NEAR(mean_of(dimmed).mean / mean_of(bare).mean, 0.25, 1e-4);
}

TEST(ClosureSurfaces, TranslucentSheetGlowsFromBehind) {
  SceneBuilder builder =
      plane(ClosureMaterial().add("T", c::Translucent<double>{{0.8, 0.4, 0.2}}).build("Sheet"));
  builder.add_light(sun(1, {0.6, 0, -0.8}));
  const Film film = render_view(builder.build(), settings_of(4, 64));
  ASSERT_TRUE(complete(film));
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(mean_of(film, k).mean, (Colord{0.8, 0.4, 0.2})[k] * 0.8 / kPi<double>, 1e-5);
}

/// A plane under a small square that emits, which no light but itself finds easily.
Scene under_emitter(const Material& emitter) {
  SceneBuilder builder = plane(matte("Plane", 0.8));
  place(builder, quad_mesh(0.05), builder.add_material(emitter), translation({0, 1, 1}));
  return builder.build();
}

TEST(ClosureSurfaces, EmissionIsFoundByLightSampling) {
  const Film want = render_view(under_emitter(emitter("Lamp", 100)), settings_of(4, 256)),
             got = render_view(under_emitter(ClosureMaterial()
                                                 .add("E", c::Emission<double>{Colord(1), 200}, 0.5)
                                                 .build("Lamp")),
                               settings_of(4, 256));
  ASSERT_TRUE(complete(want) && complete(got));
  EXPECT_NEAR(mean_of(got).mean, mean_of(want).mean, 1e-3 * mean_of(want).mean);
  EXPECT_NEAR(mean_of(got).error, mean_of(want).error, 0.05 * mean_of(want).error);
}

TEST(ClosureSurfaces, EmissionThatVariesIsFoundToo) {
  // By the share of its back face: the plane below sees the back of a quad that faces up.
  const auto lamp = [](double strength) {
    return ClosureMaterial()
        .add("E", c::Emission<double>{Colord(1), strength})
        .vary(Op::kGeometry, static_cast<int>(GeometryMode::kBackfacing))
        .build("Lamp");
  };
  const Scene scene = under_emitter(lamp(100));
  const Film want = render_view(under_emitter(emitter("Lamp", 100)), settings_of(4, 256)),
             got = render_view(scene, settings_of(4, 256), ticked(scene, {{"Lamp", "E.strength"}}));
  ASSERT_TRUE(complete(got));
  EXPECT_NEAR(mean_of(got).mean, mean_of(want).mean, 1e-3 * mean_of(want).mean);
  EXPECT_NEAR(slope_of(got, 0).mean, mean_of(want).mean / 100, 1e-3 * mean_of(want).mean / 100);
}

TEST(ClosureSurfaces, LanesLeaveThemAlone) {
  const Material m = ClosureMaterial().add("D", c::Diffuse<double>{}).build("Body");
  EXPECT_EQ(lanes_obstacle(sphere_scene(m)), "material 'Body' is a graph of closures");
}

/// Some of every closure, so that each constant has something to change.
Material everything() {
  const Flavour flavour;
  return ClosureMaterial()
      .add("Diffuse", c::Diffuse<double>{{.6, .4, .3}, .4}, .2, flavour)
      .add("Glossy", c::Glossy<double>{{.5, .6, .7}, .4}, .2)
      .add("Glass", c::Glass<double>{{.8, .7, .6}, .4, 1.45}, .2)
      .add("Refraction", c::Refraction<double>{{.7, .8, .6}, .4, 1.3}, .2)
      .add("Translucent", c::Translucent<double>{{.3, .5, .4}}, .2)
      .add("Transparent", c::Transparent<double>{{.6, .7, .8}}, .15)
      .add("Emission", c::Emission<double>{{.3, .2, .4}, .5}, .4)
      .add("Sheen", c::Sheen<double>{{.7, .8, .5}, .45}, .3)
      .add("Metallic", c::Metallic<double>{{.6, .4, .3}, {.8, .65, .5}, .4}, .2)
      .add("Conductor", c::Conductor<double>{{.6, 1.5, 1}, {3, 2, 1}, .4}, .2)
      .build("Body");
}
/// Closures whose normals turn, not so far that many directions lie between the horizons of normal and
/// surface: what samples find there depends on their densities, as in Cycles.
Material turned() {
  return ClosureMaterial()
      .add("Diffuse", c::Diffuse<double>{{.6, .4, .3}, .4}, .4)
      .turn("Turn", .4, {.7, .4, .8})
      .add("Glossy", c::Glossy<double>{{.5, .6, .7}, .35, .3}, .5)
      .turn("Turn of glossy", .2, {.4, .6, .8})
      .build("Body");
}
/// Closures with films, as Blender 5 has them.
Material filmed() {
  const ThinFilm<double> film{350, 1.4};
  return ClosureMaterial()
      .add("Glass", c::Glass<double>{{.8, .7, .6}, .4, 1.45, film}, .4)
      .add("Metallic", c::Metallic<double>{{.6, .4, .3}, {.8, .65, .5}, .4, 0, film}, .3)
      .add("Conductor", c::Conductor<double>{{.6, 1.5, 1}, {3, 2, 1}, .4, 0, film}, .3)
      .build("Body");
}
/// The constants of all.
struct ConstantOf {
  Material (*make)();
  std::string name;
};
std::vector<ConstantOf> constants() {
  std::vector<ConstantOf> found;
  for (const auto make : {everything, turned, filmed}) {
    const Material material = make();
    for (const ShaderConstant& constant : material.shader->constants) {
      const std::string name(constant.parameter.name);
      const bool of_film = name.find("thin_film") != std::string::npos;
      if (make == everything
              ? !of_film && !name.ends_with("anisotropy")  // 0 is an end of its range
          : make == turned ? name.starts_with("Turn")
                           : of_film)
        found.push_back({make, name});
    }
  }
  return found;
}

class ClosureGradient : public testing::TestWithParam<int> {};

TEST_P(ClosureGradient, AgreesWithDifferencesOfRenders) {
  const auto [make, name] = constants()[GetParam()];
  const Scene scene = sphere_scene(make());
  const ParameterRef ref = scene.find("Body", name);
  const SlotLayout layout(scene, {ref});
  // Shares of samples move with the values: small steps would find little but their noise.
  const double h = name.ends_with("thickness") ? 6 : 0.06;  // nanometres
  constexpr int kSeeds = 6;
  const auto settings_at = [](int seed) { return settings_of(6, 160, 100 + seed, 4); };
  std::vector<Film> films;
  for (int seed = 0; seed < kSeeds; ++seed) {
    films.push_back(render_view(scene, settings_at(seed), layout));
    ASSERT_TRUE(complete(films.back()));
  }
  for (std::size_t slot = 0; slot < layout.slots.size(); ++slot) {
    Tally gap, size;
    for (int seed = 0; seed < kSeeds; ++seed) {
      const auto grey = [&](double step) {
        std::vector<double> values = scene.get(ref);
        for (std::size_t k = 0; k < values.size(); ++k)
          if (layout.slots[slot].component < 0 ||
              static_cast<int>(k) == layout.slots[slot].component)
            values[k] += step;
        std::vector<double> numbers;
        for (const Colorf& p : render_view(scene.with({{ref, values}}), settings_at(seed)).mean)
          numbers.push_back((double(p.r) + p.g + p.b) / 3);
        return numbers;
      };
      const auto up = grey(h), down = grey(-h), higher = grey(2 * h), lower = grey(-2 * h);
      for (std::size_t i = 0; i < up.size(); ++i) {
        const Colorf& d = films[seed].slots[slot].mean[i];
        const double difference =
            (8 * (up[i] - down[i]) - (higher[i] - lower[i])) / (12 * h);  // error h^4
        gap.add((double(d.r) + d.g + d.b) / 3 - difference);
        size.add(std::abs(double(d.r) + d.g + d.b) / 3);
      }
    }
    const Estimate e = gap.estimate();
    RecordProperty("error_per_slope_" + std::to_string(slot),
                   std::to_string(e.error / size.mean()));
    // 216 numbers; 1 false alarm in 16 000 slots. The rest is the rounding of floats and the curve.
    EXPECT_LT(std::abs(e.mean), 4 * e.error + 1e-3 * size.mean())
        << name << ", slot " << slot << ": " << e.mean << " +- " << e.error << ", slopes are about "
        << size.mean();
    EXPECT_LT(e.error, 0.3 * size.mean()) << name << ", slot " << slot;
  }
}
INSTANTIATE_TEST_SUITE_P(Constants, ClosureGradient,
                         testing::Range(0, static_cast<int>(constants().size())),
                         [](const auto& info) {
                           std::string name = constants()[info.param].name;
                           std::replace_if(
                               name.begin(), name.end(),
                               [](char x) { return x == '.' || x == ' '; }, '_');
                           return name;
                         });

}  // namespace
}  // namespace selenite
