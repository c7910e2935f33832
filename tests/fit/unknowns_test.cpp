// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/problem/unknowns.h"

#include <gtest/gtest.h>

#include <limits>

#include "fit/synthetic_renderer.h"

namespace selenite {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(Unknowns, AreInTheOrderOfTheRowsOfTheirSlots) {
  const Scene scene = synthetic_scene();
  const Unknowns unknowns(scene, synthetic_unknowns());
  const SlotLayout layout = unknowns.layout(scene);
  ASSERT_EQ(unknowns.components().size(), layout.rows.size());
  for (std::size_t k = 0; k < layout.rows.size(); ++k) {
    const ParameterRef& ref = layout.slots[static_cast<std::size_t>(layout.rows[k].slot)].parameter;
    const Component& component = unknowns.components()[k];
    EXPECT_EQ(unknowns.parameters()[static_cast<std::size_t>(component.parameter)],
              UnknownRef(ref));
    EXPECT_EQ(component.index, layout.rows[k].component);
  }
  EXPECT_EQ(unknowns.components()[1].name, "Body:base_color[1]");
  EXPECT_EQ(unknowns.components()[3].name, "Body:roughness");
  EXPECT_EQ(unknowns.start(), (Vector{{0.2, 0.2, 0.2, 0.6, 0.3, 1.7}}));
}

TEST(Unknowns, ComeBackFromTheScene) {
  const Scene scene = synthetic_scene();
  const Unknowns unknowns(scene, synthetic_unknowns());
  const Vector x{{0.1, 0.2, 0.3, 0.4, 0.5, 1.6}};
  const Scene changed = unknowns.scene_with(scene, x);
  EXPECT_EQ(changed.get(changed.find("Body", "base_color")), (std::vector<double>{0.1, 0.2, 0.3}));
  EXPECT_EQ(changed.get(changed.find("Body", "ior")), (std::vector<double>{1.6}));
  EXPECT_EQ(scene.get(scene.find("Body", "ior")), (std::vector<double>{1.5})) << "values only";
}

TEST(Unknowns, ProjectIntoTheBox) {
  const Unknowns unknowns(synthetic_scene(), synthetic_unknowns());
  const Vector inside = unknowns.project(Vector{{-1, 2, 0.5, 0, 0.5, 9}});
  EXPECT_EQ(inside, (Vector{{0.001, 0.999, 0.5, 0.02, 0.5, 2.5}}));
}

struct BadInput {
  const char* name;
  UnknownParameter unknown;
  const char* says;  ///< part of the message
};

class BadUnknown : public ::testing::TestWithParam<BadInput> {};
TEST_P(BadUnknown, IsNamedWithItsCure) {
  try {
    Unknowns(synthetic_scene(), {GetParam().unknown});
    FAIL() << "accepted";
  } catch (const std::exception& error) {
    EXPECT_NE(std::string(error.what()).find(GetParam().says), std::string::npos) << error.what();
  }
}
INSTANTIATE_TEST_SUITE_P(
    Table, BadUnknown,
    ::testing::Values(
        BadInput{"owner", {"Bodi", "ior", {1.5}, 1, 2.5, 0.03}, "Body"},
        BadInput{"parameter", {"Body", "iro", {1.5}, 1, 2.5, 0.03}, "ior"},
        BadInput{"nan_start", {"Body", "ior", {kNan}, 1, 2.5, 0.03}, "start = nan"},
        BadInput{"nan_minimum", {"Body", "ior", {1.5}, kNan, 2.5, 0.03}, "minimum = nan"},
        BadInput{"nan_maximum", {"Body", "ior", {1.5}, 1, kNan, 0.03}, "maximum = nan"},
        BadInput{"below_table", {"Body", "roughness", {0.5}, -1, 1, 0.03}, "lies outside [0, 1]"},
        BadInput{"above_table", {"Body", "roughness", {0.5}, 0, 7, 0.03}, "lies outside [0, 1]"},
        BadInput{"start_outside", {"Body", "ior", {1.2}, 1.3, 2.5, 0.03}, "outside its bounds"},
        BadInput{"crossed", {"Body", "ior", {1.5}, 2, 1, 0.03}, "must be below maximum"},
        BadInput{"equal", {"Body", "ior", {1.5}, 1.5, 1.5, 0.03}, "must be below maximum"},
        BadInput{"width", {"Body", "base_color", {0.5}, 0, 1, 0.03}, "it takes 3"},
        BadInput{"no_start", {"Body", "ior", {}, 1, 2, 0.03}, "it takes 1"},
        BadInput{"rate", {"Body", "ior", {1.5}, 1, 2, 0}, "learning_rate = 0"},
        BadInput{"nan_rate", {"Body", "ior", {1.5}, 1, 2, kNan}, "learning_rate = nan"}),
    [](const auto& info) { return info.param.name; });

TEST(Unknowns, ReportAllProblemsAtOnce) {
  try {
    Unknowns(synthetic_scene(), {{"Body", "ior", {1.5}, 2, 1, 0.03},
                                 {"Bodi", "ior", {1.5}, 1, 2, 0.03},
                                 {"Body", "roughness", {kNan}, 0, 1, 0.03},
                                 {"Body", "roughness", {0.5}, 0, 1, 0.03}});
    FAIL() << "accepted";
  } catch (const InvalidArgument& error) {
    const std::string text = error.what();
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 3) << text;
    EXPECT_NE(text.find("listed twice"), std::string::npos) << text;
  }
}

TEST(Unknowns, RefuseAnEmptyList) {
  EXPECT_THROW(Unknowns(synthetic_scene(), {}), InvalidArgument);
}

TEST(Unknowns, NameMistakesAloneAreUnknownNames) {
  EXPECT_THROW(Unknowns(synthetic_scene(), {{"Bodi", "ior", {1.5}, 1, 2, 0.03}}), UnknownName);
}

}  // namespace
}  // namespace selenite
