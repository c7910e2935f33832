// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/evaluate/rendered_pixels.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "fit/run/fit.h"
#include "fit/synthetic_renderer.h"
#include "fit/taken_photos.h"
#include "scene/small_scenes.h"

namespace selenite {
namespace {

/// A photo whose middle counts.
Photo masked(Photo photo, int low, int high) {
  photo.weight.assign(photo.size(), 0.f);
  for (int y = low; y < high; ++y)
    for (int x = low; x < high; ++x)
      photo.weight[static_cast<std::size_t>(y) * photo.width + x] = 1;
  return photo;
}

TEST(RenderedPixels, AreThoseThatCountAndWhatFiltersReach) {
  EXPECT_EQ(rendered_pixels(grey_capture(64)), nullptr);
  const Photo photo = masked(grey_capture(64), 30, 33);
  const auto pixels = rendered_pixels(photo);
  ASSERT_NE(pixels, nullptr);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      const bool near = std::min(x, y) >= 30 - kFilterReach && std::max(x, y) < 33 + kFilterReach;
      EXPECT_EQ((*pixels)[static_cast<std::size_t>(y) * 64 + x] != 0, near) << x << ' ' << y;
    }
  EXPECT_EQ(rendered_count(photo), square(3 + 2 * kFilterReach));
}

/// Renders what it is asked for, or always all.
struct Whole {
  bool whole;
  Film operator()(const Scene& scene, const Camera& camera, const SlotLayout& layout,
                  RenderSettings settings, Progress* progress) const {
    EXPECT_TRUE(settings.pixels) << "all is rendered";
    if (whole) settings.pixels = nullptr;
    return render(scene, camera, layout, settings, progress);
  }
};

// What is left out does not count: a fit ends at the same values, with fewer samples.
TEST(RenderedPixels, LeaveAFitAsItIs) {
  SceneBuilder builder;
  place(builder, quad_mesh(20), builder.add_material(matte("Floor", 0.5)));
  place(builder, sphere_mesh(0.8), builder.add_material(mirror("Ball", 0.7, 0.3)),
        translation({0, 0, 0.9}));
  add_view(builder, {0, -6, 3}, {0, 0, 0.5});
  set_sky(builder, 1);
  const Scene scene = builder.build();
  const std::vector<Photo> photos{masked(taken_photos(scene, 48, 64).front(), 20, 28)};
  FitSettings settings;
  settings.threads = 1;
  settings.iterations = 6;
  const std::vector<UnknownParameter> unknowns{
      {"Ball", "base_color", {0.3, 0.3, 0.3}, 0.01, 0.99, 0.03},
      {"Ball", "roughness", {0.5}, 0.05, 0.99, 0.03}};
  std::vector<FitResult> results;
  for (const bool whole : {true, false}) {
    settings.renderer = Whole{whole};
    Fit fit(scene, photos, unknowns, settings);
    while (fit.step()) {
    }
    EXPECT_EQ(fit.result().message, "");
    results.push_back(fit.result());
  }
  EXPECT_LT((results[0].best - results[1].best).cwiseAbs().maxCoeff(), 1e-5)
      << results[0].best.transpose() << " and " << results[1].best.transpose();
}

}  // namespace
}  // namespace selenite
