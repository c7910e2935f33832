// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "fit/evaluate/photo_evaluator.h"
#include "fit/inference/photo_jacobian.h"
#include "fit/run/fit.h"
#include "fit/taken_photos.h"
#include "math/error.h"
#include "render/lanes/lanes.h"
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

constexpr Vec3d kKeyFrom{3, -2, 4}, kFillFrom{-3, -3, 2};

using Names = std::vector<std::string>;

/// A glossy sphere on a matte floor under lamps, which mirror and diffuse paths meet, and a dark sky.
Scene stage(const Names& lamps = {"Key", "Fill"}, double sky = 0.05,
            const Vec3d& fill_from = kFillFrom) {
  SceneBuilder builder;
  place(builder, quad_mesh(20), builder.add_material(matte("Floor", 0.5)));
  place(builder, sphere_mesh(0.8), builder.add_material(mirror("Ball", 0.7, 0.3)),
        translation({0, 0, 0.9}));
  for (const std::string& lamp : lamps)
    if (lamp == "Key")
      builder.add_light(area_lamp("Key", kKeyFrom, kKeyPower));
    else
      builder.add_light(area_lamp(lamp.c_str(), fill_from, kFillPower, 2));
  add_view(builder, {0, -6, 3}, {0, 0, 0.5});
  set_sky(builder, sky);
  return builder.build();
}

FitSettings settings_for(int iterations = 20) {
  FitSettings settings;
  settings.threads = 1;
  settings.iterations = iterations;
  settings.spp = 16;
  return settings;
}

/// One photo of the camera for each list of lamps that were on.
std::vector<Photo> photos_under(const std::vector<Names>& lamps, int spp = 1024) {
  std::vector<Photo> photos;
  for (const Names& on : lamps) {
    Photo photo = photo_of_size("Camera 0", kSize, kSize);
    photo.id = "Photo " + std::to_string(photos.size());
    photo.lights.lamps = on;
    const Scene scene = photo.lights.applied_to(stage());
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
  Fit fit(stage(), photos_under({{"Key"}, {"Fill"}}), {power_of("Key"), power_of("Fill")},
          settings);
  while (fit.step()) {
  }
  ASSERT_TRUE(fit.result().message.empty()) << fit.result().message;
  const Vector& found = fit.result().best;
  // 144 pixels of 1024 samples a photo: a percent at most.
  EXPECT_NEAR(found[0], kKeyPower, 0.03 * kKeyPower);
  EXPECT_NEAR(found[1], kFillPower, 0.03 * kFillPower);
}

/// The picture with equal seeds, traced one by one (1) or eight at a time (0).
Picture picture_of(const Scene& scene, int lanes) {
  RenderSettings settings = square_settings(kSize, 64, 5);
  settings.lanes = lanes;
  return render(scene, scene.cameras[0], {}, settings).mean;
}

TEST(LightState, ALampThatWasOffIsAsIfItWereNotThere) {
  for (const int lanes : {1, 0}) {
    for (const Names& on : {Names{"Key"}, Names{"Fill"}, Names{}}) {
      const Picture off = picture_of(LightState{on}.applied_to(stage()), lanes);
      EXPECT_EQ(off, picture_of(stage(on), lanes)) << lanes;
      EXPECT_NE(off, picture_of(stage(), lanes)) << lanes;
    }
  }
}

TEST(LightState, AnUnusualLampThatWasOffKeepsNoLanesFromTheOthers) {
  SceneBuilder builder;
  place(builder, quad_mesh(20), builder.add_material(matte("Floor", 0.5)));
  builder.add_light(area_lamp("Key", kKeyFrom, kKeyPower));
  Light shadowless = area_lamp("Fill", kFillFrom, kFillPower);
  shadowless.casts_shadows = false;
  builder.add_light(shadowless);
  add_view(builder, {0, -6, 3}, {0, 0, 0.5});
  const Scene scene = builder.build();
  EXPECT_NE(lanes_obstacle(scene), "");
  EXPECT_EQ(lanes_obstacle(LightState{Names{"Key"}}.applied_to(scene)),
            has_lanes() ? "" : lanes_obstacle(scene));
}

TEST(LightState, AWorldThatWasOffIsBlack) {
  SceneBuilder builder;
  place(builder, quad_mesh(20), builder.add_material(matte("Floor", 0.5)));
  builder.add_light(area_lamp("Key", kKeyFrom, kKeyPower));
  add_view(builder, {0, -6, 3}, {0, 0, 0.5});
  set_sky(builder, 0.4);
  const Scene constant = builder.build();
  builder.appearance.world.map =
      std::make_shared<EnvironmentMap>(4, 2, Picture(8, Colorf(1, 0.5f, 2)));
  const Scene image = builder.build();
  set_sky(builder, 0);
  builder.appearance.world.map = nullptr;
  const Scene black = builder.build();
  LightState state;
  state.world = false;
  for (const int lanes : {1, 0})
    for (const Scene& scene : {constant, image}) {
      EXPECT_EQ(picture_of(state.applied_to(scene), lanes), picture_of(black, lanes)) << lanes;
      EXPECT_NE(picture_of(scene, lanes), picture_of(black, lanes)) << lanes;
    }
}

TEST(LightState, ALampThatWasMovedIsAsIfItStoodThere) {
  const Vec3d elsewhere{1, -4, 3};
  LightState state;
  state.places.push_back({"Fill", looking_at(elsewhere, {0, 0, 0})});
  const Scene still = stage(), moved = state.applied_to(still);
  EXPECT_EQ(moved.geometry, still.geometry) << "nothing is built again";
  for (const int lanes : {1, 0})
    EXPECT_EQ(picture_of(moved, lanes), picture_of(stage({"Key", "Fill"}, 0.05, elsewhere), lanes));
}

TEST(LightState, ALampThatDoesNotRenderStaysOff) {
  Scene scene = stage();
  scene.appearance.lights[0].on = false;
  for (const LightState& state : {LightState{}, LightState{Names{"Key", "Fill"}}}) {
    const Scene applied = state.applied_to(scene);
    EXPECT_FALSE(applied.appearance.lights[0].on);
    EXPECT_TRUE(applied.appearance.lights[1].on);
  }
}

// Of a lamp whose radiance is fixed: it is twice as bright where it has half the area.
TEST(LightState, ALampThatWasMovedMayHaveAnotherRadiance) {
  LightState state;
  state.places.push_back({"Fill", looking_at(kFillFrom, {0, 0, 0}), 2});
  const Scene still = stage(), other = state.applied_to(still);
  EXPECT_EQ(other.appearance.lights[1].radiance_scale, 2);
  EXPECT_EQ(other.appearance.lights[0].radiance_scale, still.appearance.lights[0].radiance_scale);
  EXPECT_NE(picture_of(other, 0), picture_of(still, 0));
}

TEST(LightState, ALampThatWasOffHasTheDerivativeZero) {
  UnknownParameter colour{"Fill", "color", {0.5, 0.5, 0.5}, 0.001, 1, 0.03};
  const FitProblem problem(stage(), photos_under({{"Key"}, {"Key", "Fill"}}, 4),
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
  photo.lights.lamps = Names{"Key"};
  const PhotoJacobian seen = photo_jacobian(scene, unknowns, photo, square_settings(kSize, 16, 3));
  for (const PhotoJacobian::Portion& portion : seen.portions) {
    EXPECT_TRUE((portion.halves.jacobian_a.col(0).array() == 0).all());
    EXPECT_FALSE((portion.halves.jacobian_a.col(1).array() == 0).all());
  }
}

TEST(LightState, AWorldThatWasOffHasTheDerivativeZero) {
  std::vector<Photo> photos = photos_under({{"Key"}, {"Key"}}, 4);
  photos[0].lights.world = false;
  const FitProblem problem(stage(), photos, {{"World", "strength", {0.5}, 0.01, 10, 0.03}},
                           settings_for());
  RenderCounts counts;
  PhotoEvaluator evaluator(scene_model(problem), problem.settings(), counts);
  const Picture black(kSize * kSize);
  for (const std::size_t photo : {0, 1}) {
    const Film film =
        evaluator.evaluate(problem.start(), problem.photos()[photo], {16, 7, Differences{}});
    EXPECT_EQ(film.slots[0].mean == black, photo == 0);
  }
}

/// Two lamps of one name are one unknown: it shows where one of them is on.
TEST(LightState, AnUnknownShowsWhereOneOfItsPlacesIsOn) {
  SceneBuilder builder;
  place(builder, quad_mesh(20), builder.add_material(matte("Floor", 0.5)));
  Light left = area_lamp("Key", kKeyFrom, kKeyPower),
        right = area_lamp("Key", kFillFrom, kKeyPower);
  left.object = "Left";
  right.object = "Right";
  builder.add_light(left);
  builder.add_light(right);
  const Scene scene = builder.build();
  const ParameterRef power = scene.find("Key", "power");
  EXPECT_TRUE(LightState{Names{"Right"}}.shows(scene, power));
  EXPECT_FALSE(LightState{Names{}}.shows(scene, power));
  const Scene one = LightState{Names{"Right"}}.applied_to(scene);
  EXPECT_FALSE(one.appearance.lights[0].on);
  EXPECT_TRUE(one.appearance.lights[1].on);
  const Scene both = LightState{Names{"Key"}}.applied_to(scene);
  EXPECT_TRUE(both.appearance.lights[0].on && both.appearance.lights[1].on);
}

template <class Error>
std::string message_of(const Scene& scene, const LightState& state) {
  try {
    state.check(scene, "Photo 'a'");
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

TEST(LightState, UnknownLampsAreNamedAllAtOnce) {
  std::vector<Photo> photos = photos_under({{}, {}}, 1);
  photos[0].lights.lamps = Names{"Fill", "Rim", "Kicker"};
  photos[1].lights.places = {{"Floor", looking_at(kKeyFrom, {0, 0, 0})}};
  try {
    check_photos(stage(), photos);
    FAIL() << "accepted";
  } catch (const UnknownName& error) {
    EXPECT_EQ(std::string(error.what()),
              "Photo 'Photo 0': lamps 'Rim', 'Kicker' are not in the scene; lamps: 'Key', 'Fill'\n"
              "Photo 'Photo 1': lamp 'Floor' is not in the scene; lamps: 'Key', 'Fill'");
  }
}

TEST(LightState, AMatrixThatMovesNoSingleLampIsRefused) {
  const Transform there = looking_at(kKeyFrom, {0, 0, 0});
  LightState twice, flat;
  twice.places = {{"Key", there}, {"Key", there}};
  EXPECT_EQ(message_of<InvalidArgument>(stage(), twice),
            "Photo 'a': lamp 'Key' is moved twice; give one matrix");
  Transform nothing;
  nothing.m = {{{0, 0, 0, 1}, {0, 0, 0, 2}, {0, 0, 0, 3}}};
  flat.places = {{"Key", nothing}};
  EXPECT_EQ(message_of<InvalidArgument>(stage(), flat).substr(0, 32),
            "Photo 'a': Light 'Key': scale = ");
  SceneBuilder builder;
  place(builder, quad_mesh(20), builder.add_material(matte("Floor", 0.5)));
  builder.add_light(area_lamp("Key", kKeyFrom, kKeyPower));
  builder.add_light(area_lamp("Key", kFillFrom, kKeyPower));
  LightState both;
  both.places = {{"Key", there}};
  EXPECT_EQ(
      message_of<InvalidArgument>(builder.build(), both),
      "Photo 'a': lamp 'Key' stands at 2 places, so one matrix cannot move it; name one of its "
      "objects, or make its instances real");
}

TEST(LightState, IsInTheFingerprintAndGoesWithASmallerPhoto) {
  const Photo photo = photos_under({{"Key"}}, 1)[0];
  std::vector<Photo> others(5, photo);
  others[0].lights.lamps = Names{"Fill"};
  others[1].lights.lamps = Names{};
  others[2].lights.lamps = std::nullopt;
  others[3].lights.world = false;
  others[4].lights.places = {{"Key", looking_at(kFillFrom, {0, 0, 0})}};
  for (std::size_t i = 0; i < others.size(); ++i) {
    EXPECT_NE(others[i].fingerprint(), photo.fingerprint()) << i;
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_NE(others[i].fingerprint(), others[j].fingerprint()) << i << j;
  }
  EXPECT_EQ(photo.resized(4).lights.lamps, photo.lights.lamps);
}

}  // namespace
}  // namespace selenite
