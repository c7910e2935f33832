// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "fit/evaluate/photo_evaluator.h"
#include "fit/inference/photo_jacobian.h"
#include "fit/run/fit.h"
#include "fit/taken_photos.h"
#include "math/error.h"
#include "scene/small_scenes.h"

namespace selenite {
namespace {

constexpr int kSize = 12;
constexpr double kKeyPower = 60, kFillPower = 25;

Light area_lamp(const char* name, const Vec3d& from, double power, double size = 1) {
  Light lamp;
  lamp.name = name;
  lamp.kind = LightKind::kArea;
  lamp.size_x = lamp.size_y = size;
  lamp.values.power = power;
  lamp.to_world = looking_at(from, {0, 0, 0});
  return lamp;
}

/// A glossy sphere on a matte floor under two lamps, which mirror and diffuse paths meet, and a dark
/// sky.
Scene stage(bool with_fill = true) {
  SceneBuilder builder;
  place(builder, quad_mesh(20), builder.add_material(matte("Floor", 0.5)));
  place(builder, sphere_mesh(0.8), builder.add_material(mirror("Ball", 0.7, 0.3)),
        translation({0, 0, 0.9}));
  builder.add_light(area_lamp("Key", {3, -2, 4}, kKeyPower));
  if (with_fill) builder.add_light(area_lamp("Fill", {-3, -3, 2}, kFillPower, 2));
  add_view(builder, {0, -6, 3}, {0, 0, 0.5});
  set_sky(builder, 0.05);
  return builder.build();
}

FitSettings settings_for(int iterations = 20) {
  FitSettings settings;
  settings.threads = 1;
  settings.iterations = iterations;
  settings.spp = 16;
  return settings;
}

/// One photo of the camera for each list of lamps that were off.
std::vector<Photo> photos_without(const std::vector<std::vector<std::string>>& lamps,
                                  int spp = 1024) {
  std::vector<Photo> photos;
  for (const std::vector<std::string>& off : lamps) {
    Photo photo = photo_of_size("Camera 0", kSize, kSize);
    photo.id = "Photo " + std::to_string(photos.size());
    photo.lamps_off = off;
    const Scene scene = photo.appearance(stage());
    photo.reference =
        render(scene, scene.cameras[0], {}, square_settings(kSize, spp, 99 + photos.size())).mean;
    photos.push_back(std::move(photo));
  }
  check_photos(stage(), photos);
  return photos;
}

UnknownParameter power_of(const char* lamp) { return {lamp, "power", {40}, 0.1, 1000, 1}; }

TEST(LightState, PhotosOfOneCameraGiveThePowerOfEachLamp) {
  FitSettings settings = settings_for();
  settings.refinement_spp = 512;
  Fit fit(stage(), photos_without({{"Fill"}, {"Key"}}), {power_of("Key"), power_of("Fill")},
          settings);
  while (fit.step()) {
  }
  ASSERT_TRUE(fit.result().message.empty()) << fit.result().message;
  const Vector& found = fit.result().best;
  // 144 pixels of 1024 samples a photo: a percent at most.
  EXPECT_NEAR(found[0], kKeyPower, 0.03 * kKeyPower);
  EXPECT_NEAR(found[1], kFillPower, 0.03 * kFillPower);
}

/// The last lamp of a scene, so that all others have the random numbers that they have without it.
TEST(LightState, ALampThatWasOffIsAsIfItWereNotThere) {
  Photo photo = photo_of_size("Camera 0", kSize, kSize);
  photo.lamps_off = {"Fill"};
  for (const int lanes : {1, 0}) {
    RenderSettings settings = square_settings(kSize, 64, 5);
    settings.lanes = lanes;
    const Scene with = stage(), off = photo.appearance(stage()), without = stage(false);
    const auto picture = [&](const Scene& scene) {
      return render(scene, scene.cameras[0], {}, settings).mean;
    };
    EXPECT_EQ(picture(off), picture(without)) << lanes;
    EXPECT_NE(picture(off), picture(with)) << lanes;
  }
}

TEST(LightState, ALampThatWasOffHasTheDerivativeZero) {
  UnknownParameter colour{"Fill", "color", {0.5, 0.5, 0.5}, 0.001, 1, 0.03};
  const FitProblem problem(stage(), photos_without({{"Fill"}, {}}, 4),
                           {power_of("Fill"), colour, power_of("Key")}, settings_for());
  RenderCounts counts;
  PhotoEvaluator evaluator(scene_model(problem), problem.settings(), counts);
  const auto film = [&](std::size_t photo) {
    return evaluator.evaluate(problem.start(), problem.photos()[photo], {16, 7, Differences{}});
  };
  const Film off = film(0), on = film(1);
  const auto slot_of = [&](std::size_t component) {
    return static_cast<std::size_t>(problem.scalars().layout.rows[component].slot);
  };
  const Picture black(kSize * kSize);
  for (const std::size_t component : {0, 1}) {
    EXPECT_EQ(off.slots[slot_of(component)].mean, black);
    EXPECT_EQ(off.slots[slot_of(component)].half_a, black);
    EXPECT_NE(on.slots[slot_of(component)].mean, black);
  }
  EXPECT_NE(off.slots[slot_of(4)].mean, black) << "the lamp that was on";
  const Halves halves = split_halves(problem.scalars(), {0, off, {}}, Vector::Ones(5));
  EXPECT_TRUE(halves.differentiated.all()) << "it is known that there is none";
}

TEST(LightState, IsSeenByThePhotoJacobian) {
  const Scene scene = stage();
  const Unknowns unknowns(scene, {power_of("Fill"), power_of("Key")});
  Photo photo = of_camera("Camera 0");
  photo.lamps_off = {"Fill"};
  const PhotoJacobian seen = photo_jacobian(scene, unknowns, photo, square_settings(kSize, 16, 3));
  for (const PhotoJacobian::Portion& portion : seen.portions) {
    EXPECT_TRUE((portion.halves.jacobian_a.col(0).array() == 0).all());
    EXPECT_FALSE((portion.halves.jacobian_a.col(1).array() == 0).all());
  }
}

TEST(LightState, UnknownLampsAreNamedAllAtOnce) {
  std::vector<Photo> photos = photos_without({{}, {}}, 1);
  photos[0].lamps_off = {"Fill", "Rim", "Kicker"};
  photos[1].lamps_off = {"Floor"};
  try {
    check_photos(stage(), photos);
    FAIL() << "accepted";
  } catch (const UnknownName& error) {
    EXPECT_EQ(std::string(error.what()),
              "Photo 'Photo 0': its lamp 'Rim', which was off, is not in the scene; lamps: 'Key', "
              "'Fill'\n"
              "Photo 'Photo 0': its lamp 'Kicker', which was off, is not in the scene; lamps: "
              "'Key', 'Fill'\n"
              "Photo 'Photo 1': its lamp 'Floor', which was off, is not in the scene; lamps: "
              "'Key', 'Fill'");
  }
}

TEST(LightState, IsInTheFingerprintAndGoesWithASmallerPhoto) {
  const Photo photo = photos_without({{"Fill"}}, 1)[0];
  Photo other = photo, neither = photo;
  other.lamps_off = {"Key"};
  neither.lamps_off = {};
  EXPECT_NE(photo.fingerprint(), other.fingerprint());
  EXPECT_NE(photo.fingerprint(), neither.fingerprint());
  EXPECT_EQ(photo.resized(4).lamps_off, photo.lamps_off);
}

}  // namespace
}  // namespace selenite
