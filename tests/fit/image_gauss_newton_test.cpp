// SPDX-License-Identifier: GPL-3.0-or-later
// Texels of an image stepped together with scalars.
#include <gtest/gtest.h>

#include <random>

#include "fit/image_scenes.h"
#include "fit/problem/pixel_weights.h"
#include "fit/problem/saved_state.h"
#include "fit/solver/field_gauss_newton.h"
#include "fit/solver/joint_gauss_newton.h"
#include "fit/taken_photos.h"
#include "math/draws.h"

namespace selenite {
namespace {

constexpr int kSide = 24, kAlong = 12;
constexpr Eigen::Index kNumbers = 3 * kAlong * kAlong, kRows = 3 * kSide * kSide;

Scene with_texels() {
  Scene scene = board({0.5f, 0.5f, 0.5f, 0.5f});
  FieldMap& map = scene.appearance.materials[0].maps[0];
  map.texture = std::make_shared<Texture>(
      "Wood", kAlong, kAlong, std::vector<Colorf>(kAlong * kAlong, Colorf(0.5f)),
      std::vector<float>{}, false, Extension::kExtend, Interpolation::kLinear);
  return scene;
}

/// Photos of a world that is linear in texels and two scalars. Each pixel sees four texels that
/// lie beside each other, and its neighbours see some of them, too.
struct LinearImage {
  Scene scene = with_texels();
  std::vector<Photo> photos;
  Fields fields{scene, {texels()}};
  std::unique_ptr<FieldGaussNewton> newton;
  std::vector<PlaceSlopes> slopes;
  std::vector<InstrumentalVariables::Set> z;  ///< of what texels explain, and of single pixels
  std::vector<Eigen::VectorXf> weights;
  std::mt19937 random;
  Normal<float> normal;

  explicit LinearImage(std::size_t count = 4, bool by_agreement = true, unsigned seed = 5)
      : photos(grey_photos(scene, count)),
        newton(FieldGaussNewton::of(fields, photos, {.by_agreement = by_agreement})),
        random(seed) {
    newton->set_values(fields.start());
    std::uniform_real_distribution<float> some(0.5f, 1.5f);
    for (std::size_t i = 0; i < photos.size(); ++i) {
      PlaceSlopes seen(kSide * kSide);
      for (int p = 0; p < kSide * kSide; ++p) {
        const int x = std::min(p % kSide / 2, kAlong - 2), y = std::min(p / kSide / 2, kAlong - 2);
        for (const int texel :
             {y * kAlong + x, y * kAlong + x + 1, (y + 1) * kAlong + x, (y + 1) * kAlong + x + 1})
          seen[static_cast<std::size_t>(p)].push_back(
              {static_cast<std::uint32_t>(texel), {some(random), some(random), some(random)}});
      }
      slopes.push_back(seen);
      newton->gather(i, {{}, {CellJacobian(kSide * kSide, 0)}, {seen}});
      InstrumentalVariables::Half half;
      half.slopes = Jacobian::NullaryExpr(kRows, 2, [&](auto...) { return normal(random); });
      half.slopes.col(0) = shown(i, pattern());
      half.filtered = half.slopes;
      z.push_back({half, half});
      weights.push_back(relative_weights(photos[i], photos.size()));
    }
  }

  static std::vector<Photo> grey_photos(const Scene& scene, std::size_t count = 4) {
    std::vector<Photo> all(count, taken_photos(scene, kSide, 1)[0]);
    for (std::size_t i = 0; i < all.size(); ++i) {
      all[i].id = std::to_string(i);
      all[i].reference.assign(all[i].size(), Colorf(0.5f));
    }
    return all;
  }
  static Vector pattern() {
    return Vector::NullaryExpr(
        kNumbers, [](Eigen::Index k) { return 0.2 * std::sin(0.7 * static_cast<double>(k)); });
  }
  /// What photo i shows of texels that are off by so much.
  Eigen::VectorXf shown(std::size_t i, const Vector& off) const {
    Eigen::VectorXf sum = Eigen::VectorXf::Zero(kRows);
    for (Eigen::Index row = 0; row < kRows; ++row)
      for (const auto& [texel, slope] : slopes[i][static_cast<std::size_t>(row / 3)])
        sum[row] += slope[static_cast<int>(row % 3)] *
                    static_cast<float>(off[3 * static_cast<Eigen::Index>(texel) + row % 3]);
    return sum;
  }
  /// Residuals where texels and scalars are off by so much, with errors that no photo shares.
  void add_residuals(const Vector& off, const Eigen::Vector2d& scalars, float error = 0,
                     double keep = 0) {
    for (std::size_t i = 0; i < photos.size(); ++i) {
      Halves halves;
      halves.residual_a = z[i].a.slopes * scalars.cast<float>() + shown(i, off);
      for (Eigen::Index row = 0; row < kRows; ++row)
        halves.residual_a[row] += error * normal(random);
      halves.residual_b = halves.residual_a;
      halves.variance = Eigen::VectorXf::Zero(kRows);
      newton->add_residual(i, halves, weights[i], keep);
    }
  }
  void eliminate() {
    newton->solve(1);
    std::vector<FieldGaussNewton::Regressors> all;
    for (std::size_t i = 0; i < z.size(); ++i) all.push_back({&z[i], &weights[i]});
    (void)newton->eliminate_fields(all);
  }
};

TEST(ImageGaussNewton, InstrumentsAreBlindToWhatTexelsCanCompensateFor) {
  LinearImage world;
  world.add_residuals(Vector::Zero(kNumbers), {0, 0}, 1e-3f);
  const float explained = world.z[0].a.filtered.col(0).norm(),
              other = world.z[0].a.filtered.col(1).norm();
  const Vector off = LinearImage::pattern().reverse();
  const auto moves = [&](Eigen::Index scalar) {
    double sum = 0;
    for (std::size_t i = 0; i < world.z.size(); ++i)
      sum +=
          world.weights[i].cwiseProduct(world.z[i].a.filtered.col(scalar)).dot(world.shown(i, off));
    return std::abs(sum);
  };
  const double first = moves(0), second = moves(1);
  world.eliminate();
  EXPECT_LT(world.z[0].a.filtered.col(0).norm(), 0.01 * explained);
  EXPECT_GT(world.z[0].a.filtered.col(1).norm(), 0.9 * other) << "texels make no single pixels";
  EXPECT_LT(moves(0), 0.01 * first);
  EXPECT_LT(moves(1), 0.01 * second);
}

TEST(ImageGaussNewton, TexelsGoWhereTheyAreTogetherWithTheScalars) {
  LinearImage world;
  const Vector off = LinearImage::pattern();
  const Eigen::Vector2d scalars{0.3, 0};
  world.add_residuals(off, scalars);
  world.eliminate();
  world.newton->advance(-scalars);
  EXPECT_LT(
      (world.newton->values()[0] - (Vector::Constant(kNumbers, 0.5) - off)).cwiseAbs().maxCoeff(),
      0.01);
}

/// What photos disagree on is error, whatever part of it texels take up; what they agree on is none.
TEST(ImageGaussNewton, ThePriorCountsByWhatPhotosDisagreeOn) {
  LinearImage noisy;
  noisy.add_residuals(Vector::Zero(kNumbers), {0, 0}, 0.05f);
  noisy.newton->solve(1);
  const double share = noisy.weights[0][0], variance = share * 0.05 * 0.05;
  EXPECT_NEAR(noisy.newton->prior_strength(), variance, 0.1 * variance);
  LinearImage patterned;
  patterned.add_residuals(LinearImage::pattern(), {0, 0}, 0.005f);
  patterned.newton->solve(1);
  EXPECT_NEAR(patterned.newton->prior_strength(), 0.01 * variance, 0.004 * variance);
}

/// Texels explain no background: its noise must not smooth them.
TEST(ImageGaussNewton, TheNoiseOfABackgroundIsNoErrorOfTexels) {
  LinearImage world;
  const auto is_background = [](Eigen::Index pixel) { return pixel % kSide < kSide / 4; };
  world.newton = FieldGaussNewton::of(world.fields, world.photos);
  world.newton->set_values(world.fields.start());
  for (std::size_t i = 0; i < world.photos.size(); ++i) {
    for (Eigen::Index pixel = 0; pixel < kSide * kSide; ++pixel)
      if (is_background(pixel)) world.slopes[i][static_cast<std::size_t>(pixel)].clear();
    world.newton->gather(i, {{}, {CellJacobian(kSide * kSide, 0)}, {world.slopes[i]}});
    Halves halves;
    halves.residual_a.resize(kRows);
    for (Eigen::Index row = 0; row < kRows; ++row)
      halves.residual_a[row] = world.normal(world.random) * (is_background(row / 3) ? 5 : 0.05f);
    halves.residual_b = halves.residual_a;
    halves.variance = Eigen::VectorXf::Zero(kRows);
    world.newton->add_residual(i, halves, world.weights[i], 0);
  }
  world.newton->solve(1);
  const double variance = world.weights[0][0] * 0.05 * 0.05;
  EXPECT_NEAR(world.newton->prior_strength(), variance, 0.1 * variance);
}

/// The variance of a weighted mean: of one sample and four later ones, and of a mean that forgets half.
TEST(ImageGaussNewton, MeansOfResidualsHaveTheNoiseOfTheirSamples) {
  const auto strength = [](double keep, double samples) {
    LinearImage world;
    for (const double count : {1.0, samples})
      for (std::size_t i = 0; i < world.photos.size(); ++i) {
        Halves halves;
        halves.residual_a = halves.residual_b = Eigen::VectorXf::Zero(kRows);
        halves.variance = Eigen::VectorXf::Constant(kRows, static_cast<float>(0.02 / count));
        world.newton->add_residual(i, halves, world.weights[i], keep, count);
      }
    world.newton->solve(1);
    return world.newton->prior_strength() / world.weights[0][0];
  };
  EXPECT_NEAR(strength(1, 4), 0.01 / 5, 1e-6);
  EXPECT_NEAR(strength(0.5, 1), 0.01 * 5 / 9, 1e-6);
}

TEST(ImageGaussNewton, ThePriorCountsByTheWholeMisfitWhereThatIsAskedFor) {
  LinearImage asked(4, false);
  asked.add_residuals(LinearImage::pattern(), {0, 0}, 0.005f);
  asked.newton->solve(1);
  double sum = 0;
  for (std::size_t i = 0; i < asked.photos.size(); ++i)
    for (Eigen::Index row = 1; row < kRows; row += 3)
      sum += std::pow(asked.shown(i, LinearImage::pattern())[row], 2);
  const double mean = asked.weights[0][0] * sum / (4 * kSide * kSide);
  EXPECT_NEAR(asked.newton->prior_strength(), mean, 0.02 * mean);
}

TEST(ImageGaussNewton, TellsWhatPatternIsLeft) {
  LinearImage noisy, patterned;
  noisy.add_residuals(Vector::Zero(kNumbers), {0, 0}, 0.05f);
  patterned.add_residuals(LinearImage::pattern(), {0, 0}, 0.001f);
  for (LinearImage* one : {&noisy, &patterned}) one->newton->solve(1);
  EXPECT_LT(noisy.newton->pattern_left(), 0.05);
  EXPECT_GT(patterned.newton->pattern_left(), 0.99);
}

/// Four pixels see each texel once: texels take up a quarter of the errors.
TEST(ImageGaussNewton, TexelsTakeDegreesOfFreedomFromTheErrorsOfOnePhoto) {
  double sum = 0, expected = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    LinearImage noisy(1);
    noisy.random.seed(seed);
    noisy.add_residuals(Vector::Zero(kNumbers), {0, 0}, 0.05f);
    noisy.newton->solve(1);
    sum += noisy.newton->prior_strength();
    expected += noisy.weights[0][0] * 0.05 * 0.05;
  }
  EXPECT_NEAR(sum, expected, 0.1 * expected);
}

TEST(ImageGaussNewton, SlopesAreMeansOverIterations) {
  LinearImage world;
  for (int i = 0; i < 3; ++i)
    for (std::size_t photo = 0; photo < world.slopes.size(); ++photo)
      world.newton->gather(photo, {{}, {CellJacobian(kSide * kSide, 0)}, {world.slopes[photo]}});
  world.add_residuals(Vector::Constant(kNumbers, 0.1), {0, 0}, 1e-3f);
  world.newton->solve(1);
  world.newton->advance(Eigen::Vector2d::Zero());
  EXPECT_NEAR((world.fields.start()[0] - world.newton->values()[0]).mean(), 0.1, 0.005);
}

/// Slopes too small to be kept one by one count by their sum.
TEST(ImageGaussNewton, LightThatAllTexelsReflectALittleCounts) {
  LinearImage world;
  const float small = 0.2f * FieldGaussNewtonOptions{}.least_share;
  for (std::size_t photo = 0; photo < world.slopes.size(); ++photo) {
    for (auto& cell : world.slopes[photo]) {
      std::vector<bool> seen(kAlong * kAlong, false);
      for (const PlaceSlope& one : cell) seen[one.place] = true;
      for (std::uint32_t texel = 0; texel < seen.size(); ++texel)
        if (!seen[texel]) cell.push_back({texel, Colorf(small)});
    }
    world.newton->gather(photo, {{}, {CellJacobian(kSide * kSide, 0)}, {world.slopes[photo]}}, 1e6);
  }
  const float far = small * (kAlong * kAlong - 4);
  ASSERT_GT(far, 0.2f) << "beside four of about 1";
  world.add_residuals(Vector::Constant(kNumbers, 0.1), {0, 0}, 1e-3f);
  world.newton->solve(1);
  world.newton->advance(Eigen::Vector2d::Zero());
  EXPECT_NEAR((world.fields.start()[0] - world.newton->values()[0]).mean(), 0.1, 0.003);
}

/// The mean distance of texels from their mean, after a step by what photos agree on and one by errors.
double spread_by_errors(LinearImage& world) {
  for (const float error : {0.001f, 50.f}) {
    world.add_residuals(Vector::Constant(kNumbers, 0.1), {0, 0}, error);
    const Vector before = world.newton->values()[0];
    world.newton->solve(1);
    world.newton->advance(Eigen::Vector2d::Zero());
    const double moved = (world.newton->values()[0] - before).cwiseAbs().mean();
    if (error < 1) {
      EXPECT_NEAR(moved, 0.1, 0.01) << "the mean is free";
    }
  }
  return (world.newton->values()[0].array() - world.newton->values()[0].mean()).abs().mean();
}

TEST(ImageGaussNewton, ErrorsThatPhotosDoNotShareLeaveTexelsNearTheirMean) {
  LinearImage world;
  EXPECT_LT(spread_by_errors(world), 0.1);
}

/// In one world it is chance how far they go: 0.05 to 0.2.
TEST(ImageGaussNewton, ErrorsLeaveTexelsOfManyWorldsNearTheirMean) {
  constexpr unsigned kWorlds = 12;
  double sum = 0;
  for (unsigned seed = 1; seed <= kWorlds; ++seed) {
    LinearImage world(4, true, seed);
    sum += spread_by_errors(world);
  }
  EXPECT_LT(sum / kWorlds, 0.17);
}

/// Noise that a residual and the derivatives of the same samples share looks like a slope: texels would
/// follow it.
TEST(ImageGaussNewton, ResidualsMeetDerivativesOfOtherSamples) {
  const LinearImage world;
  const Unknowns none(world.scene, {texels()});
  const SlotLayout layout = none.layout(world.scene);
  const Problem problem{none, layout, world.photos, find_loss("mse"), 60};
  JointGaussNewton solver(problem, world.fields, world.fields.start());
  std::vector<Observation> seen;
  for (std::size_t i = 0; i < world.photos.size(); ++i) {
    Film film(kSide, kSide, 16, 0);
    film.mean.assign(film.size(), Colorf(0.6f));
    film.half_a = film.mean;
    seen.push_back({static_cast<int>(i), std::move(film), {}});
  }
  const auto gather = [&] {
    for (std::size_t i = 0; i < world.photos.size(); ++i)
      solver.gather_fields(i, {{}, {CellJacobian(kSide * kSide, 0)}, {world.slopes[i]}});
  };
  gather();
  (void)solver.step_by_residuals(Vector(0), seen);
  EXPECT_EQ(solver.fields()[0], world.fields.start()[0]) << "of no other samples yet";
  gather();
  (void)solver.step_by_residuals(Vector(0), seen);
  EXPECT_LT(solver.fields()[0].maxCoeff(), 0.5) << "photos are darker than these";
}

/// Residuals of three passes have a third of the variance of one.
TEST(ImageGaussNewton, TexelsKnowTheResidualsOfEarlierPasses) {
  const auto error = [](double keep) {
    LinearImage world;
    for (int pass = 0; pass < 3; ++pass)
      world.add_residuals(Vector::Zero(kNumbers), {0, 0}, 0.02f, keep);
    world.newton->solve(1);
    world.newton->advance(Eigen::Vector2d::Zero());
    return (world.newton->values()[0].array() - 0.5).square().mean();
  };
  EXPECT_NEAR(error(1) / error(0), 1.0 / 3, 0.12);
}

TEST(ImageGaussNewton, ASavedSolverStepsToTheSameBits) {
  LinearImage first, second;
  second.newton = FieldGaussNewton::of(second.fields, second.photos);  // as a resumed fit does
  first.add_residuals(LinearImage::pattern(), {0.1, 0}, 0.01f);
  SavedState writing;
  first.newton->members(writing);
  SavedState reading(writing.sealed());
  second.newton->members(reading);
  for (LinearImage* one : {&first, &second}) {
    one->newton->solve(0.5);
    one->newton->advance(Eigen::VectorXd(0));
  }
  EXPECT_EQ(first.newton->values()[0], second.newton->values()[0]);
}

/// Photos that tell no single texels tell means of four.
TEST(ImageGaussNewton, ManyTexelsAreSolvedForOnACoarserLattice) {
  const LinearImage world;
  FieldGaussNewtonOptions few;
  few.most_texels = kAlong * kAlong / 4;
  FieldValues start = world.fields.start();
  start[0][0] += 0.1;  // detail of the start
  const auto newton = FieldGaussNewton::of(world.fields, world.photos, few);
  newton->set_values(start);
  for (std::size_t i = 0; i < world.photos.size(); ++i) {
    newton->gather(i, {{}, {CellJacobian(kSide * kSide, 0)}, {world.slopes[i]}});
    Halves halves;
    halves.residual_a = halves.residual_b = world.shown(i, Vector::Constant(kNumbers, 0.1));
    halves.variance = Eigen::VectorXf::Zero(kRows);
    newton->add_residual(i, halves, world.weights[i], 0);
  }
  newton->solve(1);
  newton->advance(Eigen::VectorXd(0));
  const Vector moved = newton->values()[0] - start[0];
  EXPECT_LT((moved.array() + 0.1).abs().maxCoeff(), 2e-3) << "the detail moves along";
}

}  // namespace
}  // namespace selenite
