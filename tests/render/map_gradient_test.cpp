// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <optional>

#include "math/error.h"
#include "render/box_on_ground.h"
#include "render/difference.h"
#include "render/driver/field_gradient.h"
#include "render/picture_statistics.h"
#include "scene/small_scenes.h"

// Derivatives by texels of any parameter's image, and by colours of a mesh.
namespace selenite {
namespace {

int field_named(std::string_view name) {
  const auto& table = parameter_table(OwnerKind::kMaterial);
  int field = 0;
  while (table[static_cast<std::size_t>(field)].name != name) ++field;
  return field;
}

FieldMap grey_map(const char* parameter, const std::vector<float>& texels, bool encoded = false) {
  FieldMap map;
  map.field = field_named(parameter);
  map.texture = std::make_shared<Texture>(
      parameter, 2, 2, std::vector<Colorf>(texels.begin(), texels.end()), std::vector<float>(),
      encoded, Extension::kRepeat, Interpolation::kLinear);
  return map;
}

Material wax() {
  Material m = plastic("Body");
  m.values.roughness = 0.4;
  m.values.base_color = {0.7, 0.5, 0.3};
  m.values.subsurface_scale = 0.3;
  m.values.subsurface_radius = {1, 0.6, 0.4};
  m.values.emission_strength = 0.5;
  return m;
}

FieldGradient gradient_of(const Scene& scene, const std::vector<FieldRef>& unknown,
                          const RenderSettings& settings) {
  const PixelLoss mean = mean_of_pixels(
      std::vector<float>(static_cast<std::size_t>(settings.width) * settings.height, 1.0f));
  return render_field_gradient(scene, scene.cameras[0], unknown, settings, mean);
}

/// All three channels: a number changes each.
double brightness(const Film& film) {
  double sum = 0;
  for (int c = 0; c < 3; ++c) sum += mean_of(film, c).mean;
  return sum;
}

struct MapCase {
  const char* parameter;
  std::vector<float> texels{0.3f, 0.7f, 0.5f, 0.6f};
  bool encoded = false;
  float step = 0.08f;
  int spp = 150;
};
void PrintTo(const MapCase& wanted, std::ostream* out) { *out << wanted.parameter; }

class Map : public testing::TestWithParam<MapCase> {};

TEST_P(Map, AgreesWithDifferencesOfRenders) {
  const MapCase& wanted = GetParam();
  const int field = field_named(wanted.parameter);
  const bool is_number =
      parameter_widths(OwnerKind::kMaterial)[static_cast<std::size_t>(field)] == 1;
  constexpr std::size_t kAt = 2;
  const auto scene_of = [&](float step) {
    std::vector<float> texels = wanted.texels;
    texels[kAt] += step;
    Material m = wax();
    m.maps.push_back(grey_map(wanted.parameter, texels, wanted.encoded));
    if (field == field_named("emission_color")) m.values.emission_color = {0.5, 0.5, 0.5};
    return box_on_ground(m);
  };
  const Scene scene = scene_of(0);
  DifferencePairs pairs;
  for (int seed = 0; seed < 12; ++seed) {
    const RenderSettings settings = settings_of(8, wanted.spp, 70 + seed);
    const FieldGradient found = gradient_of(scene, {ImageRef{0, field}}, settings);
    ASSERT_TRUE(complete(found.film));
    ASSERT_EQ(found.fields[0].size(), is_number ? 4u : 12u);
    double slope = 0;
    if (is_number)
      slope = found.fields[0][kAt];
    else
      for (std::size_t c = 0; c < 3; ++c) slope += found.fields[0][3 * kAt + c];
    pairs.add(slope, difference_slope(wanted.texels[kAt], wanted.step, 1, [&](float step) {
                return brightness(render_view(scene_of(step), settings));
              }));
  }
  pairs.expect_agreement();
}

INSTANTIATE_TEST_SUITE_P(
    Parameters, Map,
    testing::Values(MapCase{"roughness"}, MapCase{"metallic"}, MapCase{"transmission"},
                    MapCase{"specular_level"},
                    MapCase{.parameter = "subsurface_weight", .spp = 500}, MapCase{"alpha"},
                    MapCase{"emission_color"}, MapCase{"metallic", {0, 0, 0, 0}},
                    MapCase{"roughness", {0.5f, 0.7f, 0.6f, 0.8f}, true, 0.08f, 900}));

TEST(MapGradient, SeveralMapsOfAMaterialHaveTheirOwnDerivatives) {
  Material m = wax();
  m.maps.push_back(grey_map("base_color", {0.3f, 0.7f, 0.5f, 0.6f}));
  m.maps.push_back(grey_map("metallic", {0.2f, 0.5f, 0.3f, 0.6f}));
  m.maps.push_back(grey_map("roughness", {0.4f, 0.7f, 0.5f, 0.6f}));
  const Scene scene = box_on_ground(m);
  const RenderSettings settings = settings_of(8, 200, 3);
  std::vector<FieldRef> all;
  for (const char* name : {"base_color", "metallic", "roughness"})
    all.push_back(ImageRef{0, field_named(name)});
  const FieldGradient together = gradient_of(scene, all, settings);
  for (std::size_t f = 0; f < all.size(); ++f) {
    const FieldGradient alone = gradient_of(scene, {all[f]}, settings);
    ASSERT_EQ(alone.fields[0].size(), together.fields[f].size());
    double size = 0;
    for (const double x : alone.fields[0]) size = std::max(size, std::abs(x));
    // Russian roulette looks at all derivatives, so that the paths differ.
    for (std::size_t i = 0; i < alone.fields[0].size(); ++i)
      EXPECT_NEAR(together.fields[f][i], alone.fields[0][i], 0.1 * size) << f << " " << i;
  }
}

/// Colours of the box's vertices.
CornerData<Colorf> vertex_colors(const std::vector<Colorf>& held) {
  CornerData<Colorf> colors{"Col", {}, held, {}};
  for (const auto& triangle : box_mesh(0.6, 0.6, 0.6).triangles)
    for (const int vertex : triangle) {
      colors.elements.push_back(vertex % static_cast<int>(held.size()));
      colors.values.push_back(held[static_cast<std::size_t>(colors.elements.back())]);
    }
  return colors;
}

Scene painted(const std::vector<Colorf>& held) {
  Material m = wax();
  FieldMap map;
  map.field = field_named("base_color");
  m.maps.push_back(map);
  return box_on_ground(m, vertex_colors(held));
}

const std::vector<Colorf> kHeld = {{0.3f, 0.4f, 0.5f}, {0.7f, 0.5f, 0.2f}, {0.4f, 0.8f, 0.6f},
                                   {0.6f, 0.6f, 0.6f}, {0.5f, 0.3f, 0.7f}, {0.8f, 0.7f, 0.4f},
                                   {0.2f, 0.5f, 0.5f}, {0.9f, 0.6f, 0.3f}};

TEST(VertexColorGradient, AgreesWithDifferencesOfRenders) {
  const Scene scene = painted(kHeld);
  for (const std::size_t vertex : {0u, 5u}) {
    DifferencePairs pairs;
    for (int seed = 0; seed < 12; ++seed) {
      const RenderSettings settings = settings_of(8, 100, 40 + seed);
      const FieldGradient found = gradient_of(scene, {VertexColorsRef{0}}, settings);
      ASSERT_EQ(found.fields[0].size(), 3 * kHeld.size());
      pairs.add(
          found.fields[0][3 * vertex], difference_slope(kHeld[vertex].r, 0.08f, 1, [&](float step) {
            std::vector<Colorf> held = kHeld;
            held[vertex].r += step;
            return mean_of(render_view(scene.with_vertex_colors({0}, held), settings), 0).mean;
          }));
    }
    pairs.expect_agreement();
  }
}

TEST(VertexColorGradient, ValuesAddUpToTheShift) {
  const Scene scene = painted(std::vector<Colorf>(8, Colorf(0.5f)));
  const RenderSettings settings = settings_of(12, 64);
  const FieldGradient found = gradient_of(scene, {VertexColorsRef{0}}, settings);
  double sum = 0;
  for (std::size_t i = 0; i < found.fields[0].size(); i += 3) sum += found.fields[0][i];
  const auto at = [&](float grey) {
    return mean_of(render_view(painted(std::vector<Colorf>(8, Colorf(grey))), settings), 0).mean;
  };
  EXPECT_NEAR(sum, (at(0.51f) - at(0.49f)) / 0.02, 0.02 * std::abs(sum));
}

TEST(VertexColorGradient, RefusesAMeshWithoutColours) {
  const Scene scene = box_on_ground(wax());
  try {
    gradient_of(scene, {VertexColorsRef{0}}, settings_of(2, 1));
    FAIL();
  } catch (const InvalidArgument& error) {
    EXPECT_NE(std::string(error.what()).find("look up no colour attribute"), std::string::npos);
  }
}

}  // namespace
}  // namespace selenite
