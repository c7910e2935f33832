// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "render/picture_statistics.h"
#include "scene/small_scenes.h"

// No light is looked for into a body from where none is seen: pictures must not show it.
namespace selenite {
namespace {

struct Body {
  const char* name;
  Material material;
};
void PrintTo(const Body& b, std::ostream* out) { *out << b.name; }

/// A ball under an area lamp and a sky. A triangle inside, too small to be met, makes its mesh an open one.
Scene scene_of(const Material& material, bool open, double lamp_height = 4) {
  SceneBuilder builder;
  Mesh mesh = sphere_mesh(1, 12);
  if (open) {
    const int first = static_cast<int>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(),
                          {{0.3f, 0.2f, 0.1f}, {0.3f, 0.2001f, 0.1f}, {0.3f, 0.2f, 0.1001f}});
    mesh.triangles.push_back({first, first + 1, first + 2});
    for (int k = 0; k < 3; ++k) mesh.corner_normals.push_back({1, 0, 0});
    mesh.material_slots.push_back(0);
  }
  place(builder, mesh, builder.add_material(material));
  Light lamp;
  lamp.name = "Lamp";
  lamp.kind = LightKind::kArea;
  lamp.values.power = 100;
  lamp.to_world = looking_at({1, 0, lamp_height}, {1, 0, lamp_height - 1}, {0, 1, 0});
  builder.add_light(lamp);
  set_sky(builder, 0.3);
  add_view(builder, {0, -4, 1}, {0, 0, 0});
  return builder.build();
}

class BodyWithoutLightInside : public testing::TestWithParam<Body> {};

TEST_P(BodyWithoutLightInside, LooksLikeAnOpenOne) {
  const RenderSettings settings = settings_of(32, 16);
  const Film closed = render_view(scene_of(GetParam().material, false), settings);
  const Film open = render_view(scene_of(GetParam().material, true), settings);
  ASSERT_TRUE(complete(closed) && complete(open));
  for (int c = 0; c < 3; ++c) {
    const Estimate a = mean_of(closed, c), b = mean_of(open, c);
    EXPECT_NEAR(a.mean, b.mean, 0.2 * a.error) << c;
  }
}

TEST_P(BodyWithoutLightInside, IsNotSealedAroundALamp) {
  // The lamp's square reaches out of the ball, so light gets in and out on both sides.
  const RenderSettings settings = settings_of(32, 16);
  const Film closed = render_view(scene_of(GetParam().material, false, 0.5), settings);
  const Film open = render_view(scene_of(GetParam().material, true, 0.5), settings);
  for (int c = 0; c < 3; ++c) {
    const Estimate a = mean_of(closed, c), b = mean_of(open, c);
    EXPECT_NEAR(a.mean, b.mean, 0.2 * a.error) << c;
  }
}

TEST(InvertedBody, IsLitFromOutside) {
  // A matte surface has two equal sides.
  SceneBuilder builder[2];
  Film film[2];
  for (int i = 0; i < 2; ++i) {
    Mesh mesh = sphere_mesh(1, 12);
    if (i == 1)
      for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
        std::swap(mesh.corner_normals[3 * t + 1], mesh.corner_normals[3 * t + 2]);
        for (std::size_t k = 0; k < 3; ++k)
          mesh.corner_normals[3 * t + k] = -mesh.corner_normals[3 * t + k];
      }
    place(builder[i], mesh, builder[i].add_material(matte("Matte", 0.7)));
    Light sun;
    sun.name = "Sun";
    sun.kind = LightKind::kSun;
    sun.values.power = 3;
    sun.to_world = looking_at({1, -1, 4}, {0, 0, 0});
    builder[i].add_light(sun);
    add_view(builder[i], {0, -4, 1}, {0, 0, 0});
    film[i] = render_view(builder[i].build(), settings_of(32, 16));
  }
  const Estimate a = mean_of(film[0]), b = mean_of(film[1]);
  EXPECT_GT(a.mean, 0.05);
  EXPECT_NEAR(a.mean, b.mean, 1e-3 * a.mean);
}

Material half_glass() {
  Material m = glass("Half", 1.5, 0.3);
  m.values.transmission = 0.5;
  return m;
}
INSTANTIATE_TEST_SUITE_P(Materials, BodyWithoutLightInside,
                         testing::Values(Body{"rough glass", glass("Glass", 1.5, 0.3)},
                                         Body{"half glass", half_glass()},
                                         Body{"plastic", plastic("Plastic")}));

}  // namespace
}  // namespace selenite
