// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/texture.h"

#include <gtest/gtest.h>

#include <limits>

#include "math/error.h"
#include "scene/small_scenes.h"

namespace selenite {
namespace {

/// Grey image from rows that start at the top.
Texture grey(int width, const std::vector<float>& values, Extension extension,
             Interpolation interpolation = Interpolation::kLinear, bool encoded = false) {
  std::vector<Colorf> pixels;
  for (float x : values) pixels.emplace_back(x);
  return {"grey",    width,        static_cast<int>(values.size()) / width, pixels, {}, encoded,
          extension, interpolation};
}

float at(const Texture& texture, float u, float v = 0.5f) { return texture.at({u, v}).g; }

TEST(Texture, TexelCentresAndOriginBottomLeft) {
  const Texture t = grey(2, {1, 2, 3, 4}, Extension::kRepeat);
  EXPECT_FLOAT_EQ(at(t, 0.25f, 0.25f), 3);
  EXPECT_FLOAT_EQ(at(t, 0.75f, 0.75f), 2);
  EXPECT_FLOAT_EQ(at(t, 0.5f, 0.5f), 2.5f);
}

TEST(Texture, EncodedValuesAreInterpolatedBeforeTheyAreDecoded) {
  const Texture t = grey(2, {0, 1}, Extension::kExtend, Interpolation::kLinear, true);
  EXPECT_NEAR(at(t, 0.5f), 0.21404f, 1e-5);
}

TEST(Texture, EveryExtension) {
  const std::vector<float> values{1, 2, 4};
  const float left = -1.0f / 6, right = 7.0f / 6;  // centres of the texels next to the image
  const auto pair = [&](Extension extension, Interpolation interpolation) {
    const Texture t = grey(3, values, extension, interpolation);
    return std::array<float, 2>{at(t, left), at(t, right)};
  };
  for (const auto way : {Interpolation::kLinear, Interpolation::kClosest}) {
    const auto expect = [&](Extension extension, float low, float high) {
      const auto found = pair(extension, way);
      EXPECT_NEAR(found[0], low, 1e-5);
      EXPECT_NEAR(found[1], high, 1e-5);
    };
    expect(Extension::kRepeat, 4, 1);
    expect(Extension::kExtend, 1, 4);
    expect(Extension::kClip, 0, 0);
    expect(Extension::kMirror, 1, 4);
  }
  EXPECT_NEAR(at(grey(3, values, Extension::kClip), 0), 0.5f, 1e-6);  // half of the edge texel
  EXPECT_NEAR(at(grey(3, values, Extension::kMirror), 11.0f / 6), 1, 1e-5);
}

TEST(Texture, CubicIsABSpline) {
  const Texture t = grey(4, {0, 0, 6, 0}, Extension::kClip, Interpolation::kCubic);
  EXPECT_NEAR(at(t, 2.5f / 4), 6 * 2.0f / 3 * (2.0f / 3), 1e-5);  // one row: its own weight is 2/3
  EXPECT_NEAR(at(t, 1.5f / 4), 6 * 1.0f / 6 * (2.0f / 3), 1e-5);
  const Texture constant = grey(4, {5, 5, 5, 5}, Extension::kMirror, Interpolation::kCubic);
  for (float u = -2; u < 2; u += 0.13f) EXPECT_NEAR(at(constant, u, u), 5, 1e-5);
}

TEST(Texture, AlphaIsDividedOutAfterInterpolationAndBeforeDecoding) {
  const std::vector<Colorf> premultiplied{Colorf(0.8f * 0.5f), Colorf(0.0f)};
  const Texture t("a", 2, 1, premultiplied, {0.5f, 0.0f}, true, Extension::kExtend,
                  Interpolation::kLinear);
  EXPECT_NEAR(at(t, 0.25f), 0.60383f, 1e-5);  // decode(0.8)
  EXPECT_NEAR(at(t, 0.5f), 0.60383f, 1e-5);
  EXPECT_FLOAT_EQ(at(t, 0.75f), 0);
}

TEST(Texture, FarAwayAndNotFiniteCoordinatesAreHarmless) {
  const float inf = std::numeric_limits<float>::infinity();
  for (const auto extension :
       {Extension::kRepeat, Extension::kExtend, Extension::kClip, Extension::kMirror}) {
    const Texture t = grey(2, {1, 2, 3, 4}, extension, Interpolation::kCubic);
    for (float u : {1e30f, -1e30f, inf, -inf, std::numeric_limits<float>::quiet_NaN()})
      EXPECT_TRUE(std::isfinite(at(t, u, -u)));
  }
  EXPECT_THROW(grey(2, {1, inf}, Extension::kRepeat), InvalidArgument);
  EXPECT_THROW(Texture("empty", 0, 0, {}, {}, false, Extension::kRepeat, Interpolation::kLinear),
               InvalidArgument);
  EXPECT_THROW(
      Texture("short", 1, 2, {Colorf(1.0f)}, {}, false, Extension::kRepeat, Interpolation::kLinear),
      InvalidArgument);
}

TEST(FieldMap, AParameterWithATextureIsNotSetToOneValue) {
  SceneBuilder builder;
  Material material = matte("Body", 0.5);
  FieldMap map;
  map.field = 0;
  map.texture = std::make_shared<Texture>(grey(2, {0.2f, 0.4f, 0.6f, 0.8f}, Extension::kRepeat));
  material.maps.push_back(map);
  place(builder, quad_mesh(1), builder.add_material(material));
  add_view(builder, {0, 0, 3}, {0, 0, 0});
  const Scene scene = builder.build();
  const ParameterRef color = scene.find("Body", "base_color");
  EXPECT_THROW((void)scene.with({{color, {0.1, 0.1, 0.1}}}), InvalidArgument);
  EXPECT_NO_THROW((void)scene.with({{scene.find("Body", "roughness"), {0.1}}}));
}

}  // namespace
}  // namespace selenite
