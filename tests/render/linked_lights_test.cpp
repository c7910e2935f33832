// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "math/error.h"
#include "render/lit_plane.h"
#include "render/picture_statistics.h"
#include "scene/small_scenes.h"

// Light linking and shadow linking.
namespace selenite {
namespace {

constexpr RayKinds kHiddenFromCamera = kAllRays & ~kCameraRay;

Colorf pixel(const SceneBuilder& builder, int spp = 4) {
  const Film film = render_view(builder.build(), settings_of(1, spp));
  EXPECT_TRUE(complete(film));
  return film.mean[0];
}
Estimate brightness(const SceneBuilder& builder, int spp) {
  const Film film = render_view(builder.build(), settings_of(8, spp));
  EXPECT_TRUE(complete(film));
  return mean_of(film);
}

TEST(LightLinking, DecidesWhatALampShinesOn) {
  for (const Light& light : {sun(3), area(50, 1, {0.6, 0, 0.8})}) {
    SceneBuilder builder = plane(matte("Floor", 0.5));
    builder.add_light(light);
    const float lit = pixel(builder, 16).g;
    builder.appearance.lights[0].links.lit = 2;
    EXPECT_EQ(pixel(builder, 16).g, 0);
    builder.instances[0].lit_set = 1;
    EXPECT_NEAR(pixel(builder, 16).g, lit, 1e-6);
    builder.appearance.lights[0].links.lit = ~std::uint64_t{2};
    EXPECT_EQ(pixel(builder, 16).g, 0);
  }
}

TEST(LightLinking, DecidesWhatAnEmissiveSurfaceShinesOn) {
  SceneBuilder builder = plane(matte("Floor", 0.5));
  const int lamp = place(builder, quad_mesh(1), builder.add_material(emitter("Lamp", 2)),
                         translation({0, 0, 3}));
  EXPECT_GT(brightness(builder, 32).mean, 0.01);
  builder.instances[lamp].links.lit = 2;
  EXPECT_EQ(brightness(builder, 32).mean, 0);
  builder.instances[0].lit_set = 1;
  EXPECT_GT(brightness(builder, 32).mean, 0.01);
}

TEST(ShadowLinking, DecidesWhoCastsALampsShadows) {
  for (const Light& light : {sun(3), area(50, 1, {0.6, 0, 0.8})}) {
    SceneBuilder builder = plane(matte("Floor", 0.5));
    builder.add_light(light);
    const float lit = pixel(builder, 2000).g;
    sheet(builder, 0.2).visible_to = kHiddenFromCamera;
    EXPECT_EQ(pixel(builder, 16).g, 0);
    builder.instances[1].shadow_set = 1;
    builder.appearance.lights[0].links.shading = ~std::uint64_t{2};
    EXPECT_NEAR(pixel(builder, 2000).g, lit, 0.01 * lit);
    builder.appearance.lights[0].links.shading = 2;
    EXPECT_EQ(pixel(builder, 16).g, 0);
  }
}

TEST(ShadowLinking, ShowsALampInAMirrorPastWhatDoesNotShadeIt) {
  SceneBuilder builder = plane(mirror("Floor", 1, 0));
  builder.add_light(area(50, 2, {0, 3, 3}));
  const float lit = pixel(builder).g;
  EXPECT_GT(lit, 1);
  sheet(builder, 0.2).visible_to = kHiddenFromCamera;
  EXPECT_EQ(pixel(builder).g, 0);
  builder.instances[1].shadow_set = 1;
  builder.appearance.lights[0].links.shading = ~std::uint64_t{2};
  EXPECT_NEAR(pixel(builder).g, lit, 1e-5 * lit);
}

TEST(Visibility, IsRefusedInSetsThatDoNotExist) {
  SceneBuilder builder = plane(matte("Floor", 0.5));
  Instance object = builder.instances[0];
  object.lit_set = 64;
  EXPECT_THROW(builder.add_object(object), InvalidArgument);
}

}  // namespace
}  // namespace selenite
