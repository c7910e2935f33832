// SPDX-License-Identifier: GPL-3.0-or-later
// The texels of a base colour as unknowns of a fit.
#include <gtest/gtest.h>

#include <cstring>

#include "fit/evaluate/field_loss.h"
#include "fit/image_scenes.h"
#include "fit/objective/photo_weights.h"
#include "fit/problem/fields.h"
#include "fit/run/fit.h"
#include "fit/taken_photos.h"
#include "math/error.h"
#include "scene/small_scenes.h"

namespace selenite {
namespace {

constexpr int kSize = 16;

Scene without_image(Scene scene, double color) {
  scene.appearance.materials[0].maps.clear();
  scene.appearance.materials[0].values.base_color = Color<double>(color);
  return scene;
}

FitSettings fit_settings(int iterations) {
  FitSettings settings;
  settings.iterations = iterations;
  settings.spp = 8;
  settings.tolerance = 0;
  settings.threads = 1;
  return settings;
}

double most_off(const Vector& values, const std::vector<float>& truth) {
  double most = 0;
  for (std::size_t t = 0; t < truth.size(); ++t)
    for (std::size_t c = 0; c < 3; ++c)
      most =
          std::max(most, std::abs(values[static_cast<Eigen::Index>(3 * t + c)] - double{truth[t]}));
  return most;
}

TEST(ImageFields, GradientAddsUpToThatOfOneBaseColour) {
  const Scene scene = board({0.6f, 0.6f, 0.6f, 0.6f}), plain = without_image(scene, double{0.6f});
  const Photo photo = taken_photos(without_image(scene, 0.9), kSize, 16)[0];
  const Fields fields(scene, {texels()});
  EXPECT_EQ(fields.shape(0), (std::vector<std::ptrdiff_t>{kTexels, kTexels, 3}));
  const SlotLayout layout(plain, {plain.find("Board", "base_color")});
  const Film film = render(plain, plain.cameras[0], layout, square_settings(kSize, 16, 7));
  for (const Loss& loss : losses()) {
    const FieldGradient found =
        loss_field_gradient(scene, scene.cameras[0], fields, photo, {loss, photo},
                            square_settings(kSize, 16, 7), nullptr);
    const Vector want = loss_gradient(layout, film, loss.evaluate(film, photo));
    for (std::size_t c = 0; c < 3; ++c) {
      double sum = 0;
      for (std::size_t t = 0; t < 4; ++t) sum += found.fields[0][3 * t + c];
      const double one = want[static_cast<Eigen::Index>(c)];
      EXPECT_NEAR(sum, one, 2e-3 * std::abs(one)) << loss.name << " " << c;
      EXPECT_NE(one, 0);
    }
  }
}

TEST(ImageFields, AStepGoesAlongASmoothedGradient) {
  const Fields fields(board({0.5f, 0.5f, 0.5f, 0.5f}), {texels()});
  std::vector<double> gradient(12);
  gradient[0] = 1;  // red of the first texel
  for (const double spread : {0.0, 0.5}) {
    FieldAdam adam(fields);
    FieldValues values = fields.start();
    adam.step(values, {gradient}, {{2, spread}});
    EXPECT_NEAR(values[0][0], 0.5 - 2 * fields.wanted()[0].learning_rate, 1e-6);
    // Adam's first step has one length for all that are told anything.
    const bool last_moved = values[0][9] < 0.5;  // red of the last texel
    EXPECT_EQ(last_moved, spread > 0);
    EXPECT_EQ(values[0][1], 0.5) << "green";
  }
}

/// Photos under lamps from all sides: what is dark in one is so by its light, and its error counts by
/// what it is, not by its share of that photo.
TEST(ImageFields, ADarkPhotoDoesNotRule) {
  const std::vector<float> truth = {0.8f, 0.6f, 0.6f, 0.7f};
  const auto second_weighs = [&](GainFreedom exposure) {
    std::vector<Photo> photos(2, taken_photos(board(truth), kSize)[0]);
    photos[1].id = "dark";
    photos[1].gain_freedom = exposure;
    for (Colorf& pixel : photos[1].reference) pixel = pixel * 0.02f;
    FitProblem problem(board({0.5f, 0.5f, 0.5f, 0.5f}), photos, {texels()}, fit_settings(10));
    const Strategy strategy(problem);
    const PhotoWeights& weights = *problem.scalars().weights;
    return weights.of_loss(1).sum() / weights.of_loss(0).sum();
  };
  EXPECT_LT(second_weighs(GainFreedom::kNone), 3);
  EXPECT_GT(second_weighs(GainFreedom::kScalar), 1000) << "dark by its exposure";
}

/// A few iterations find them, then samples are what is missing. Beside scalars a refinement has them.
TEST(ImageFields, LaterIterationsOfImagesAloneHaveMoreSamples) {
  const std::vector<Photo> photos = taken_photos(board({0.8f, 0.6f, 0.6f, 0.7f}), kSize);
  const Scene start = board({0.5f, 0.5f, 0.5f, 0.5f});
  FitProblem alone(start, photos, {texels()}, fit_settings(40));
  const Strategy strategy(alone);
  EXPECT_EQ(strategy.samples(alone, 9), 1);
  EXPECT_EQ(strategy.samples(alone, 10), 4);
  FitSettings by_adam = fit_settings(40);
  by_adam.accumulate = false;
  FitProblem stepped(start, photos, {texels()}, by_adam);
  EXPECT_EQ(Strategy(stepped).samples(stepped, 39), 1);
}

class ImageFit : public testing::TestWithParam<bool> {};

TEST_P(ImageFit, FindsTheTexels) {
  const std::vector<float> truth = {0.9f, 0.2f, 0.35f, 0.7f};
  Fit fit(board({0.5f, 0.5f, 0.5f, 0.5f}, GetParam()),
          taken_photos(board(truth, GetParam()), kSize), {texels()}, fit_settings(80));
  EXPECT_EQ(fit.strategy().optimiser.name, "gauss-newton");
  EXPECT_TRUE(fit.strategy().joint);
  while (fit.step()) {
  }
  const FitResult& result = fit.result();
  ASSERT_EQ(result.stopped, StopReason::kIterations) << result.message;
  EXPECT_LT(most_off((*result.fields_best)[0], truth), 0.03);
  const double linear = (0.9 + 0.2 + 0.35 + 0.7) / 4, decoded = 0.342247;  // by hand, IEC 61966-2-1
  EXPECT_NEAR(result.history.back().field_means[0].g, GetParam() ? decoded : linear, 0.02);
}

TEST_P(ImageFit, ASearchStandsOneColourForAllTexels) {
  // Dark, and of another roughness; then texels apart, together with the roughness.
  const std::vector<float> truth = {0.8f, 0.6f, 0.6f, 0.7f};
  const Scene right = board(truth, GetParam());
  Fit fit(board({0.1f, 0.1f, 0.1f, 0.1f}, GetParam()), taken_photos(right, kSize),
          {roughness(), texels()}, fit_settings(60));
  EXPECT_EQ(fit.strategy().optimiser.name, "gauss-newton");
  EXPECT_TRUE(fit.strategy().joint);
  const Vector start = (*fit.result().fields_last)[0];
  while (fit.result().phase == PhaseKind::kMultiStart) ASSERT_TRUE(fit.step());
  const Vector even = (*fit.result().fields_last)[0];
  EXPECT_NE(even, start);
  for (Eigen::Index i = 3; i < even.size(); ++i) EXPECT_EQ(even[i], even[i % 3]);
  EXPECT_NEAR(even[0], 0.675, 0.05) << "as the image holds it";
  EXPECT_GT(fit.values()[0], 0.3) << "a sharp body shows the lamp, which this does not";
  const Vector searched = fit.values();
  while (fit.result().phase == PhaseKind::kDescent) {
    EXPECT_EQ(fit.values(), searched) << "scalars are left to the refinement";
    ASSERT_TRUE(fit.step());
  }
  EXPECT_EQ(fit.result().iterations, 15);
  while (fit.step()) {
  }
  EXPECT_LT(most_off((*fit.result().fields_best)[0], truth), 0.05);
  EXPECT_NEAR(fit.result().best[0], 0.5, 0.1);
  ASSERT_EQ(fit.result().report.components.size(), 1u);
  const auto& [low, high] = fit.result().report.components[0].interval;
  EXPECT_LT(low, 0.5);
  EXPECT_GT(high, 0.5);
}

TEST_P(ImageFit, BesideManyTexelsASharpBodyIsTriedBeforeEachTurnOfTheRoughness) {
  const std::vector<float> truth = {0.8f, 0.6f, 0.6f, 0.7f};
  Fit fit(with_many_texels(board(truth, GetParam()), 0.1f),
          taken_photos(board(truth, GetParam()), kSize), {roughness(), texels()}, fit_settings(60));
  EXPECT_FALSE(fit.strategy().joint);
  while (fit.result().phase == PhaseKind::kMultiStart) ASSERT_TRUE(fit.step());
  for (const int iteration : {7, 17}) {
    while (fit.result().iterations < iteration) ASSERT_TRUE(fit.step());
    const Vector texels_before = (*fit.result().fields_last)[0];
    for (int trial = 0; trial < 3; ++trial) ASSERT_TRUE(fit.step());  // one begins them
    EXPECT_EQ(fit.result().iterations, iteration);
    EXPECT_EQ((*fit.result().fields_last)[0], texels_before);
    EXPECT_GT(fit.values()[0], 0.3) << "which is no better here";
  }
  while (fit.step()) {
  }
  ASSERT_EQ(fit.result().stopped, StopReason::kIterations) << fit.result().message;
  EXPECT_NEAR(fit.result().best[0], 0.5, 0.1);
}
INSTANTIATE_TEST_SUITE_P(Encoded, ImageFit, testing::Bool());

/// By pictures at both sides, before each turn of the scalars and at the end.
TEST(ImageFields, BesideManyTexelsTheIorOfWhatRefractsSharplyIsLookedForAndNotStepped) {
  const std::vector<float> truth = {0.9f, 0.6f, 0.7f, 0.8f};
  FitSettings settings = fit_settings(20);
  settings.spp = 16;
  Fit fit(with_many_texels(glass_sphere(1.8, truth), 0.5f),
          taken_photos(glass_sphere(1.45, truth), 32),
          {texels(), {"Board", "ior", {1.8}, 1.1, 2.5, 0.03}}, settings);
  while (fit.step()) {
  }
  ASSERT_EQ(fit.result().stopped, StopReason::kIterations) << fit.result().message;
  const std::vector<HistoryRow>& rows = fit.result().history;
  ASSERT_EQ(rows.size(), 21u);
  for (std::size_t i = 1; i < rows.size(); ++i)
    EXPECT_EQ(rows[i].values[0] != rows[i - 1].values[0], i == 7 || i == 17 || i == 20) << i;
  for (const std::size_t i : {7u, 17u, 20u}) EXPECT_NEAR(rows[i].values[0], 1.45, 0.02) << i;
  EXPECT_NEAR(fit.result().best[0], 1.45, 0.02);
}

TEST(ImageFields, OtherTexelsAreThoseOfTheBaseColourAlone) {
  Scene scene = board({0.1f, 0.2f, 0.3f, 0.4f});
  FieldMap rough = scene.appearance.materials[0].maps[0];  // the same image
  rough.field = field_number("roughness");
  auto& maps = scene.appearance.materials[0].maps;
  maps.insert(maps.begin(), rough);
  const Scene changed = scene.with_image({0}, std::vector<Colorf>(4, Colorf(0.7f)));
  EXPECT_EQ(changed.image({0}).texture->pixels()[3], Colorf(0.7f));
  EXPECT_EQ(changed.appearance.materials[0].maps[0].texture->pixels()[3], Colorf(0.4f));
  EXPECT_EQ(scene.image({0}).texture->pixels()[3], Colorf(0.4f));
  EXPECT_THROW((void)scene.with_image({0}, std::vector<Colorf>(3, Colorf(0.7f))), InvalidArgument);
  EXPECT_THROW((void)without_image(scene, 0.5).with_image({0}, {}), InvalidArgument);
}

TEST(ImageFields, EncodesAsItDecodes) {
  const Texture image("Wood", 1, 1, {Colorf(0.5f)}, {}, true, Extension::kExtend,
                      Interpolation::kLinear);
  for (const float x : {0.0f, 0.001f, 0.02f, 0.04f, 0.3f, 1.0f})
    EXPECT_NEAR(image.encode(image.decode(Colorf(x))).g, x, 1e-6);
  EXPECT_NEAR(image.decode(Colorf(0.5f)).r, 0.214041, 1e-6);
}

TEST(ImageFields, NamesAllThatIsWrong) {
  const auto message = [](const Scene& scene, const std::vector<UnknownParameter>& wanted) {
    try {
      (void)Fields(scene, wanted);
    } catch (const InvalidArgument& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  const auto has = [](const std::string& text, const char* words) {
    EXPECT_NE(text.find(words), std::string::npos) << text;
  };
  const std::vector<float> grey(4, 0.5f);
  has(message(without_image(board(grey), 0.5), {texels()}), "no image gives base_color");
  has(message(board(grey, false, grey), {texels()}), "has alpha");
  has(message(board(grey), {texels(), texels()}), "listed twice");
  has(message(board(grey), {texels(0, 2)}), "no interval inside [0, 1]");
  has(message(board(grey), {texels(0.6)}), "'Wood' holds 0.5, outside its bounds [0.6, 1]");
  UnknownParameter started = texels();
  started.start = {0.3};
  has(message(board(grey), {started}), "leave start out");
}

}  // namespace
}  // namespace selenite
