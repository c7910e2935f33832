// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/problem/fields.h"

#include <gtest/gtest.h>

#include <numeric>

#include "fit/evaluate/field_loss.h"
#include "fit/run/fit.h"
#include "fit/smoke.h"
#include "fit/taken_photos.h"
#include "math/error.h"
#include "scene/small_scenes.h"

namespace selenite {
namespace {

constexpr int kSize = 8;

/// The same smoke with one albedo and 2 x 2 x 2 densities.
Scene cloud(const std::vector<float>& density, double albedo = 0.8) {
  Scene scene = smoke(std::vector<float>(kSize, 0.5f));
  Material& m = scene.appearance.materials[0];
  m.values.albedo = Color<double>(albedo);
  m.density_grid = {std::make_shared<Grid>("density", std::array<int, 3>{2, 2, 2}, 1, density),
                    m.albedo_grid.to_unit};
  m.albedo_grid = {};
  return scene;
}
UnknownParameter density_unknown(double maximum = 5) {
  return {"Smoke", "density_grid", {}, 0, maximum, 0.03};
}

RenderSettings settings_of(int spp, std::uint64_t seed) {
  return square_settings(kSize, spp, seed);
}

std::vector<Photo> photos_of(const Scene& scene, int spp = 400) {
  return taken_photos(scene, kSize, spp);
}

double mean_error(const Vector& voxels, const std::vector<float>& truth) {
  double sum = 0;
  for (std::size_t v = 0; v < truth.size(); ++v)
    sum += std::abs(voxels[static_cast<Eigen::Index>(v)] - truth[v]);
  return sum / static_cast<double>(truth.size());
}

UnknownParameter grid_unknown(double minimum = 0, double maximum = 1) {
  return {"Smoke", "albedo_grid", {}, minimum, maximum, 0.03};
}

class FieldsLoss : public testing::TestWithParam<int> {};

TEST_P(FieldsLoss, GradientAddsUpToThatOfOneAlbedo) {
  const Loss& loss = losses()[static_cast<std::size_t>(GetParam())];
  const Scene grid = smoke(std::vector<float>(24, 0.6f), 3);
  Scene plain = grid;
  plain.appearance.materials[0].albedo_grid = {};
  plain.appearance.materials[0].values.albedo = Color<double>(double(0.6f));
  const Photo photo = photos_of(smoke(std::vector<float>(8, 0.9f)), 16)[0];
  const Fields fields(grid, {grid_unknown()});
  const FieldGradient found = loss_field_gradient(grid, grid.cameras[0], fields, photo,
                                                  {loss, photo}, settings_of(16, 7), nullptr);
  const SlotLayout layout(plain, {plain.find("Smoke", "albedo")});
  const Film film = render(plain, plain.cameras[0], layout, settings_of(16, 7));
  const Vector want = loss_gradient(layout, film, loss.evaluate(film, photo));
  for (int c = 0; c < 3; ++c) {
    double sum = 0;
    for (std::size_t v = 0; v < 8; ++v) sum += found.fields[0][3 * v + static_cast<std::size_t>(c)];
    // The same paths, but for rounding.
    EXPECT_NEAR(sum, want[c], 2e-3 * std::abs(want[c])) << loss.name << " " << c;
    EXPECT_NE(want[c], 0);
  }
}
INSTANTIATE_TEST_SUITE_P(Losses, FieldsLoss, testing::Range(0, static_cast<int>(losses().size())));

FitSettings settings_of(int iterations, int spp) {
  FitSettings settings;
  settings.iterations = iterations;
  settings.spp = spp;
  settings.tolerance = 0;
  settings.threads = 1;
  settings.validation_interval = 20;
  return settings;
}

TEST(FieldsFit, FindsTheGridFromTwoPhotos) {
  const std::vector<float> truth = {0.9f, 0.2f, 0.8f, 0.3f, 0.7f, 0.1f, 0.95f, 0.4f};
  const Scene start = smoke(std::vector<float>(8, 0.5f));
  FitSettings settings = settings_of(60, 8);
  Fit fit(start, photos_of(smoke(truth)), {grid_unknown()}, settings);
  EXPECT_EQ(fit.strategy().optimiser.name, "adam");
  while (fit.step()) {
  }
  const FitResult& result = fit.result();
  ASSERT_EQ(result.stopped, StopReason::kIterations) << result.message;
  ASSERT_EQ(result.history.size(), 61u);
  EXPECT_LT(result.best_validation, 0.05 * result.history[0].validation);
  const double error = mean_error((*result.fields_best)[0], truth);
  const double before = mean_error(Vector::Constant(8, 0.5), truth);
  EXPECT_LT(error, 0.3 * before);
  const double mean = std::accumulate(truth.begin(), truth.end(), 0.0) / 8;
  EXPECT_NEAR(result.history.back().field_means[0].g, mean, 0.06);
}

TEST(FieldsFit, FindsTheDensitiesFromTwoPhotos) {
  const std::vector<float> truth = {1.5f, 0.2f, 0.8f, 0, 1, 0.3f, 0, 1.2f};
  // From fog everywhere, and from nothing at all: an empty voxel is free to fill.
  for (const float start : {0.6f, 0.0f}) {
    const FitSettings settings = settings_of(100, 16);
    Fit fit(cloud(std::vector<float>(8, start)), photos_of(cloud(truth)), {density_unknown()},
            settings);
    while (fit.step()) {
    }
    const FitResult& result = fit.result();
    ASSERT_EQ(result.stopped, StopReason::kIterations) << result.message;
    EXPECT_LT(result.best_validation, 0.1 * result.history[0].validation);
    double error = 0, before = 0;
    for (int v = 0; v < 8; ++v) {
      error += std::abs((*result.fields_best)[0][v] - truth[v]) / 8;
      before += std::abs(start - truth[v]) / 8;
      EXPECT_TRUE(truth[v] <= 0.5f || (*result.fields_best)[0][v] > 0.1) << v;
    }
    RecordProperty("error of " + std::to_string(before), std::to_string(error));
    // From nothing it takes longer: a voxel may move 0.03 a step.
    EXPECT_LT(error, (start > 0 ? 0.35 : 0.75) * before) << before;
    EXPECT_GE((*result.fields_last)[0].minCoeff(), 0);
  }
}

TEST(FieldsFit, BothGridsOfAMaterialAreFittedTogether) {
  Scene truth = smoke({0.9f, 0.2f, 0.8f, 0.3f, 0.7f, 0.1f, 0.95f, 0.4f});
  const Scene dense = cloud({1.5f, 0.5f, 0.8f, 0.4f, 1, 0.6f, 0.3f, 1.2f});
  truth.appearance.materials[0].density_grid = dense.appearance.materials[0].density_grid;
  const GridRef albedo{0, GridKind::kAlbedo}, density{0, GridKind::kDensity};
  const Scene start = truth.with_grid(albedo, std::vector<float>(8, 0.5f))
                          .with_grid(density, std::vector<float>(8, 0.8f));
  FitSettings settings = settings_of(60, 16);
  Fit fit(start, photos_of(truth), {grid_unknown(), density_unknown()}, settings);
  EXPECT_EQ(fit.fields().names(),
            (std::vector<std::string>{"Smoke:albedo_grid", "Smoke:density_grid"}));
  while (fit.step()) {
  }
  const FitResult& result = fit.result();
  ASSERT_EQ(result.stopped, StopReason::kIterations) << result.message;
  EXPECT_LT(result.best_validation, 0.05 * result.history[0].validation);
  const auto& want = truth.grid(albedo).grid->values();
  const double error = mean_error((*result.fields_best)[0], want);
  const double before = mean_error(Vector::Constant(8, 0.5), want);
  // Two photos tell the densities less well: what is bright may be dense or near.
  EXPECT_LT(error, 0.4 * before);
  EXPECT_GT(((*result.fields_best)[1].array() - 0.8).abs().minCoeff(), 0);
}

/// Both grid and extinction unknown, from 3 times the extinction.
UnknownParameter extinction_unknown() { return {"Smoke", "extinction", {6, 6, 6}, 0.1, 20, 0.03}; }

FitResult fit_both(const char* optimiser, const std::vector<float>& truth) {
  FitSettings settings = settings_of(60, 8);
  settings.optimiser = optimiser;
  settings.search = "off";
  Fit fit(smoke(std::vector<float>(8, 0.5f)), photos_of(smoke(truth)),
          {extinction_unknown(), grid_unknown()}, settings);
  EXPECT_EQ(fit.strategy().optimiser.name,
            optimiser == std::string("auto") ? "gauss-newton" : optimiser);
  while (fit.step()) {
  }
  EXPECT_EQ(fit.result().stopped, StopReason::kIterations) << fit.result().message;
  return fit.result();
}

TEST(FieldsFit, TakesTurnsWithWhatItSharesTheObjectWith) {
  const std::vector<float> truth = {0.9f, 0.2f, 0.8f, 0.3f, 0.7f, 0.1f, 0.95f, 0.4f};
  const FitResult result = fit_both("auto", truth), adam = fit_both("adam", truth);
  EXPECT_LT((result.best.array() - 2).abs().maxCoeff(), 0.3);
  EXPECT_GT((adam.best.array() - 2).abs().maxCoeff(), 2) << "a rate of 0.03 an iteration";
  const double error = mean_error((*result.fields_best)[0], truth);
  const double before = mean_error(Vector::Constant(8, 0.5), truth);
  EXPECT_LT(error, 0.4 * before);
  // Five iterations each: scalars move in the first, the grid in the second.
  EXPECT_NE(result.history[5].values, result.history[0].values);
  EXPECT_EQ(result.history[5].field_means[0].g, result.history[0].field_means[0].g);
  EXPECT_EQ(result.history[10].values, result.history[5].values);
  EXPECT_NE(result.history[10].field_means[0].g, result.history[5].field_means[0].g);
}

TEST(FieldsFit, ASearchFindsTheOneAlbedoThatSuitsAllVoxels) {
  // The truth is even, as the start is: where the search ends is the answer.
  const std::vector<float> truth(8, 0.8f);
  FitSettings settings = settings_of(10, 8);
  Fit fit(smoke(std::vector<float>(8, 0.1f)), photos_of(smoke(truth)),
          {extinction_unknown(), grid_unknown()}, settings);
  ASSERT_TRUE(fit.step());
  EXPECT_EQ(fit.result().phase, PhaseKind::kMultiStart);
  while (fit.result().phase == PhaseKind::kMultiStart) ASSERT_TRUE(fit.step());
  EXPECT_GT(fit.result().search.points, 64);
  EXPECT_TRUE(fit.result().search.moved);
  const Vector found = (*fit.result().fields_last)[0];
  EXPECT_EQ(found, Vector::Constant(8, found[0]));
  EXPECT_NEAR(found[0], 0.8, 0.05);
  EXPECT_NEAR(fit.values().mean(), 2, 0.4);
  // Then voxels, from there. What is known of the scalars comes from the last three iterations.
  const Vector before = fit.values();
  while (fit.step())
    if (fit.result().iterations <= 7) {
      EXPECT_EQ(fit.values(), before);
    }
  EXPECT_NE(fit.values(), before) << "the last three iterations are the scalars'";
  EXPECT_LT(mean_error((*fit.result().fields_best)[0], truth), 0.1);
  EXPECT_EQ(fit.result().report.components.size(), 0u) << "grids are not verified";
}

TEST(FieldsFit, AfterASearchEachPhotoMakesAStepThatBeginsLong) {
  for (const std::size_t count : {1u, 2u}) {
    std::vector<Photo> photos = photos_of(smoke(std::vector<float>(8, 0.7f)));
    photos.resize(count);
    check_photos(smoke(std::vector<float>(8, 0.5f)), photos);
    Fit fit(smoke(std::vector<float>(8, 0.5f)), photos, {extinction_unknown(), grid_unknown()},
            settings_of(15, 8));
    while (fit.result().iterations == 0 && fit.result().phase != PhaseKind::kDescent)
      ASSERT_TRUE(fit.step());
    const Vector found = (*fit.result().fields_last)[0];
    ASSERT_TRUE(fit.step());
    const Vector moved = ((*fit.result().fields_last)[0] - found).cwiseAbs();
    const double one = 4 * 0.03 / std::sqrt(static_cast<double>(count));
    if (count == 1) {
      EXPECT_LT((moved.array() - one).abs().maxCoeff(), 1e-6) << "Adam's first step";
    } else {
      // The second goes with the first or against it, and then is shorter.
      EXPECT_GT((moved.array() - one).abs().minCoeff(), 1e-3);
      EXPECT_LE(moved.maxCoeff(), 2 * one + 1e-6);
      EXPECT_GT(moved.maxCoeff(), one + 1e-3);
    }
  }
}

TEST(FieldsFit, SearchesOnlyWhereNothingIsKnownOfTheVoxels) {
  const std::vector<float> known = {0.5f, 0.5f, 0.5f, 0.5f, 0.5f, 0.5f, 0.5f, 0.6f};
  const std::vector<UnknownParameter> both = {extinction_unknown(), grid_unknown()};
  const auto searches = [&](const std::vector<float>& start,
                            const std::vector<UnknownParameter>& wanted, const char* search) {
    FitSettings settings = settings_of(1, 2);
    settings.search = search;
    const Scene scene = smoke(start);
    return Fit(scene, photos_of(scene, 1), wanted, settings).result().phase ==
           PhaseKind::kMultiStart;
  };
  const std::vector<float> even(8, 0.5f);
  EXPECT_TRUE(searches(even, both, "auto"));
  EXPECT_TRUE(searches(even, both, "on"));
  EXPECT_FALSE(searches(even, both, "off"));
  EXPECT_FALSE(searches(known, both, "auto"));
  EXPECT_FALSE(searches(even, {grid_unknown()}, "auto"));
  EXPECT_THROW(searches(known, both, "on"), InvalidArgument);
}

TEST(FieldsFit, TurnsGoOnToTheSameBits) {
  FitSettings settings;
  settings.iterations = 8;  // four each
  settings.spp = 2;
  settings.tolerance = 0;
  settings.threads = 1;
  const std::vector<UnknownParameter> wanted = {extinction_unknown(), grid_unknown()};
  const std::vector<Photo> photos = photos_of(smoke(std::vector<float>(8, 0.9f)), 16);
  const Scene start = smoke(std::vector<float>(8, 0.5f));
  for (const int at : {2, 4, 6}) {
    Fit whole(start, photos, wanted, settings), second(start, photos, wanted, settings);
    std::string saved;
    while (whole.step())
      if (whole.result().iterations == at) saved = whole.saved();
    second.restore(saved);
    while (second.step()) {
    }
    EXPECT_EQ(whole.values(), second.values()) << at;
    EXPECT_EQ((*whole.result().fields_last)[0], (*second.result().fields_last)[0]) << at;
  }
}

TEST(FieldsFit, GoesTogetherWithOneValueAndWithEitherCamerasOrder) {
  const Scene start = smoke(std::vector<float>(8, 0.5f));
  for (const bool accumulate : {true, false}) {
    FitSettings settings;
    settings.iterations = 3;
    settings.spp = 2;
    settings.tolerance = 0;
    settings.accumulate = accumulate;
    settings.threads = accumulate ? 1 : 2;
    const std::vector<Photo> photos = photos_of(smoke(std::vector<float>(8, 0.9f)), 16);
    const std::vector<UnknownParameter> wanted = {{"Smoke", "extinction", {2, 2, 2}, 0.1, 10, 0.03},
                                                  grid_unknown()};
    Fit fit(start, photos, wanted, settings);
    while (fit.step()) {
    }
    ASSERT_EQ(fit.result().stopped, StopReason::kIterations) << fit.result().message;
    EXPECT_NE(fit.values()[0], 2);
    EXPECT_NE((*fit.result().fields_last)[0][0], 0.5);
    settings.threads = 3 - settings.threads;
    Fit again(start, photos, wanted, settings);
    while (again.step()) {
    }
    EXPECT_EQ(fit.values(), again.values());
    EXPECT_EQ((*fit.result().fields_last)[0], (*again.result().fields_last)[0]);
  }
}

TEST(FieldsFit, ABoundIsNoTrap) {
  // From black and from white back inside.
  for (const float start : {0.0f, 1.0f}) {
    FitSettings settings;
    settings.iterations = 6;
    settings.spp = 8;
    settings.tolerance = 0;
    settings.threads = 1;
    Fit fit(smoke(std::vector<float>(8, start)), photos_of(smoke(std::vector<float>(8, 0.5f)), 64),
            {grid_unknown()}, settings);
    while (fit.step()) {
    }
    const Vector& last = (*fit.result().fields_last)[0];
    EXPECT_NEAR(last.mean(), start == 0 ? 0.18 : 0.82, 0.05);
    EXPECT_GE(last.minCoeff(), 0);
    EXPECT_LE(last.maxCoeff(), 1);
  }
}

TEST(FieldsFit, NamesAllThatIsWrong) {
  const Scene scene = smoke(std::vector<float>(8, 0.5f));
  const auto message = [&](const std::vector<UnknownParameter>& wanted, const char* optimiser) {
    FitSettings settings;
    settings.optimiser = optimiser;
    try {
      const Fit fit(scene, photos_of(scene, 1), wanted, settings);
    } catch (const InvalidArgument& error) {
      return std::string(error.what());
    } catch (const UnknownName& error) {
      return std::string("name: ") + error.what();
    }
    return std::string("accepted");
  };
  const auto has = [](const std::string& text, const char* words) {
    EXPECT_NE(text.find(words), std::string::npos) << text;
  };
  has(message({{"Fog", "albedo_grid", {}, 0, 1, 0.03}}, "auto"), "name: 'Fog' is no material");
  has(message({grid_unknown(), grid_unknown()}, "auto"), "listed twice");
  has(message({grid_unknown(0, 2)}, "auto"), "no interval inside [0, 1]");
  has(message({grid_unknown(0.6, 1)}, "auto"), "holds 0.5, outside its bounds [0.6, 1]");
  has(message({grid_unknown()}, "gauss-newton"), "cannot fit a grid");
  has(message({density_unknown()}, "auto"), "no such grid; give it one, or fit its extinction");
  has(message({{"Smoke", "albedo", {0.5, 0.5, 0.5}, 0, 1, 0.03}}, "auto"), "fit albedo_grid");
}

}  // namespace
}  // namespace selenite
