// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/field_gauss_newton.h"

#include <gtest/gtest.h>

#include <map>
#include <numeric>
#include <random>

#include "fit/problem/pixel_weights.h"
#include "fit/run/fit.h"
#include "fit/smoke.h"
#include "fit/taken_photos.h"
#include "math/draws.h"

namespace selenite {
namespace {

constexpr int kSide = 32;
constexpr Eigen::Index kCells = 16, kNumbers = 24, kRows = 3 * kSide * kSide;

Scene coloured_smoke(const std::vector<float>& albedo) { return smoke(albedo, 3); }

UnknownParameter grid_unknown() { return {"Smoke", "albedo_grid", {}, 0, 1, 0.03}; }
std::vector<UnknownParameter> extinction_and_grid() {
  return {{"Smoke", "extinction", {5, 5, 5}, 0.1, 20, 0.1}, grid_unknown()};
}

std::vector<Photo> grey_photos() {
  std::vector<Photo> photos = taken_photos(coloured_smoke(std::vector<float>(24, 0.5f)), kSide, 1);
  for (Photo& photo : photos) photo.reference.assign(photo.size(), Colorf(0.5f));
  return photos;
}

/// Two photos of a world that is linear in 24 numbers and two scalars: what `FieldGaussNewton` gathers.
struct LinearWorld {
  std::vector<Photo> photos = grey_photos();
  Fields fields{coloured_smoke(std::vector<float>(24, 0.5f)), {grid_unknown()}};
  std::unique_ptr<FieldGaussNewton> newton = FieldGaussNewton::of(fields, photos);
  std::vector<CellJacobian> jacobians;
  std::vector<InstrumentalVariables::Set>
      z;  ///< of two scalars: of cells' means only, and of pixels
  std::vector<Eigen::VectorXf> weights;

  explicit LinearWorld(double noise = 0) {
    std::mt19937 random(5);
    Normal<float> normal;
    newton->set_values(fields.start());
    for (const Photo& photo : photos) {
      // A number shows in its own channel, as the cells' Jacobian holds it.
      jacobians.push_back(
          CellJacobian::NullaryExpr(kCells, kNumbers, [&](auto...) { return normal(random); }));
      FieldJacobian jacobian_of_fields;
      jacobian_of_fields.fields = {jacobians.back()};
      newton->gather(z.size(), jacobian_of_fields);
      InstrumentalVariables::Half half;
      half.slopes = Jacobian::NullaryExpr(kRows, 2, [&](auto...) { return normal(random); });
      for (Eigen::Index i = 0; i < kRows; ++i) half.slopes(i, 0) = explained(z.size(), i);
      half.filtered = half.slopes;
      z.push_back({half, half});
      weights.push_back(relative_weights(photo, photos.size()));
    }
    for (std::size_t i = 0; i < photos.size(); ++i)
      add_residual(i, Vector::Zero(kNumbers), {0, 0}, noise);
  }

  static Eigen::Index cell(Eigen::Index row) {
    const Eigen::Index pixel = row / 3;
    return pixel / kSide / 8 * (kSide / 8) + pixel % kSide / 8;
  }
  /// What the voxels' picture is where number k is off by k / 10.
  float explained(std::size_t photo, Eigen::Index row) const {
    float sum = 0;
    for (Eigen::Index k = row % 3; k < kNumbers; k += 3)
      sum += jacobians[photo](cell(row), k) * static_cast<float>(k) / 10;
    return sum;
  }
  /// Residuals where voxels and scalars are off by so much.
  void add_residual(std::size_t photo, const Vector& voxels, const Eigen::Vector2d& scalars,
                    double noise = 0) {
    Halves halves;
    halves.residual_a = z[photo].a.slopes * scalars.cast<float>();
    for (Eigen::Index i = 0; i < kRows; ++i)
      for (Eigen::Index k = i % 3; k < kNumbers; k += 3)
        halves.residual_a[i] += jacobians[photo](cell(i), k) * static_cast<float>(voxels[k]);
    halves.residual_b = halves.residual_a;
    halves.variance = Eigen::VectorXf::Constant(kRows, static_cast<float>(noise * noise));
    newton->add_residual(photo, halves, weights[photo], 0);
  }
  void solve_and_separate() {
    newton->solve(1);
    (void)newton->eliminate_fields({{&z[0], &weights[0]}, {&z[1], &weights[1]}});
  }
  /// Of the instruments of a scalar, by all numbers.
  Eigen::VectorXf seen_by(Eigen::Index scalar) const {
    Eigen::VectorXf sum = Eigen::VectorXf::Zero(kNumbers);
    for (std::size_t photo = 0; photo < z.size(); ++photo)
      for (Eigen::Index i = 0; i < kRows; ++i)
        for (Eigen::Index k = i % 3; k < kNumbers; k += 3)
          sum[k] +=
              weights[photo][i] * z[photo].a.filtered(i, scalar) * jacobians[photo](cell(i), k);
    return sum;
  }
};

TEST(FieldGaussNewton, InstrumentsAreBlindToWhatVoxelsCanCompensateFor) {
  LinearWorld world;
  const Eigen::VectorXf first = world.seen_by(0), second = world.seen_by(1);
  const float explained = world.z[0].a.filtered.col(0).norm(),
              other = world.z[0].a.filtered.col(1).norm();
  world.solve_and_separate();
  EXPECT_LT(world.z[0].a.filtered.col(0).norm(), 0.01 * explained);
  EXPECT_GT(world.z[0].a.filtered.col(1).norm(), 0.95 * other) << "voxels make no single pixels";
  EXPECT_LT(world.seen_by(0).norm(), 0.01 * first.norm());
  EXPECT_LT(world.seen_by(1).norm(), 0.01 * second.norm());
  EXPECT_EQ(world.z[0].a.filtered, world.z[0].b.filtered);
}

/// What pixels in informative say is not taken from them, but the whole photos' instruments make up for it.
TEST(FieldGaussNewton, WithPixelsInFocusBothTogetherAreBlind) {
  LinearWorld world;
  std::mt19937 random(6);
  Normal<float> normal;
  InstrumentalVariables::Set informative = world.z[0];
  for (InstrumentalVariables::Half* half : {&informative.a, &informative.b}) {
    half->filtered.setZero();
    for (Eigen::Index i = 300; i < 330; ++i)
      for (Eigen::Index k = 0; k < 2; ++k) half->filtered(i, k) = 20 * normal(random);
  }
  for (Eigen::Index i = 0; i < kRows; ++i) world.weights[0][i] *= 1 + static_cast<float>(i % 7);
  const Eigen::VectorXf informative_weight = 3 * world.weights[0];
  const auto both = [&](Eigen::Index scalar) {
    Eigen::VectorXf sum = world.seen_by(scalar);
    for (Eigen::Index i = 300; i < 330; ++i)
      for (Eigen::Index k = i % 3; k < kNumbers; k += 3)
        sum[k] += informative_weight[i] * informative.a.filtered(i, scalar) *
                  world.jacobians[0](LinearWorld::cell(i), k);
    return sum;
  };
  const float first = both(0).norm(), second = both(1).norm();
  world.newton->solve(1);
  (void)world.newton->eliminate_fields(
      {{&world.z[0], &world.weights[0], &informative, &informative_weight},
       {&world.z[1], &world.weights[1]}});
  EXPECT_LT(both(0).norm(), 0.01 * first);
  EXPECT_LT(both(1).norm(), 0.01 * second);
  EXPECT_GT(world.seen_by(1).norm(), 0.1 * second) << "that of the whole photos alone is not";
}

TEST(FieldGaussNewton, VoxelsGoWhereTheyAreTogetherWithTheScalars) {
  LinearWorld world;
  Vector off(kNumbers);
  for (Eigen::Index k = 0; k < kNumbers; ++k) off[k] = 0.2 * std::sin(static_cast<double>(k));
  const Eigen::Vector2d scalars{0.03, -0.4};
  for (std::size_t photo = 0; photo < 2; ++photo) world.add_residual(photo, off, scalars);
  world.solve_and_separate();
  world.newton->advance(-scalars);
  EXPECT_LT(
      (world.newton->values()[0] - (Vector::Constant(kNumbers, 0.5) - off)).cwiseAbs().maxCoeff(),
      0.005);
  // And nothing is left: the residuals have moved along.
  const FieldValues there = world.newton->values();
  world.newton->solve(1);
  world.newton->advance(Eigen::Vector2d::Zero());
  EXPECT_LT((world.newton->values()[0] - there[0]).cwiseAbs().maxCoeff(), 0.005);
}

TEST(FieldGaussNewton, StaysInsideTheBoundsAndGoesNoFartherThanAStep) {
  LinearWorld world;
  Vector off = Vector::Constant(kNumbers, 5);
  off.tail(12).setConstant(-5);
  for (int i = 0; i < 3; ++i) {
    const Vector before = world.newton->values()[0];
    for (std::size_t photo = 0; photo < 2; ++photo) world.add_residual(photo, off, {0, 0});
    world.newton->solve(1);
    world.newton->advance(Eigen::Vector2d::Zero());
    EXPECT_LE((world.newton->values()[0] - before).cwiseAbs().maxCoeff(), 0.25 + 1e-12);
  }
  EXPECT_EQ(world.newton->values()[0].head(12), Vector::Zero(12));
  EXPECT_EQ(world.newton->values()[0].tail(12), Vector::Ones(12));
}

TEST(FieldGaussNewton, NoiseLeavesVoxelsWhereTheSearchPutThem) {
  Vector off = Vector::Constant(kNumbers, 0.2);
  const auto moved = [&](double noise) {
    LinearWorld world(noise);
    for (std::size_t photo = 0; photo < 2; ++photo) world.add_residual(photo, off, {0, 0}, noise);
    world.newton->solve(1);
    world.newton->advance(Eigen::Vector2d::Zero());
    return (world.newton->values()[0].array() - 0.5).abs().mean();
  };
  EXPECT_NEAR(moved(0), 0.2, 0.005);
  EXPECT_LT(moved(1000), 0.01);
  EXPECT_GT(moved(5), moved(50));
}

TEST(FieldGaussNewton, IsForFewColouredAlbedosAlone) {
  const std::vector<Photo> photos = grey_photos();
  const Scene scene = coloured_smoke(std::vector<float>(24, 0.5f));
  EXPECT_TRUE(FieldGaussNewton::of(Fields(scene, {grid_unknown()}), photos));
  EXPECT_FALSE(FieldGaussNewton::of(Fields(scene, {}), photos));
  Scene grey = scene;
  Material& m = grey.appearance.materials[0];
  const auto grid_of = [](int side, int channels) {
    const auto count = static_cast<std::size_t>(side) * side * side * channels;
    return std::make_shared<Grid>("albedo", std::array<int, 3>{side, side, side}, channels,
                                  std::vector<float>(count, 0.5f));
  };
  m.albedo_grid.grid = grid_of(2, 1);
  EXPECT_FALSE(FieldGaussNewton::of(Fields(grey, {grid_unknown()}), photos));
  m.albedo_grid.grid = grid_of(13, 3);
  EXPECT_FALSE(FieldGaussNewton::of(Fields(grey, {grid_unknown()}), photos));
}

std::vector<float> chequered() {
  std::vector<float> truth;
  for (int v = 0; v < 8; ++v)
    for (const float value : {v % 2 == 0 ? 0.85f : 0.7f, 0.7f, v % 2 == 0 ? 0.6f : 0.8f})
      truth.push_back(value);
  return truth;
}

TEST(FieldGaussNewton, AFitFindsVoxelsAndExtinctionAndSaysHowSureItIs) {
  const std::vector<float> truth = chequered();
  FitSettings settings;
  settings.iterations = 16;
  settings.spp = 8;
  settings.tolerance = 0;
  settings.threads = 1;
  Fit fit(coloured_smoke(std::vector<float>(24, 0.5f)), taken_photos(coloured_smoke(truth), 24),
          extinction_and_grid(), settings);
  while (fit.step()) {
  }
  const FitResult& result = fit.result();
  EXPECT_EQ(result.stopped, StopReason::kIterations) << result.message;
  EXPECT_EQ(result.iterations, 8) << "the rest goes into the look at the answer";
  const Vector& voxels = (*result.fields_best)[0];
  double error = 0, before = 0;
  const double even = std::accumulate(truth.begin(), truth.end(), 0.0) / 24;
  for (Eigen::Index k = 0; k < kNumbers; ++k) {
    error += std::abs(voxels[k] - truth[static_cast<std::size_t>(k)]) / 24;
    before += std::abs(even - truth[static_cast<std::size_t>(k)]) / 24;
  }
  EXPECT_LT(error, 0.3 * before);
  EXPECT_LT((result.best.array() / 2 - 1).abs().maxCoeff(), 0.05);
  ASSERT_EQ(result.report.components.size(), 3u);
  for (const Confidence& one : result.report.components) {
    EXPECT_TRUE(one.determined);
    EXPECT_LT(one.interval[1] - one.interval[0], 0.4);
    EXPECT_LT(one.interval[0], 2.1);
    EXPECT_GT(one.interval[1], 1.9);
  }
}

TEST(FieldGaussNewton, ASavedFitGoesOnToTheSameBits) {
  FitSettings settings;
  settings.iterations = 10;
  settings.spp = 2;
  settings.tolerance = 0;
  settings.threads = 1;
  const std::vector<Photo> photos = taken_photos(coloured_smoke(chequered()), 16, 16);
  const Scene start = coloured_smoke(std::vector<float>(24, 0.5f));
  Fit whole(start, photos, extinction_and_grid(), settings);
  std::map<int, std::string> saved;  // in blocks of either, and twice in the refinement
  int in_refinement = 0;
  while (whole.step()) {
    const int at = whole.result().iterations;
    if (at == 1 || at == 3) saved.try_emplace(at, whole.saved());
    if (whole.result().phase != PhaseKind::kRefinement) continue;
    saved.insert_or_assign(in_refinement++ < 3 ? 100 : 101, whole.saved());
  }
  ASSERT_EQ(saved.size(), 4u);
  for (const auto& [at, state] : saved) {
    Fit second(start, photos, extinction_and_grid(), settings);
    second.restore(state);
    while (second.step()) {
    }
    EXPECT_EQ(whole.result().best, second.result().best) << at;
    EXPECT_EQ((*whole.result().fields_best)[0], (*second.result().fields_best)[0]) << at;
    ASSERT_EQ(second.result().report.components.size(), 3u);
    EXPECT_EQ(whole.result().report.components[0].interval,
              second.result().report.components[0].interval);
  }
}

}  // namespace
}  // namespace selenite
