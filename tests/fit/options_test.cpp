// SPDX-License-Identifier: GPL-3.0-or-later
// Every Options struct of evaluate, solver and inference is used: other values change what comes out.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "fit/evaluate/finite_differences.h"
#include "fit/evaluate/tiled_loss.h"
#include "fit/inference/informative_pixels.h"
#include "fit/inference/offset_expansion.h"
#include "fit/smoke.h"
#include "fit/solver/adam.h"
#include "fit/solver/field_gauss_newton.h"
#include "fit/solver/gauss_newton.h"
#include "fit/synthetic_renderer.h"
#include "fit/taken_photos.h"
#include "math/parabolic_line_search.h"

namespace selenite {
namespace {

/// Two photos without noise, off the truth.
struct TwoPhotos {
  Scene scene = synthetic_scene();
  std::vector<Photo> photos{synthetic_capture(scene, "Left"), synthetic_capture(scene, "Right")};
  Unknowns unknowns{scene, synthetic_unknowns()};
  SlotLayout layout{unknowns.layout(scene)};
  Problem problem{unknowns, layout, photos, losses()[0], 20};

  TwoPhotos() { check_photos(scene, photos); }
  TwoPhotos(const TwoPhotos&) = delete;  // the problem refers to members
  TwoPhotos& operator=(const TwoPhotos&) = delete;

  std::vector<Observation> seen(const Vector& x, std::uint64_t seed, double noise = 0.2) const {
    RenderSettings settings;
    settings.width = settings.height = kSyntheticSize;
    settings.spp = 4;
    const Scene there = unknowns.scene_with(scene, x);
    std::vector<Observation> both;
    for (int i = 0; i < 2; ++i) {
      settings.seed = 2 * seed + static_cast<std::uint64_t>(i);
      both.push_back(
          {i,
           SyntheticRenderer{noise, noise}(there, scene.cameras[static_cast<std::size_t>(i)],
                                           layout, settings, nullptr),
           {}});
    }
    return both;
  }
  /// The values after so many steps, the start first.
  std::vector<Vector> steps(GaussNewton& solver, int count) const {
    std::vector<Vector> values{unknowns.start()};
    for (int i = 0; i < count; ++i)
      values.push_back(
          solver.step(values.back(), seen(values.back(), static_cast<std::uint64_t>(i))));
    return values;
  }
  double first_step(const GaussNewtonOptions& options) const {
    GaussNewton solver(problem, options);
    const std::vector<Vector> values = steps(solver, 1);
    const Reparametrization& reparametrization = solver.reparametrization();
    return (reparametrization.from_values(values[1]) - reparametrization.from_values(values[0]))
        .norm();
  }
};

TEST(Options, MoreDampingMakesAShorterStep) {
  const TwoPhotos photos;
  GaussNewtonOptions damped;
  damped.damping.early = 100;
  EXPECT_LT(photos.first_step(damped), 0.1 * photos.first_step({}));
  EXPECT_GT(photos.first_step(damped), 0);
}

TEST(Options, TheLongestStepShrinksFromAnEarlierIteration) {
  const TwoPhotos photos;
  GaussNewtonOptions short_steps;
  short_steps.shrink_from = 0.01;
  GaussNewton solver(photos.problem, short_steps);
  const std::vector<Vector> values = photos.steps(solver, 1);
  const Reparametrization& reparametrization = solver.reparametrization();
  const Vector step =
      reparametrization.from_values(values[1]) - reparametrization.from_values(values[0]);
  EXPECT_LE(step.cwiseQuotient(reparametrization.cap()).cwiseAbs().maxCoeff(), 0.01 + 1e-9);
}

TEST(Options, TheEstimateIsTheMeanOfAsManyIterates) {
  const TwoPhotos photos;
  GaussNewtonOptions one;
  one.averaged = 1;
  for (const bool averages : {false, true}) {
    GaussNewton solver(photos.problem, averages ? GaussNewtonOptions{} : one);
    const std::vector<Vector> values = photos.steps(solver, 12);
    const double off = (solver.estimate(values.back()) - values.back()).cwiseAbs().maxCoeff();
    EXPECT_EQ(off > 1e-12, averages) << off;
  }
}

TEST(Options, InstrumentsOfOneDrawAreBlurredAsWidely) {
  const TwoPhotos photos;
  const Vector slope = Vector::Ones(photos.unknowns.size());
  const Halves halves =
      split_halves(photos.problem, photos.seen(photos.unknowns.start(), 1)[0], slope);
  const auto filtered = [&](int radius) -> Eigen::VectorXf {
    InstrumentalVariablesOptions options;
    options.first_blur_radius = radius;
    InstrumentalVariables sums(options);
    sums.add(halves, 1);
    return sums.all(photos.layout, photos.photos[0], Eigen::VectorXf::Ones(halves.variance.size()))
        .a.filtered.col(0);
  };
  const Photo& photo = photos.photos[0];
  for (const int radius : {1, 3})
    EXPECT_EQ(filtered(radius), box_blur(filtered(0), photo.width, photo.height, radius)) << radius;
}

TEST(Options, ADerivativeIsCutAtAsHighAQuantile) {
  Photo photo = grey_capture();
  photo.weight.assign(photo.size(), 1.f);
  Eigen::VectorXf column(3 * 256);
  for (Eigen::Index i = 0; i < column.size(); ++i) column[i] = static_cast<float>(i);
  WienerFilterOptions median, all;
  median.clip_quantile = 0.5;
  median.clip_stride = all.clip_stride = 1;
  all.clip_quantile = 1;
  EXPECT_EQ(clipped_derivative(column, photo, -1, median).maxCoeff(), 383);
  EXPECT_EQ(clipped_derivative(column, photo, -1, all), column);
}

TEST(Options, AFilterPassesOnlyWhatExceedsChanceByAsManyStandardErrors) {
  const Eigen::VectorXf one = Eigen::VectorXf::Random(3 * 256).array() + 1;
  const Eigen::VectorXf other = Eigen::VectorXf::Random(3 * 256).array() + 1;
  const Eigen::VectorXf equal = Eigen::VectorXf::Ones(3 * 256);
  WienerFilterOptions strict;
  strict.standard_errors = 100;
  EXPECT_GT(WienerFilter(one, other, equal, 16, 16).filter(one, 1).norm(), 1);
  EXPECT_EQ(WienerFilter(one, other, equal, 16, 16, strict).filter(one, 1).norm(), 0);
}

TEST(Options, WeightsFallWithTheModelErrorAndThePixelsBrightness) {
  Scene scene = synthetic_scene();
  std::vector<Photo> photos{grey_capture()};
  check_photos(scene, photos);
  const Eigen::VectorXf none = Eigen::VectorXf::Zero(3 * 256);
  PixelWeightsOptions twice;
  twice.model_error *= 2;
  EXPECT_NEAR(noise_weights(photos[0], 1, none)[0] / noise_weights(photos[0], 1, none, twice)[0], 4,
              1e-5);
  PixelWeightsOptions dim;
  dim.dim_share = 1;
  // 0.5 + 0.3 * 0.5 and 0.5 + 0.5, squared.
  const double ratio = relative_weights(photos[0], 1)[0] / relative_weights(photos[0], 1, dim)[0];
  EXPECT_NEAR(ratio, std::pow(1 / 0.65, 2), 1e-4);
}

TEST(Options, NoiseEntersTheWeightsAtItsIteration) {
  const TwoPhotos photos;
  const auto changed_at = [&](int first) {
    PixelWeightsOptions options;
    options.first_weighing = first;
    PhotoWeights weights(photos.photos, true, options);
    int at = 0;
    for (int iteration = 1; iteration <= 8 && at == 0; ++iteration)
      if (weights.learn(photos.seen(photos.unknowns.start(), 1), 1, iteration)) at = iteration;
    return at;
  };
  EXPECT_EQ(changed_at(PixelWeightsOptions{}.first_weighing), 3);
  EXPECT_EQ(changed_at(5), 5);
}

TEST(Options, DampingRejectsLongStepsToWhatIsWorse) {
  const Vector u = Vector::Zero(1);
  const auto rejects = [&](const DampingOptions& options, double step, double loss) {
    DampingControl control(options);
    control.note_loss({1, 0}, u);
    control.note_step(step);
    return control.rejects({loss, 0});
  };
  EXPECT_TRUE(rejects({}, 0.3, 1.2));
  EXPECT_FALSE(rejects({}, 0.2, 1.2)) << "a short step";
  EXPECT_FALSE(rejects({}, 0.3, 1.05)) << "hardly worse";
  DampingOptions patient;
  patient.worse_by = 0.5;
  EXPECT_FALSE(rejects(patient, 0.3, 1.2));
  DampingOptions wary;
  wary.large_step = 0.1;
  EXPECT_TRUE(rejects(wary, 0.2, 1.2));
  DampingOptions never;
  never.most_rejections = 0;
  EXPECT_FALSE(rejects(never, 0.3, 1.2));
}

TEST(Options, DampingRisesAndFallsByItsFactors) {
  DampingOptions options;
  options.first = 1;
  options.increase = 7;
  options.decrease = 0.25;
  DampingControl control(options);
  control.note_loss({1, 0}, Vector::Zero(1));
  control.note_step(1);
  ASSERT_TRUE(control.rejects({2, 0}));
  EXPECT_EQ(control.damping(), 7);
  control.accept(0);
  EXPECT_EQ(control.damping(), 7) << "the step after a rejection";
  control.accept(0);
  EXPECT_EQ(control.damping(), 1.75);
  control.accept(2);
  EXPECT_EQ(control.damping(), 2) << "the least";
}

TEST(Options, AdamForgetsTheGradientAsFast) {
  const TwoPhotos photos;
  const auto second_step = [&](const AdamOptions& options) {
    Adam adam(photos.problem, options);
    const Vector one = adam.update(photos.unknowns.start(), Vector::Ones(6));
    return adam.update(one, -Vector::Ones(6))[0] - one[0];
  };
  AdamOptions no_momentum;
  no_momentum.beta1 = 0;
  EXPECT_GT(second_step(no_momentum), 0.02) << "back";
  EXPECT_LT(second_step({}), 0.01);
}

TEST(Options, ALineSearchEndsAfterAsManySteps) {
  const auto slope = [](double x) { return -x; };
  EXPECT_NEAR(parabolic_line_search(slope, 0, {0.1, -10, 10}), 1.2, 1e-12);
  EXPECT_NEAR(parabolic_line_search(slope, 0, {0.1, -10, 10}, {.most_steps = 3}), 0.3, 1e-12);
}

TEST(Options, ALossHasTilesAsLargeAsItsBlur) {
  Scene scene = synthetic_scene();
  std::vector<Photo> photos{grey_capture()};
  check_photos(scene, photos);
  const Film film(kSyntheticSize, kSyntheticSize, 4);
  const Eigen::VectorXf weights = Eigen::VectorXf::Ones(3 * 256);
  EXPECT_EQ(TiledLoss(film, photos[0], weights).all.size(), 36) << "3 pixels wide";
  EXPECT_EQ(TiledLoss(film, photos[0], weights, {.radius = 0.25}).all.size(), 4) << "9 pixels";
}

TEST(Options, DifferencesTakeTheirTurnsInAsLongRounds) {
  const FiniteDifferenceOptions options{.first_iterations = 1, .round = 2};
  EXPECT_EQ(differences_of(Purpose::kInstrumental, 0, options).every, 1);
  EXPECT_EQ(differences_of(Purpose::kInstrumental, 1, options).every, 2);
  EXPECT_EQ(differences_of(Purpose::kInstrumental, 2, options).first, 1);
  EXPECT_EQ(differences_of(Purpose::kInstrumental, 1).every, 1) << "by default";
}

TEST(Options, DifferencesAreAsLong) {
  const TwoPhotos photos;
  const Reparametrization reparametrization(photos.unknowns);
  const Vector& x = photos.unknowns.start();
  const auto length = [&](const FiniteDifferenceOptions& options) {
    double longest = 0;
    (void)render_derivatives(
        photos.problem, &reparametrization, photos.unknowns.scene_with(photos.scene, x),
        photos.photos[0], x, Purpose::kInstrumental, {Side::kUp},
        [&](const Vector& at, const SlotLayout& layout, Paths) {
          const Vector to = reparametrization.from_values(at) - reparametrization.from_values(x);
          longest = std::max(longest, std::abs(to[3]));
          return Film(kSyntheticSize, kSyntheticSize, 4, static_cast<int>(layout.slots.size()));
        },
        options);
    return longest;
  };
  EXPECT_NEAR(length({}), FiniteDifferenceOptions{}.roughness, 1e-9);
  EXPECT_NEAR(length({.roughness = 0.1}), 0.1, 1e-9);
}

TEST(Options, ARefractionIsSharpFromItsRatioOn) {
  const Scene scene = synthetic_scene();  // transmission 0.6, roughness 0.4
  const ParameterRef ior = scene.find("Body", "ior");
  EXPECT_FALSE(is_sharp_refraction(scene, ior));
  EXPECT_TRUE(is_sharp_refraction(scene, ior, {.sharp = 1}));
}

TEST(Options, LongestStepsAreThoseOfTheReparametrization) {
  const TwoPhotos photos;
  ReparametrizationOptions options;
  options.cap_log = 0.5;
  EXPECT_EQ(Reparametrization(photos.unknowns, options).cap()[3], 0.5) << "roughness";
  EXPECT_EQ(Reparametrization(photos.unknowns).cap()[3], 0.25);
}

TEST(Options, AValueIsDeterminedWithinItsShareOfTheRange) {
  const TwoPhotos photos;
  const Reparametrization reparametrization(photos.unknowns);
  NormalEquations equations(6);
  equations.normal.diagonal().setConstant(1);
  equations.normal_variance.setConstant(1e-12);
  equations.score_covariance.diagonal().setConstant(1e-4);
  ConfidenceOptions strict;
  strict.undetermined = 1e-3;
  const Vector u = reparametrization.from_values(photos.unknowns.start());
  for (const bool is_strict : {false, true}) {
    const Estimate found = estimate(photos.unknowns, reparametrization, u, equations, {},
                                    is_strict ? strict : kConfidence);
    EXPECT_EQ(found.components[4].determined, !is_strict) << "transmission";
  }
}

TEST(Options, AnOffsetIsAsFar) {
  const Unknowns unknowns(synthetic_scene(),
                          {{"Body", "transmission", {0.01}, 0.001, 0.999, 0.03}});
  EXPECT_EQ((*offset_point(unknowns, unknowns.start()))[0], 0.1);
  EXPECT_EQ((*offset_point(unknowns, unknowns.start(), {.offset = 0.3}))[0], 0.3);
  EXPECT_FALSE(offset_point(unknowns, unknowns.start(), {.offset = 0.01}));
}

TEST(Options, CellsOfAFieldSolverAreAsLarge) {
  const Scene scene = smoke(std::vector<float>(24, 0.5f), 3);
  const std::vector<Photo> photos = taken_photos(scene, 16, 1);
  const Fields fields(scene, {{"Smoke", "albedo_grid", {}, 0, 1, 0.03}});
  FieldGaussNewtonOptions options;
  EXPECT_EQ(FieldGaussNewton::of(fields, photos)->cell(), 8);
  options.cell = 4;
  EXPECT_EQ(FieldGaussNewton::of(fields, photos, options)->cell(), 4);
  options.most_entries = 2 * 4 * 24;  // two photos of two by two cells
  EXPECT_EQ(FieldGaussNewton::of(fields, photos, options)->cell(), 8);
  options.most_numbers = 23;
  EXPECT_FALSE(FieldGaussNewton::applies(fields, photos, options));
}

}  // namespace
}  // namespace selenite
