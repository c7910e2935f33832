// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "math/error.h"
#include "render/picture_statistics.h"
#include "scene/small_scenes.h"

// Slots: a derivative must not depend on what else is ticked, in whichever kernel it is rendered.
namespace selenite {
namespace {

/// Diffuse only: ticking parameters changes no probability, so that paths are the same paths.
Scene diffuse_scene() {
  SceneBuilder builder;
  const Material ball = matte("Ball", 0.5);
  place(builder, sphere_mesh(1, 8), builder.add_material(ball));
  place(builder, quad_mesh(3), builder.add_material(matte("Ground", 0.7)), translation({0, 0, -1}));
  Light lamp;
  lamp.name = "Lamp";
  lamp.kind = LightKind::kSun;
  lamp.values.power = 2;
  lamp.to_world = looking_at({1, -2, 3}, {0, 0, 0});
  builder.add_light(lamp);
  add_view(builder, {0, -4, 1.5}, {0, 0, 0}, 45);
  set_sky(builder, 0.3);
  builder.appearance.world.values.color = {0.6, 0.8, 1};
  return builder.build();
}

Scene layered_scene() {
  SceneBuilder builder;
  Material m = plastic("Ball");
  m.values.base_color = {0.6, 0.4, 0.3};
  m.values.metallic = 0.3;
  m.values.transmission = 0.4;
  m.values.coat_weight = 0.3;
  m.values.coat_roughness = 0.3;
  m.values.specular_tint = {0.8, 0.6, 0.5};
  m.values.emission_strength = 0.2;
  place(builder, sphere_mesh(1, 8), builder.add_material(m));
  add_view(builder, {0, -4, 1.5}, {0, 0, 0}, 55);
  set_sky(builder, 0.5);
  return builder.build();
}

/// A ground under one lamp at two places.
Scene two_places() {
  SceneBuilder builder;
  place(builder, quad_mesh(3), builder.add_material(matte("Ground", 0.7)));
  for (const double x : {-1.5, 1.0}) {
    Light lamp;
    lamp.name = "Lamp";
    lamp.values.power = 40;
    lamp.values.color = {0.5, 1, 2};
    lamp.to_world = translation({x, 0, 1.5});
    builder.add_light(lamp);
  }
  add_view(builder, {0, -2, 5}, {0, 0, 0}, 60);
  return builder.build();
}

TEST(Layout, TheDerivativeOfALampIsThatOfAllItsPlaces) {
  // The picture is linear in power and colour, so that it is its own derivative times either.
  for (const int lanes : {0, 1}) {
    const Scene scene = two_places();
    RenderSettings settings = settings_of(8, 16);
    settings.lanes = lanes;
    const Film film =
        render_view(scene, settings, ticked(scene, {{"Lamp", "power"}, {"Lamp", "color"}}));
    ASSERT_EQ(film.slots.size(), 2u);
    for (std::size_t p = 0; p < film.size(); ++p) {
      const Colorf& mean = film.mean[p];
      ASSERT_GT(mean.g, 0);
      EXPECT_NEAR(film.slots[0].mean[p].g * 40, mean.g, 1e-4 * mean.g);
      EXPECT_NEAR(film.slots[1].mean[p].r * 0.5, mean.r, 1e-4 * mean.r);
      EXPECT_NEAR(film.slots[1].mean[p].b * 2, mean.b, 1e-4 * mean.b);
    }
  }
}

TEST(Layout, ALampAtTwoPlacesChangesAtBoth) {
  const Scene scene = two_places();
  const ParameterRef power = scene.find("Lamp", "power");
  const Film film = render_view(scene, settings_of(8, 16), {});
  const Film doubled = render_view(scene.with({{power, {80}}}), settings_of(8, 16), {});
  for (std::size_t p = 0; p < film.size(); ++p)
    EXPECT_NEAR(doubled.mean[p].g, 2 * film.mean[p].g, 1e-4 * film.mean[p].g);
}

TEST(Layout, ColoursTakeOneSlotIfDiagonalElseThree) {
  const Scene scene = layered_scene();
  const SlotLayout layout =
      ticked(scene, {{"Ball", "base_color"}, {"Ball", "specular_tint"}, {"Ball", "roughness"}});
  ASSERT_EQ(layout.slots.size(), 5u);
  ASSERT_EQ(layout.rows.size(), 7u);
  for (int c = 0; c < 3; ++c) {
    EXPECT_EQ(layout.rows[c].slot, 0);
    EXPECT_EQ(layout.rows[c].channel, c);
    EXPECT_EQ(layout.rows[3 + c].slot, 1 + c);
    EXPECT_EQ(layout.rows[3 + c].channel, -1);
    EXPECT_EQ(layout.rows[3 + c].component, c);
  }
  EXPECT_EQ(layout.rows[6].slot, 4);
}

TEST(Layout, SlotsOfOneOwnerFollowEachOtherWhateverTheOrder) {
  const Scene scene = diffuse_scene();
  const std::vector<std::pair<std::string, std::string>> mixed{
      {"Ball", "base_color"},        {"Lamp", "power"},
      {"Ground", "base_color"},      {"World", "color"},
      {"Ball", "emission_strength"}, {"Lamp", "color"},
      {"World", "strength"}};
  const SlotLayout layout = ticked(scene, mixed);
  const std::vector<int> first_slot{0, 2, 4, 5, 1, 3, 6};
  std::size_t row = 0;
  for (std::size_t i = 0; i < mixed.size(); ++i) {
    EXPECT_EQ(layout.rows[row].slot, first_slot[i]);
    EXPECT_TRUE(layout.slots[static_cast<std::size_t>(first_slot[i])].parameter ==
                layout.parameters[i]);
    row += mixed[i].second.find("color") != std::string::npos ? 3 : 1;
  }
  EXPECT_EQ(row, layout.rows.size());
  const Film together = render_view(scene, settings_of(8, 4), layout);
  for (std::size_t i = 0; i < mixed.size(); ++i) {
    if (mixed[i].second == "emission_strength") continue;  // ticking it alone changes the paths
    SlotLayout alone = ticked(scene, {mixed[i], mixed[4]});
    const Film film = render_view(scene, settings_of(8, 4), alone);
    for (std::size_t p = 0; p < film.size(); ++p) {
      const float want = film.slots[static_cast<std::size_t>(alone.rows[0].slot)].mean[p].g;
      ASSERT_NEAR(together.slots[static_cast<std::size_t>(first_slot[i])].mean[p].g, want,
                  1e-4 * (std::abs(want) + 0.01));
    }
  }
}

TEST(Layout, RefusesWhatItCannotDo) {
  const Scene scene = layered_scene();
  EXPECT_THROW(ticked(scene, {{"Ball", "roughness"}, {"Ball", "roughness"}}), InvalidArgument);
  EXPECT_THROW(ticked(scene, {{"Ball", "shininess"}}), UnknownName);
  EXPECT_THROW(ticked(scene, {{"Ghost", "roughness"}}), UnknownName);
  std::vector<std::pair<std::string, std::string>> all;
  for (const Parameter& p : parameter_table(OwnerKind::kMaterial))
    all.emplace_back("Ball", std::string(p.name));
  const SlotLayout too_many = ticked(scene, all);
  ASSERT_GT(too_many.slots.size(), 16u);
  EXPECT_THROW(render_view(scene, settings_of(4, 1), too_many), InvalidArgument);
}

TEST(Layout, OwnersDoNotDisturbEachOther) {
  const Scene scene = diffuse_scene();
  const std::vector<std::pair<std::string, std::string>> names = {
      {"Ball", "base_color"}, {"Ground", "base_color"}, {"Lamp", "power"},
      {"Lamp", "color"},      {"World", "color"},       {"World", "strength"}};
  const RenderSettings settings = settings_of(12, 16, 4, 3);
  const Film together = render_view(scene, settings, ticked(scene, names));
  const Film plain = render_view(scene, settings);
  for (std::size_t s = 0; s < names.size(); ++s) {
    const Film alone = render_view(scene, settings, ticked(scene, {names[s]}));
    double size = 0;
    for (std::size_t i = 0; i < alone.size(); ++i)
      for (int c = 0; c < 3; ++c) {
        const float want = alone.slots[0].mean[i][c];
        ASSERT_NEAR(together.slots[s].mean[i][c], want, 1e-5 * (std::abs(want) + 0.01));
        ASSERT_NEAR(together.mean[i][c], plain.mean[i][c], 1e-5);
        size += std::abs(want);
      }
    EXPECT_GT(size, 0.1) << names[s].second;
  }
}

TEST(Layout, WidthsOfTheKernelGiveTheSameNumbers) {
  // The same parameter in the kernels of 4, 8 and 16 local slots. Parameters that keep the lobes'
  // probabilities as they are do not change a path; the sphere here has one lobe.
  SceneBuilder builder;
  place(builder, sphere_mesh(1, 8), builder.add_material(mirror("Ball", 0.6, 0.5)));
  add_view(builder, {0, -4, 1.5}, {0, 0, 0}, 55);
  set_sky(builder, 0.5);
  const Scene scene = builder.build();
  std::vector<std::pair<std::string, std::string>> names = {{"Ball", "roughness"},
                                                            {"Ball", "base_color"}};
  const RenderSettings settings = settings_of(12, 16, 4, 3);
  const Film narrow = render_view(scene, settings, ticked(scene, names));
  for (const auto& more : {std::vector<std::string>{"specular_tint"},
                           {"emission_color", "ior", "specular_level", "coat_tint", "coat_ior"}}) {
    for (const std::string& name : more) names.emplace_back("Ball", name);
    const SlotLayout layout = ticked(scene, names);
    EXPECT_GT(layout.slots.size(), narrow.slots.size() + 2);
    const Film wide = render_view(scene, settings, layout);
    for (std::size_t i = 0; i < wide.size(); ++i)
      for (int s = 0; s < 2; ++s)
        ASSERT_NEAR(wide.slots[s].mean[i].g, narrow.slots[s].mean[i].g,
                    1e-5 * (1 + std::abs(narrow.slots[s].mean[i].g)));
  }
}

TEST(Layout, WideLayoutsAgreeWithNarrowOnesInTheMean) {
  // Ticking a parameter gives its lobe more samples: other paths, the same mean. 16 local slots.
  const Scene scene = layered_scene();
  std::vector<std::pair<std::string, std::string>> names;
  int slots = 0;
  for (std::size_t i = 0; i < parameter_table(OwnerKind::kMaterial).size(); ++i) {
    const Parameter& p = parameter_table(OwnerKind::kMaterial)[i];
    const int width = p.diagonal ? 1 : parameter_widths(OwnerKind::kMaterial)[i];
    if (slots + width > 16) continue;
    slots += width;
    names.emplace_back("Ball", std::string(p.name));
  }
  const SlotLayout all = ticked(scene, names);
  ASSERT_GE(all.slots.size(), 12u);
  const Film wide = render_view(scene, settings_of(8, 1500, 1), all);
  const Film plain = render_view(scene, settings_of(8, 1500, 2));
  ASSERT_TRUE(complete(wide));
  for (int c = 0; c < 3; ++c) EXPECT_LT(std::abs(mean_of(wide, c).z(mean_of(plain, c))), 4);
  int row = 0;
  for (const auto& name : names) {
    const SlotLayout one = ticked(scene, {name});
    const Film narrow = render_view(scene, settings_of(8, 400, 3), one);
    for (std::size_t s = 0; s < one.slots.size(); ++s, ++row) {
      const Estimate a = slope_of(wide, row, 1), b = slope_of(narrow, static_cast<int>(s), 1);
      if (a.error == 0 && b.error == 0) {
        EXPECT_NEAR(a.mean, b.mean, 1e-6) << name.second;
        continue;
      }
      EXPECT_LT(std::abs(a.z(b)), 4) << name.second;
    }
  }
}

TEST(Layout, ADiagonalColourMovesItsOwnChannelOnly) {
  // What one slot for three components rests on. Non-diagonal colours must move the others.
  const Scene scene = layered_scene();
  const auto& rows = parameter_table(OwnerKind::kMaterial);
  int diagonal = 0;
  for (std::size_t f = 0; f < rows.size(); ++f) {
    if (parameter_widths(OwnerKind::kMaterial)[f] != 3) continue;
    const ParameterRef ref{OwnerKind::kMaterial, 0, static_cast<int>(f)};
    std::vector<double> values = scene.get(ref);
    values[0] = 0.25;
    const Film before = render_view(scene, settings_of(8, 1500, 5));
    const Film after = render_view(scene.with({{ref, values}}), settings_of(8, 1500, 6));
    if (rows[f].name == "base_color" || rows[f].name == "emission_color") {
      EXPECT_GT(std::abs(mean_of(before, 0).z(mean_of(after, 0))), 4) << rows[f].name;
    }
    if (!rows[f].diagonal) continue;
    ++diagonal;
    for (const int c : {1, 2})
      EXPECT_LT(std::abs(mean_of(before, c).z(mean_of(after, c))), 4) << rows[f].name;
  }
  EXPECT_GE(diagonal, 3);
}

}  // namespace
}  // namespace selenite
