// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cstring>
#include <numeric>

#include "math/error.h"
#include "render/box_on_ground.h"
#include "render/difference.h"
#include "render/driver/field_gradient.h"
#include "render/picture_statistics.h"
#include "scene/small_scenes.h"

namespace selenite {
namespace {

struct TextureCase {
  std::string name;
  std::vector<float> texels;  ///< 2 x 2, grey, row 0 at the top
  int texel;
  double transmission = 0, specular = 0.5;
  bool encoded = false;
  Extension extension = Extension::kRepeat;
  Interpolation interpolation = Interpolation::kLinear;
  double subsurface = 0;
};
void PrintTo(const TextureCase& wanted, std::ostream* out) {
  *out << wanted.name << ", " << wanted.texel;
}

/// A box, textured on all sides, on a textured ground: light is scattered by the image several times.
Scene textured(const TextureCase& wanted, std::vector<float> alpha = {}) {
  std::vector<Colorf> pixels;
  for (const float x : wanted.texels) pixels.emplace_back(x, 0.5f * x, 0.3f);
  Material m = plastic("Body");
  m.values.roughness = 0.4;
  m.values.transmission = wanted.transmission;
  m.values.specular_level = wanted.specular;
  m.values.subsurface_weight = wanted.subsurface;
  m.values.subsurface_scale = 0.3;
  m.values.subsurface_radius = {1, 0.6, 0.4};
  FieldMap map;
  map.texture = std::make_shared<Texture>("Wood", 2, 2, std::move(pixels), std::move(alpha),
                                          wanted.encoded, wanted.extension, wanted.interpolation);
  map.uv = {1.3f, 0.2f, 0.1f, -0.1f, 1.1f, 0.15f};
  const auto& table = parameter_table(OwnerKind::kMaterial);
  while (table[map.field].name != "base_color") ++map.field;
  m.maps.push_back(map);
  return box_on_ground(m);
}

FieldGradient gradient_of(const Scene& scene, const RenderSettings& settings,
                          const PixelLoss& loss) {
  return render_field_gradient(scene, scene.cameras[0], {ImageRef{0}}, settings, loss);
}
PixelLoss mean_loss(const RenderSettings& s) {
  return mean_of_pixels(std::vector<float>(static_cast<std::size_t>(s.width) * s.height, 1.0f));
}

class Texel : public testing::TestWithParam<TextureCase> {};

TEST_P(Texel, AgreesWithDifferencesOfRenders) {
  const TextureCase& wanted = GetParam();
  const auto at = static_cast<std::size_t>(wanted.texel);
  const float here = wanted.texels[at];
  // Beside 0 the tint of glass goes with the root: there the step is small.
  const float h = wanted.transmission > 0 && here < 0.1f ? 0.01f : 0.08f;
  const auto displaced = [&](float step, const RenderSettings& settings) {
    TextureCase other = wanted;
    other.texels[at] = here + step;
    return mean_of(render_view(textured(other), settings), 0).mean;
  };
  const Scene scene = textured(wanted);
  DifferencePairs pairs;
  for (int seed = 0; seed < 12; ++seed) {
    const RenderSettings settings = settings_of(8, 100, 70 + seed);
    const FieldGradient found = gradient_of(scene, settings, mean_loss(settings));
    ASSERT_TRUE(complete(found.film));
    pairs.add(found.fields[0][3 * at],
              difference_slope(here, h, 1, [&](float step) { return displaced(step, settings); }));
  }
  pairs.expect_agreement();
}

std::vector<TextureCase> cases() {
  const std::vector<float> mixed = {0.3f, 0.9f, 0.5f, 0.7f}, black(4, 0.0f), white(4, 1.0f);
  std::vector<float> hole = mixed;
  hole[2] = 0;
  TextureCase cubic{"cubic", mixed, 0}, closest{"closest", mixed, 2}, clip{"clipped", mixed, 1},
      mirror{"mirrored", mixed, 2}, encoded{"encoded", mixed, 3}, glass{"glass", mixed, 1, 1},
      dark_glass{"dark glass", hole, 2, 0.5}, matte{"matte", mixed, 0, 0, 0},
      wax{"wax", mixed, 1, 0, 0}, dim_wax{"dim wax", {0.3f, 0.9f, 0.12f, 0.7f}, 2, 0, 0};
  cubic.interpolation = Interpolation::kCubic;
  closest.interpolation = Interpolation::kClosest;
  clip.extension = Extension::kClip;
  mirror.extension = Extension::kMirror;
  encoded.encoded = true;
  wax.subsurface = 1;
  dim_wax.subsurface = 0.6;
  return {{"plastic", mixed, 0},
          {"plastic", mixed, 3},
          {"one black", hole, 2},
          {"all black", black, 1},
          {"all white", white, 0},
          matte,
          cubic,
          closest,
          clip,
          mirror,
          encoded,
          glass,
          dark_glass,
          wax,
          dim_wax};
}
INSTANTIATE_TEST_SUITE_P(Cases, Texel, testing::ValuesIn(cases()));

TEST(TextureGradient, TexelsAddUpToTheShift) {
  const Scene scene = textured({"", {0.3f, 0.9f, 0, 0.7f}, 0, 0.4});
  const RenderSettings settings = settings_of(12, 16);
  const FieldGradient found = gradient_of(scene, settings, mean_loss(settings));
  for (int c = 0; c < 3; ++c) {
    double sum = 0;
    for (std::size_t t = 0; t < 4; ++t) sum += found.fields[0][3 * t + static_cast<std::size_t>(c)];
    const double shift = slope_of(found.film, 0, c).mean;
    EXPECT_GT(shift, 0.01);
    EXPECT_NEAR(sum, shift, 1e-5 * shift) << c;  // the same samples
  }
}

TEST(TextureGradient, TakesThePictureThatRenderTakes) {
  const Scene scene = textured({"", {0.3f, 0.9f, 0.1f, 0.7f}, 0});
  const RenderSettings settings = settings_of(12, 64);
  const Estimate with = mean_of(gradient_of(scene, settings, mean_loss(settings)).film);
  const Estimate plain = mean_of(render_view(scene, settings_of(12, 64, 2)));
  EXPECT_LT(std::abs(with.mean - plain.mean), 4 * std::hypot(with.error, plain.error));
}

TEST(TextureGradient, SquaredErrorIsUnbiasedInOneSamplePair) {
  // Two samples a pixel: the slope of the expected error, not that of the noise.
  const TextureCase wanted{"", {0.4f, 0.6f, 0.5f, 0.7f}, 0};
  const Scene scene = textured(wanted);
  const RenderSettings many = settings_of(6, 4000, 9);
  const Film reference = render_view(textured({"", {0.6f, 0.6f, 0.5f, 0.7f}, 0}), many);
  const FieldGradient precise = gradient_of(scene, many, squared_error(reference.mean));
  Tally few;
  for (int seed = 0; seed < 3000; ++seed)
    few.add(gradient_of(scene, settings_of(6, 2, 100 + seed), squared_error(reference.mean))
                .fields[0][0]);
  const Estimate e = few.estimate();
  EXPECT_LT(std::abs(e.mean - precise.fields[0][0]), 4 * e.error);
  EXPECT_LT(e.error, 0.1 * std::abs(precise.fields[0][0]));
}

TEST(TextureGradient, DoesNotDependOnTheNumberOfThreads) {
  const Scene scene = textured({"", {0.3f, 0.9f, 0.1f, 0.7f}, 0, 0.4});
  RenderSettings settings = settings_of(40, 4);
  const FieldGradient one = gradient_of(scene, settings, mean_loss(settings));
  settings.threads = 3;
  const FieldGradient three = gradient_of(scene, settings, mean_loss(settings));
  EXPECT_EQ(one.fields, three.fields);
  EXPECT_EQ(std::memcmp(one.film.mean.data(), three.film.mean.data(),
                        one.film.mean.size() * sizeof(Colorf)),
            0);
}

/// The texels that cells have met, added up, are the gradient of the same sum from the same samples.
TEST(TextureGradient, TexelsOfCellsAddUpToTheGradient) {
  const Scene scene = textured({"", {0.3f, 0.9f, 0.1f, 0.7f}, 0, 0.4});
  const RenderSettings settings = settings_of(21, 4);
  std::vector<float> weights(static_cast<std::size_t>(settings.width) * settings.height);
  for (std::size_t p = 0; p < weights.size(); ++p) weights[p] = 0.1f + static_cast<float>(p % 7);
  const FieldGradient gradient = gradient_of(scene, settings, [&](std::size_t pixel, const Film&) {
    return PixelSlope{Colorf(weights[pixel]), {}};
  });
  for (const int cell : {1, 8}) {
    const FieldJacobian found =
        render_field_jacobian(scene, scene.cameras[0], {ImageRef{0}}, settings, weights, cell);
    EXPECT_EQ(found.fields[0].cols(), 0) << "nothing is held for texels that are not met";
    ASSERT_EQ(std::ssize(found.places[0]),
              cells_along(settings.width, cell) * cells_along(settings.height, cell));
    std::vector<double> sums(12);
    for (const auto& row : found.places[0])
      for (const auto& [texel, slope] : row)
        for (int c = 0; c < 3; ++c) sums[3 * texel + static_cast<std::size_t>(c)] += slope[c];
    for (std::size_t k = 0; k < sums.size(); ++k)
      EXPECT_NEAR(sums[k], gradient.fields[0][k], 1e-4 * std::abs(gradient.fields[0][k])) << k;
  }
}

// Only the middle of three by three cells counts.
TEST(TextureGradient, TexelsOfACellAreThoseOfItsPixels) {
  const Scene scene = textured({"", {0.3f, 0.9f, 0.1f, 0.7f}, 0, 0.4});
  const RenderSettings settings = settings_of(21, 4);
  std::vector<float> weights(static_cast<std::size_t>(settings.width) * settings.height);
  for (std::size_t y = 8; y < 16; ++y)
    for (std::size_t x = 8; x < 16; ++x) weights[y * settings.width + x] = 1;
  const FieldJacobian found =
      render_field_jacobian(scene, scene.cameras[0], {ImageRef{0}}, settings, weights, 8);
  ASSERT_EQ(found.places[0].size(), 9u);
  for (std::size_t cell = 0; cell < 9; ++cell) {
    double sum = 0;
    for (const auto& [texel, slope] : found.places[0][cell]) sum += std::abs(slope[0]);
    EXPECT_EQ(sum > 0, cell == 4) << cell;
  }
}

TEST(TextureGradient, RefusesWhatHasNone) {
  const RenderSettings settings = settings_of(2, 1);
  const auto refused = [&](const Scene& scene, const std::vector<FieldRef>& unknown) {
    try {
      render_field_gradient(scene, scene.cameras[0], unknown, settings, mean_loss(settings));
    } catch (const InvalidArgument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const TextureCase wanted{"", {0.3f, 0.9f, 0.1f, 0.7f}, 0};
  EXPECT_EQ(refused(textured(wanted, {1, 1, 0.5f, 1}), {ImageRef{0}}),
            "Body:base_color_texture: image 'Wood' has alpha; set its Alpha to None or Channel "
            "Packed");
  EXPECT_EQ(refused(textured(wanted), {ImageRef{0}, ImageRef{0}}),
            "Body:base_color_texture is listed twice; list it once");
  Scene plain = textured(wanted);
  plain.appearance.materials[0].maps.clear();
  EXPECT_NE(refused(plain, {ImageRef{0}}).find("no image gives base_color"), std::string::npos);
}

}  // namespace
}  // namespace selenite
