// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/starts/alignment_start.h"

#include <gtest/gtest.h>

#include <map>

#include "fit/run/fit.h"
#include "fit/taken_photos.h"
#include "scene/small_scenes.h"

namespace selenite {
namespace {

constexpr int kSize = 80;
constexpr double kShift = 2.0 / kSize;  ///< of the pictures, which are square
constexpr double kNear = 0.25 / kSize;

/// A ball on a ground, seen by two cameras; the first one is `shift` of its picture's width beside where
/// it is said to be.
Scene two_views(double grey, double shift) {
  SceneBuilder builder;
  place(builder, quad_mesh(20), builder.add_material(matte("Floor", 0.3)));
  place(builder, sphere_mesh(0.8), builder.add_material(matte("Ball", grey)),
        translation({0, 0, 0.8}));
  add_view(builder, {0, -5, 2.5}, {0, 0, 0.6});
  add_view(builder, {4, -3, 2.5}, {0, 0, 0.6});
  builder.cameras.front().shift_x = shift;
  set_sky(builder, 1);
  return builder.build();
}

std::vector<Photo> shifted_photos(bool align) {
  std::vector<Photo> photos = taken_photos(two_views(0.7, kShift), kSize, 256);
  photos.front().align = align;
  return photos;
}

FitSettings searching() {
  FitSettings settings;
  settings.threads = 1;
  settings.iterations = 1;
  settings.search = "auto";
  return settings;
}

const std::vector<UnknownParameter> kUnknowns{{"Ball", "base_color", {0.2, 0.2, 0.2}, 0, 1, 0.03}};

/// Shifts of the cameras in the last small picture of each, as a multi-start makes them at its end.
std::map<std::string, double> searched_shifts(bool align) {
  std::map<std::string, double> shifts;
  FitSettings settings = searching();
  settings.renderer = [&](const Scene& scene, const Camera& camera, const SlotLayout& layout,
                          const RenderSettings& how, Progress* progress) {
    if (how.width == MultiStartOptions{}.size) shifts[camera.name] = camera.shift_x;
    return render(scene, camera, layout, how, progress);
  };
  Fit fit(two_views(0.2, 0), shifted_photos(align), kUnknowns, settings);
  while (fit.step()) {
  }
  return shifts;
}

TEST(AlignmentStart, ASearchIsMadeAgainWithTheShiftedCamera) {
  std::map<std::string, double> shifts = searched_shifts(true);
  ASSERT_EQ(shifts.size(), 2u);
  EXPECT_NEAR(shifts["Camera 0"], kShift, kNear);
  EXPECT_EQ(shifts["Camera 1"], 0);  // is not to be aligned
}

TEST(AlignmentStart, CamerasStayWhereNoPhotoIsAligned) {
  for (const auto& [name, shift] : searched_shifts(false)) EXPECT_EQ(shift, 0) << name;
}

}  // namespace
}  // namespace selenite
