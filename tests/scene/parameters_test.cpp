// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <set>

#include "math/error.h"
#include "scene/small_scenes.h"

// The one description of each parameter, and scenes with other values.
namespace selenite {
namespace {

Scene small_scene() {
  SceneBuilder builder;
  place(builder, quad_mesh(1), builder.add_material(plastic("Clay")));
  builder.add_material(plastic("Other"));
  Light light;
  light.name = "Key";
  builder.add_light(light);
  add_view(builder, {0, 0, 3}, {0, 0, 0});
  return builder.build();
}

TEST(Lamps, LightsOfOneNameAreOneLamp) {
  SceneBuilder builder;
  place(builder, quad_mesh(1), builder.add_material(plastic("Clay")));
  Light first, other;
  first.name = "Key";
  other.name = "Fill";
  builder.add_light(other);
  builder.add_light(first);
  builder.add_light(first);
  Light second = first;
  second.values.power = first.values.power + 1;
  EXPECT_THROW(builder.add_light(second), InvalidArgument);
  second = first;
  second.kind = LightKind::kSun;
  EXPECT_THROW(builder.add_light(second), InvalidArgument);
  const Scene scene = builder.build();
  ASSERT_EQ(scene.appearance.lights.size(), 3u);
  const ParameterRef ref = scene.find("Key", "power");
  EXPECT_EQ(scene.owner_name(ref), "Key");
  const Scene changed = scene.with({{ref, {3}}});
  EXPECT_EQ(changed.get(ref), std::vector<double>{3});
  EXPECT_EQ(changed.get(scene.find("Fill", "power")), scene.get(scene.find("Fill", "power")));
  for (int i : {1, 2}) EXPECT_EQ(changed.appearance.lights[i].values.power, 3);
}

class Table : public testing::TestWithParam<std::pair<OwnerKind, const char*>> {};

TEST_P(Table, RowsAreCompleteAndConsistent) {
  const auto [kind, owner] = GetParam();
  const Scene scene = small_scene();
  const auto& rows = parameter_table(kind);
  ASSERT_EQ(rows.size(), parameter_widths(kind).size());
  ASSERT_FALSE(rows.empty());
  std::set<std::string_view> names;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Parameter& p = rows[i];
    EXPECT_TRUE(names.insert(p.name).second) << p.name << " twice";
    EXPECT_FALSE(p.help.empty()) << p.name;
    EXPECT_FALSE(p.unit.empty()) << p.name;
    EXPECT_LT(p.lower, p.upper) << p.name;
    EXPECT_GE(p.fit_lower, p.lower) << p.name;
    EXPECT_LE(p.fit_upper, p.upper) << p.name;
    EXPECT_LT(p.fit_lower, p.fit_upper) << p.name;
    EXPECT_GE(p.initial, p.lower) << p.name;
    EXPECT_LE(p.initial, p.upper) << p.name;
    const int width = parameter_widths(kind)[i];
    EXPECT_TRUE(width == 1 || width == 3) << p.name;
    if (p.scale == Scale::kLog) {
      EXPECT_GT(p.fit_lower, 0) << p.name;
    }
    if (p.scale == Scale::kLogExcess) {
      EXPECT_GE(p.fit_lower, 1) << p.name;
    }
    const ParameterRef ref = scene.find(owner, p.name);
    EXPECT_EQ(ref.kind, kind);
    EXPECT_EQ(ref.field, static_cast<int>(i));
    EXPECT_EQ(&scene.description(ref), &p);
    EXPECT_EQ(static_cast<int>(scene.get(ref).size()), width);
  }
}

TEST_P(Table, ValuesWrittenAreReadBackAndNothingElseChanges) {
  const auto [kind, owner] = GetParam();
  Scene scene = small_scene();
  // Only an image can be rotated.
  scene.appearance.world.map =
      std::make_shared<EnvironmentMap>(8, 4, std::vector<Colorf>(32, Colorf(1)));
  const auto& rows = parameter_table(kind);
  for (const Parameter& p : rows) {
    const ParameterRef ref = scene.find(owner, p.name);
    std::vector<double> values = scene.get(ref);
    for (std::size_t c = 0; c < values.size(); ++c)
      values[c] = p.fit_lower + (p.fit_upper - p.fit_lower) * (0.2 + 0.1 * static_cast<double>(c));
    const Scene changed = scene.with({{ref, values}});
    EXPECT_EQ(changed.get(ref), values) << p.name;
    EXPECT_EQ(changed.geometry, scene.geometry);  // shared, not copied
    EXPECT_NE(scene.get(ref), values) << p.name;  // the first scene stays as it was
    for (const Parameter& other : rows) {
      const ParameterRef elsewhere = scene.find(owner, other.name);
      if (!(elsewhere == ref)) {
        EXPECT_EQ(changed.get(elsewhere), scene.get(elsewhere));
      }
    }
    for (const double end : {p.lower, p.upper})
      EXPECT_NO_THROW(scene.with({{ref, std::vector<double>(values.size(), end)}})) << p.name;
  }
}

TEST_P(Table, ValuesOutOfRangeAreRefusedByOwnerNameAndRange) {
  const auto [kind, owner] = GetParam();
  const Scene scene = small_scene();
  for (const Parameter& p : parameter_table(kind)) {
    const ParameterRef ref = scene.find(owner, p.name);
    const std::size_t width = scene.get(ref).size();
    for (const double bad :
         {p.lower - 0.5, p.upper * 1.5 + 1, std::numeric_limits<double>::quiet_NaN(),
          std::numeric_limits<double>::infinity()}) {
      std::vector<double> values(width, p.initial);
      values.back() = bad;
      try {
        scene.with({{ref, values}});
        FAIL() << p.name << " = " << bad << " was accepted";
      } catch (const InvalidArgument& error) {
        EXPECT_NE(std::string(error.what()).find(std::string(owner) + ":" + std::string(p.name)),
                  std::string::npos)
            << error.what();
      }
    }
    EXPECT_THROW(scene.with({{ref, std::vector<double>(width + 1, p.initial)}}), InvalidArgument);
  }
}
INSTANTIATE_TEST_SUITE_P(Owners, Table,
                         testing::Values(std::pair{OwnerKind::kMaterial, "Clay"},
                                         std::pair{OwnerKind::kMaterial, "Other"},
                                         std::pair{OwnerKind::kLight, "Key"},
                                         std::pair{OwnerKind::kWorld, "World"}));

TEST(SceneNames, UnknownOnesAreAnsweredWithThoseThatExist) {
  const Scene scene = small_scene();
  const auto message = [](auto&& action) -> std::string {
    try {
      action();
    } catch (const UnknownName& error) {
      return error.what();
    }
    return {};
  };
  const std::string owner = message([&] { scene.find("Cley", "roughness"); });
  EXPECT_NE(owner.find("'Clay'"), std::string::npos) << owner;
  EXPECT_NE(owner.find("'Key'"), std::string::npos) << owner;
  const std::string parameter = message([&] { scene.find("Clay", "gloss"); });
  EXPECT_NE(parameter.find("'roughness'"), std::string::npos) << parameter;
  const std::string camera = message([&] { scene.camera("Front"); });
  EXPECT_NE(camera.find("'Camera 0'"), std::string::npos) << camera;
  EXPECT_EQ(scene.camera("Camera 0").name, "Camera 0");
}

TEST(SceneNames, CodeRefersToAParameterByItsMember) {
  const Scene scene = small_scene();
  EXPECT_EQ(material_field(&MaterialValues::alpha), scene.find("Clay", "alpha").field);
  EXPECT_EQ(material_field(&MaterialValues::base_color), scene.find("Clay", "base_color").field);
  EXPECT_EQ(material_field(&MaterialValues::albedo), scene.find("Clay", "albedo").field);
  EXPECT_EQ(field_index<LightParameters>(&LightParameters::color),
            scene.find("Key", "color").field);
}

TEST(SceneNames, ANewMaterialHasTheDefaultsOfTheTable) {
  const Scene scene = small_scene();
  for (const Parameter& p : parameter_table(OwnerKind::kMaterial))
    for (const double value : scene.get(scene.find("Clay", p.name)))
      EXPECT_NEAR(value, p.initial, 1e-6) << p.name;
}

}  // namespace
}  // namespace selenite
