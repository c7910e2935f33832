// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/lanes/lanes.h"

#include <gtest/gtest.h>

#include "math/error.h"
#include "render/media_scenes.h"
#include "render/picture_statistics.h"

// Eight paths in lockstep against the same paths one by one: the same random numbers, so the same
// picture and derivatives but for rounding, which now and then sends a path elsewhere.
namespace selenite {
namespace {

using Ticks = std::vector<std::pair<std::string, std::string>>;

struct Case {
  std::string name;
  Scene scene;
  Ticks ticks;
  double moved;  ///< at most so many of the pixels hold a path that went elsewhere
  int depth = 0;
};

Light lamp_of(LightKind kind, const std::string& name, const Vec3d& at, double power) {
  Light lamp;
  lamp.name = name;
  lamp.kind = kind;
  lamp.values.power = power;
  lamp.values.color = {0.9, 0.8, 0.7};
  lamp.to_world = looking_at(at, {0, 0, 0});
  return lamp;
}

/// A ball over a ground and in front of a mirror, under some lamps and a sky.
Scene scene_of(const Material& material, const std::vector<Light>& lamps, bool sky_image = false) {
  SceneBuilder builder;
  place(builder, sphere_mesh(1, 12), builder.add_material(material));
  place(builder, quad_mesh(4), builder.add_material(matte("Ground", 0.4)),
        translation({0, 0, -1.1}));
  place(builder, box_mesh(2, 0.1, 1), builder.add_material(mirror("Mirror", 0.7, 0.2)),
        translation({0, 2.5, 0}));
  for (const Light& lamp : lamps) builder.add_light(lamp);
  add_view(builder, {0, -5, 1.5}, {0, 0, 0}, 50);
  set_sky(builder, 0.4);
  if (sky_image) {
    std::vector<Colorf> pixels;
    for (int i = 0; i < 8 * 4; ++i) pixels.emplace_back(0.1f + (i % 5), 0.3f, 0.2f * (i % 3));
    builder.appearance.world.map = std::make_shared<EnvironmentMap>(8, 4, pixels);
  }
  return builder.build();
}

Light area(const std::string& name = "Lamp", const Vec3d& at = {2, -2, 3}) {
  Light lamp = lamp_of(LightKind::kArea, name, at, 80);
  lamp.size_x = 2, lamp.size_y = 1;
  lamp.spread = 2.5;
  return lamp;
}

/// The scene with pictures on the ball: coloured squares, some of them black, by their place.
Scene patterned(Material material, bool vertex_colours = false) {
  Mesh ball = sphere_mesh(1, 12);
  std::vector<Vec2f> uv;
  std::vector<Colorf> colors;
  for (const auto& triangle : ball.triangles)
    for (const auto corner : triangle) {
      const Vec3f p = ball.positions[corner];
      uv.push_back({3 * p.x, 2 * p.z});
      colors.push_back({0.5f + 0.5f * p.x, 0.3f, 0.5f - 0.5f * p.z});
    }
  ball.uvs.push_back({"UVMap", std::move(uv)});
  ball.colors.push_back({"Color", std::move(colors)});
  FieldMap map;
  map.field = material_field(&MaterialValues::base_color);
  if (!vertex_colours) {
    std::vector<Colorf> pixels;
    for (int i = 0; i < 8 * 8; ++i) pixels.emplace_back(0.2f * (i % 5), 0.4f, 0.25f * (i % 4));
    map.texture = std::make_shared<Texture>("Squares", 8, 8, pixels, std::vector<float>{}, true,
                                            Extension::kRepeat, Interpolation::kLinear);
  }
  material.maps.push_back(map);
  SceneBuilder builder;
  place(builder, ball, builder.add_material(material));
  place(builder, quad_mesh(4), builder.add_material(matte("Ground", 0.4)),
        translation({0, 0, -1.1}));
  builder.add_light(area());
  add_view(builder, {0, -5, 1.5}, {0, 0, 0}, 50);
  set_sky(builder, 0.4);
  return builder.build();
}

Material coloured(Material m) {
  m.name = "Body";
  m.values.base_color = {0.8, 0.5, 0.3};
  return m;
}

std::vector<Case> cases() {
  const Ticks surface{
      {"Body", "base_color"}, {"Body", "roughness"}, {"Body", "transmission"}, {"Body", "ior"}};
  Ticks many = surface;
  for (const char* name : {"metallic", "coat_weight", "coat_roughness", "coat_tint"})
    many.emplace_back("Body", name);
  const Ticks lights{{"Lamp", "power"}, {"Lamp", "color"}, {"World", "strength"}};

  Material half = coloured(glass("Body", 1.45, 0.3));
  half.values.transmission = 0.5;
  Material coat = coloured(plastic("Body"));
  coat.values.metallic = 0.3;
  coat.values.specular_tint = {0.9, 0.6, 0.8};
  coat.values.diffuse_roughness = 0.6;
  coat.values.coat_weight = 0.7;
  coat.values.coat_roughness = 0.2;
  coat.values.coat_tint = {0.7, 0.9, 0.8};
  coat.values.transmission = 0.2;
  Material old = half;
  old.flavour.version = Flavour::Version::kV1;
  old.flavour.distribution = Flavour::Distribution::kGgx;
  old.values.specular_tint = Color<double>(0.3);
  Material wax = coloured(glass("Body", 1.4, 0.25));
  wax.values.base_color = Color<double>(1);
  wax.values.extinction = {2, 3, 6};
  wax.values.albedo = {0.95, 0.8, 0.6};
  wax.values.anisotropy = 0.4;
  Material thin = wax;
  thin.values.extinction = Color<double>(0);

  Light point = lamp_of(LightKind::kPoint, "Lamp", {2, -2, 3}, 300);
  point.radius = 0.3;
  Light spot = lamp_of(LightKind::kSpot, "Spot", {-2, -3, 2}, 300);
  Light sun = lamp_of(LightKind::kSun, "Sun", {-1, -1, 3}, 2);
  sun.angle = 0.1;

  const Ticks medium{{"Body", "extinction"},
                     {"Body", "albedo"},
                     {"Body", "anisotropy"},
                     {"Body", "roughness"},
                     {"Body", "ior"}};
  std::vector<Case> all;
  all.push_back(
      {"matte", scene_of(coloured(matte("Body", 1)), {area()}), {{"Body", "base_color"}}, .01});
  all.push_back({"plastic", scene_of(coloured(plastic("Body")), {area()}), surface, .02});
  all.push_back({"picture", scene_of(coloured(plastic("Body")), {area()}), {}, .02});
  Material lacquer = coloured(plastic("Body"));
  lacquer.values.coat_weight = 0.7;
  lacquer.values.coat_tint = {0.7, 0.9, 0.8};
  const Ticks of_lacquer{{"Body", "roughness"}, {"Body", "coat_weight"}, {"Body", "ior"}};
  all.push_back({"textured", patterned(coloured(plastic("Body"))), {}, .02});
  all.push_back(
      {"textured_beside", patterned(coloured(plastic("Body"))), {{"Ground", "base_color"}}, .02});
  all.push_back({"textured_lacquer", patterned(lacquer), of_lacquer, .1});
  all.push_back({"vertex_colours", patterned(lacquer, true), of_lacquer, .1});
  all.push_back(
      {"smooth_glass", scene_of(coloured(glass("Body")), {area()}), {{"Body", "base_color"}}, .1});
  all.push_back({"rough_glass", scene_of(coloured(glass("Body", 1.5, .3)), {area()}), surface, .1});
  all.push_back({"half", scene_of(half, {area()}), surface, .1});
  all.push_back({"half_depth", scene_of(half, {area()}), surface, .1, 3});
  all.push_back({"coat", scene_of(coat, {area()}), many, .1});
  all.push_back({"blender3", scene_of(old, {area()}), surface, .1});
  all.push_back({"lights", scene_of(half, {area()}), lights, .1});
  all.push_back({"many_lamps", scene_of(half, {point, area("Other"), spot, sun}), lights, .1});
  all.push_back({"sky_image", scene_of(half, {area()}, true), lights, .1});
  all.push_back({"wax", scene_of(wax, {}), medium, .4});
  all.push_back({"wax_picture", scene_of(wax, {}), {}, .4});
  all.push_back({"no_medium_yet", scene_of(thin, {}), medium, .4});
  Case within{"camera_inside", scene_of(wax, {}), medium, .6};
  within.scene.cameras[0].to_world = looking_at({0, -0.5, 0}, {0, 1, 0.3});
  all.push_back(within);
  return all;
}

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class Lanes8 : public testing::TestWithParam<Case> {};

RenderSettings with_lanes(RenderSettings settings, int lanes) {
  settings.lanes = lanes;
  return settings;
}

/// Both are means of the same samples.
void expect_same(const Picture& alone, const Picture& together, double moved) {
  double scale = 0;
  for (const Colorf& c : alone)
    for (int k = 0; k < 3; ++k) scale += std::abs(c[k]) / (3.0 * static_cast<double>(alone.size()));
  long differ = 0;
  for (int k = 0; k < 3; ++k) {
    Tally difference;
    for (std::size_t i = 0; i < alone.size(); ++i) {
      const double d = together[i][k] - alone[i][k];
      difference.add(d);
      differ += std::abs(d) > 1e-3 * (std::abs(alone[i][k]) + scale);
    }
    const Estimate e = difference.estimate();
    // Beyond 4.5 standard errors: less than once in 100,000.
    EXPECT_LE(std::abs(e.mean), 4.5 * e.error + 2e-5 * scale) << "channel " << k;
  }
  EXPECT_LE(differ, moved * 3 * static_cast<double>(alone.size()));
}

TEST_P(Lanes8, RendersTheSamePictureAndDerivatives) {
  if (!has_lanes()) GTEST_SKIP() << "this processor has no AVX2, or this build no lanes";
  const Case& c = GetParam();
  const SlotLayout layout = ticked(c.scene, c.ticks);
  const RenderSettings settings = settings_of(40, 16, 3, c.depth);
  const Film alone = render_view(c.scene, with_lanes(settings, 1), layout);
  const Film together = render_view(c.scene, with_lanes(settings, 8), layout);
  ASSERT_TRUE(complete(alone));
  ASSERT_TRUE(complete(together));
  expect_same(alone.mean, together.mean, c.moved);
  expect_same(alone.half_a, together.half_a, c.moved);
  for (std::size_t s = 0; s < layout.slots.size(); ++s) {
    SCOPED_TRACE("slot " + std::to_string(s));
    expect_same(alone.slots[s].mean, together.slots[s].mean, 2 * c.moved);
  }
}

TEST_P(Lanes8, IsTheSameWhateverTheThreads) {
  if (!has_lanes()) GTEST_SKIP() << "this processor has no AVX2, or this build no lanes";
  const Case& c = GetParam();
  const SlotLayout layout = ticked(c.scene, c.ticks);
  RenderSettings settings = with_lanes(settings_of(40, 3, 3, c.depth), 8);
  const Film one = render_view(c.scene, settings, layout);
  settings.threads = 3;
  const Film three = render_view(c.scene, settings, layout);
  EXPECT_EQ(one.mean, three.mean);
  for (std::size_t s = 0; s < layout.slots.size(); ++s)
    EXPECT_EQ(one.slots[s].mean, three.slots[s].mean);
}

INSTANTIATE_TEST_SUITE_P(Scenes, Lanes8, testing::ValuesIn(cases()),
                         [](const auto& info) { return info.param.name; });

TEST(Lanes8, AreNotTakenForScenesTheyDoNotSuit) {
  if (!has_lanes()) GTEST_SKIP() << "this processor has no AVX2, or this build no lanes";
  Material veil = coloured(plastic("Body"));
  veil.values.alpha = 0.5;
  Material lamp = coloured(plastic("Body"));
  lamp.values.emission_strength = 1;
  Material skin = coloured(plastic("Body"));
  skin.values.subsurface_weight = 0.5;
  Material velvet = coloured(plastic("Body"));
  velvet.values.sheen_weight = 0.5;
  Material alloy = coloured(plastic("Body"));
  alloy.values.metallic = 0.5;
  EXPECT_EQ(lanes_obstacle(patterned(alloy)), "material 'Body' has textures");
  EXPECT_EQ(lanes_obstacle(patterned(coloured(plastic("Body")))), "");
  const Material wax = filled_glass(0.3, 1.4, 2, 0.8);
  const auto obstacle = [](const Material& material, const std::vector<Light>& lamps) {
    const Scene scene = scene_of(material, lamps);
    EXPECT_THROW(render_view(scene, with_lanes(settings_of(4, 1), 8)), InvalidArgument);
    EXPECT_TRUE(complete(render_view(scene, settings_of(4, 1))));
    return lanes_obstacle(scene);
  };
  EXPECT_NE(obstacle(veil, {area()}).find("'Body' lets rays pass"), std::string::npos);
  EXPECT_NE(obstacle(lamp, {area()}).find("'Body' emits"), std::string::npos);
  EXPECT_NE(obstacle(skin, {area()}).find("'Body' scatters"), std::string::npos);
  EXPECT_NE(obstacle(velvet, {area()}).find("'Body' has sheen"), std::string::npos);
  EXPECT_NE(obstacle(wax, {area("Lamp", {0, 0, 0.5})}).find("'Medium'"), std::string::npos);
  EXPECT_EQ(lanes_obstacle(scene_of(wax, {})), "");
  EXPECT_THROW(render_view(scene_of(wax, {}), with_lanes(settings_of(4, 1), 3)), InvalidArgument);
}

}  // namespace
}  // namespace selenite
