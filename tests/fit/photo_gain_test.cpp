// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "fit/evaluate/photo_evaluator.h"
#include "fit/inference/photo_jacobian.h"
#include "fit/run/fit.h"
#include "fit/smoke.h"
#include "fit/synthetic_renderer.h"
#include "fit/taken_photos.h"
#include "math/error.h"

namespace selenite {
namespace {

const Color<double> kGain{1.7, 1, 0.6};

UnknownParameter gain_of(const char* photo, std::vector<double> start = {1, 1, 1}) {
  return {photo, "gain", std::move(start), 0.1, 10, 0.03};
}

/// Photos of both cameras, the second one with another exposure and white balance.
std::vector<Photo> photos_with_gain(const Color<double>& gain = kGain) {
  const Scene scene = synthetic_scene();
  std::vector<Photo> photos{synthetic_capture(scene, "Left"), synthetic_capture(scene, "Right")};
  for (Colorf& pixel : photos[1].reference) pixel *= Colorf(gain);
  return photos;
}

/// A problem and the films that a fit evaluates in it.
struct Setting {
  FitProblem problem;
  RenderCounts counts;
  PhotoEvaluator evaluator{scene_model(problem), problem.settings(), counts};

  Setting(Scene scene, std::vector<Photo> photos, const std::vector<UnknownParameter>& unknowns,
          const FitSettings& settings = synthetic_settings())
      : problem(std::move(scene), std::move(photos), unknowns, settings) {}

  Film film(const Vector& x, std::size_t photo, bool derivatives = true) {
    Evaluation how{8, 3 + photo};
    if (derivatives) how.derivatives = Differences{};
    how.all_pictures = true;
    return evaluator.evaluate({x, problem.fields().start()}, problem.photos()[photo], how);
  }
};

Vector fitted(const std::vector<Photo>& photos, const std::vector<UnknownParameter>& unknowns,
              const FitSettings& settings) {
  Fit fit(synthetic_scene(), photos, unknowns, settings);
  while (fit.step()) {
  }
  EXPECT_TRUE(fit.result().message.empty()) << fit.result().message;
  return fit.result().best;
}

const std::vector<UnknownParameter> kColourAndGain{synthetic_unknowns()[0], gain_of("Right")};
const Vector kTruth{{0.4, 0.6, 0.8, kGain.r, kGain.g, kGain.b}};

TEST(PhotoGain, IsFoundTogetherWithAColour) {
  const Vector found =
      fitted(photos_with_gain(), kColourAndGain, exact_settings(SyntheticRenderer{0, 0}, 40));
  EXPECT_LT((found - kTruth).cwiseAbs().maxCoeff(), 2e-3) << found.transpose();
}

TEST(PhotoGain, IsFoundByAdam) {
  FitSettings settings = synthetic_settings({0, 0});
  settings.iterations = 400;
  const Vector found = fitted(photos_with_gain(), kColourAndGain, settings);
  EXPECT_LT((found - kTruth).cwiseAbs().maxCoeff(), 0.02) << found.transpose();
}

// Multi-start, descent and refinement. Renders with a noise of 0.5 a sample: the refinement's 1024
// samples of 512 pixels leave less than 1e-3; twenty times that.
TEST(PhotoGain, IsFoundInNoiseByAllPhases) {
  FitSettings settings;
  settings.threads = 1;
  settings.iterations = 30;
  settings.refinement_spp = 1024;
  settings.renderer = SyntheticRenderer{0.5, 0.2};
  const Vector found = fitted(photos_with_gain(), kColourAndGain, settings);
  EXPECT_LT((found - kTruth).cwiseAbs().maxCoeff(), 0.02) << found.transpose();
}

/// One film at other values is another function of the same random numbers: its loss differs by what
/// the derivative says, the correction for noise included.
TEST(PhotoGain, DerivativesAreThoseOfTheLoss) {
  for (const char* name : {"mse", "dual-buffer"}) {
    std::vector<UnknownParameter> unknowns = synthetic_unknowns();
    unknowns.insert(unknowns.begin() + 1, gain_of("Right"));
    Setting s(synthetic_scene(), photos_with_gain(), unknowns);
    const Loss& loss = find_loss(name);
    const Photo& photo = s.problem.photos()[1];
    const Vector x{{0.2, 0.3, 0.5, 1.3, 0.8, 2.1, 0.5, 0.4, 1.6}};
    const Film film = s.film(x, 1);
    const Vector slope =
        loss_gradient(s.problem.scalars().layout, film, loss.evaluate(film, photo));
    for (Eigen::Index k = 0; k < x.size(); ++k) {
      const double step = 1e-3 * x[k];
      const auto at = [&](double by) {
        Vector moved = x;
        moved[k] += by;
        const Film there = s.film(moved, 1, false);
        return loss.evaluate(there, photo).value;
      };
      const double want = (at(step) - at(-step)) / (2 * step);
      EXPECT_NEAR(slope[k], want, 3e-3 * std::abs(want) + 1e-4)
          << name << " " << s.problem.unknowns().components()[static_cast<std::size_t>(k)].name;
    }
  }
}

TEST(PhotoGain, MultipliesWhatIsRenderedAndItsNoise) {
  std::vector<Photo> photos = photos_with_gain();
  Setting plain(synthetic_scene(), photos, {synthetic_unknowns()[0]});
  photos[1].values.gain = kGain;
  Setting with(synthetic_scene(), photos, {synthetic_unknowns()[0]});
  const Vector x{{0.2, 0.3, 0.5}};
  EXPECT_EQ(plain.film(x, 0).mean, with.film(x, 0).mean) << "the other photo";
  const Film one = plain.film(x, 1), other = with.film(x, 1);
  for (int c = 0; c < 3; ++c) {
    const auto g = static_cast<float>(kGain[c]);
    const SlotFilm &slot = one.slots[0], &scaled = other.slots[0];
    for (std::size_t i = 0; i < one.size(); ++i) {
      EXPECT_FLOAT_EQ(other.mean[i][c], g * one.mean[i][c]);
      EXPECT_FLOAT_EQ(other.half_a[i][c], g * one.half_a[i][c]);
      EXPECT_FLOAT_EQ(other.variance[i][c], g * g * one.variance[i][c]);
      EXPECT_FLOAT_EQ(scaled.mean[i][c], g * slot.mean[i][c]);
      EXPECT_FLOAT_EQ(scaled.half_a[i][c], g * slot.half_a[i][c]);
      EXPECT_FLOAT_EQ(scaled.variance[i][c], g * g * slot.variance[i][c]);
      EXPECT_FLOAT_EQ(scaled.covariance[i][c], g * g * slot.covariance[i][c]);
    }
  }
}

TEST(PhotoGain, OfAnotherPhotoHasTheDerivativeZero) {
  Setting s(synthetic_scene(), photos_with_gain(), {gain_of("Left"), gain_of("Right")});
  const Film film = s.film(s.problem.unknowns().start(), 0);
  ASSERT_EQ(film.slots.size(), 2u);
  EXPECT_EQ(film.slots[0].mean, film.mean) << "at gain 1";
  EXPECT_EQ(film.slots[1].mean, Picture(film.size()));
  const Halves halves = split_halves(s.problem.scalars(), {0, film, {}}, Vector::Ones(6));
  EXPECT_TRUE(halves.differentiated.all());
  EXPECT_TRUE((halves.jacobian_b.rightCols(3).array() == 0).all());
}

/// Differences from both sides need no picture of their own, the gain does.
TEST(PhotoGain, NeedsThePictureBetweenDifferences) {
  Setting s(synthetic_scene(), photos_with_gain(), {synthetic_unknowns()[1], gain_of("Right")}, [] {
    FitSettings settings = synthetic_settings();
    settings.finite_differences = true;
    return settings;
  }());
  const Vector x = s.problem.unknowns().start();
  const auto film = [&](std::size_t photo) {
    return s.evaluator.evaluate(
        {x}, s.problem.photos()[photo],
        {8, 3, Differences{.side = Side::kBoth, .picture = false}, Purpose::kInstrumental});
  };
  EXPECT_GT(film(1).slots[1].mean[20].g, 0);
  EXPECT_EQ(film(0).mean[20].g, 0) << "where it has no gain";
}

/// Of the albedos in a grid: with gain g and photo y as without, with photo y / g, but for g^2.
TEST(PhotoGain, ReachesTheDerivativesByFields) {
  constexpr int kSize = 16;
  const std::vector<UnknownParameter> unknowns{{"Smoke", "albedo_grid", {}, 0, 1, 0.03}};
  const Scene scene = smoke(std::vector<float>(24, 0.6f), 3);
  std::vector<Photo> photos = taken_photos(smoke(std::vector<float>(24, 0.9f), 3), kSize, 16);
  FitSettings settings;
  settings.threads = 1;
  const auto divided = photos;
  for (Photo& photo : photos) {
    photo.values.gain = kGain;
    for (Colorf& pixel : photo.reference) pixel *= Colorf(kGain);
  }
  Setting plain(scene, divided, unknowns, settings), with(scene, photos, unknowns, settings);
  const auto gradient = [](Setting& s, const char* loss) {
    const Photo& photo = s.problem.photos()[0];
    return s.evaluator.field_gradient(s.problem.start(), photo, s.problem.fields(),
                                      {find_loss(loss), photo}, {8, 3});
  };
  const auto jacobian = [](Setting& s) {
    const std::vector<float> weights(kSize * kSize, 1.f / (kSize * kSize));
    return s.evaluator.field_jacobian(s.problem.start(), s.problem.photos()[0], s.problem.fields(),
                                      weights, kSize, {8, 3});
  };
  const FieldGradient one = gradient(plain, "dual-buffer"), other = gradient(with, "dual-buffer");
  const FieldJacobian row = jacobian(plain), scaled = jacobian(with);
  for (std::size_t k = 0; k < 24; ++k) {
    const double g = kGain[static_cast<int>(k % 3)];
    EXPECT_NEAR(other.fields[0][k], g * g * one.fields[0][k],
                1e-4 * std::abs(one.fields[0][k]) + 1e-9);
    const auto column = static_cast<Eigen::Index>(k);
    EXPECT_FLOAT_EQ(scaled.fields[0](0, column), static_cast<float>(g) * row.fields[0](0, column));
  }
  for (std::size_t i = 0; i < one.film.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      EXPECT_FLOAT_EQ(other.film.mean[i][c], static_cast<float>(kGain[c]) * one.film.mean[i][c]);
      EXPECT_FLOAT_EQ(scaled.film.mean[i][c], static_cast<float>(kGain[c]) * row.film.mean[i][c]);
    }
}

/// A gain of 2 doubles a picture: the derivative by its logarithm is the picture.
TEST(PhotoGain, PhotoJacobianHasThePictureAsDerivative) {
  const Scene scene = smoke(std::vector<float>(8, 0.5f));
  Photo photo = of_camera("Camera 0");
  photo.id = "Dusk";
  const Unknowns unknowns(scene, {gain_of("Dusk", {2, 2, 2})}, {photo});
  const PhotoJacobian seen = photo_jacobian(scene, unknowns, photo, square_settings(8, 16, 3));
  photo.values.gain = Color<double>(2);
  const Unknowns other(scene, {{"World", "strength", {0.3}, 0.01, 100, 0.03}});
  const PhotoJacobian fixed = photo_jacobian(scene, other, photo, square_settings(8, 16, 3));
  for (const PhotoJacobian::Portion& portion : seen.portions)
    for (Eigen::Index i = 0; i < 3 * 64; ++i)
      EXPECT_FLOAT_EQ(portion.halves.jacobian_a(i, i % 3), portion.halves.residual_a[i]);
  const Film film = render(scene, scene.camera("Camera 0"), {}, square_settings(8, 256, 5));
  double sum = 0, doubled = 0, known = 0;
  for (std::size_t i = 0; i < film.size(); ++i) {
    sum += film.mean[i].g;
    doubled += seen.mean[i].g;
    known += fixed.mean[i].g;
  }
  // 64 pixels of 16 samples: 5 standard errors are less than a tenth.
  EXPECT_NEAR(doubled / sum, 2, 0.2);
  EXPECT_NEAR(known / sum, 2, 0.2);
}

TEST(PhotoGain, MistakesAreNamed) {
  const auto message = [](std::vector<Photo> photos, const UnknownParameter& unknown) {
    try {
      FitProblem(synthetic_scene(), std::move(photos), {unknown}, {});
    } catch (const std::exception& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(message(photos_with_gain(), gain_of("Right")), "");
  EXPECT_EQ(message(photos_with_gain(), gain_of("Body")),
            "'Body' is no photo, and 'gain' is a parameter of photos; photos: 'Left', 'Right'");
  EXPECT_NE(message(photos_with_gain(), {"Right", "gain", {1, 1, 1}, 0, 10, 0.03})
                .find("Right:gain: minimum = 0 lies outside [0.001, 1000]"),
            std::string::npos);
  std::vector<Photo> photos = photos_with_gain();
  photos[0].values.gain.g = -1;
  EXPECT_EQ(message(photos, synthetic_unknowns()[0]),
            "Left:gain = -1 lies outside [0.001, 1000]; give a value inside");
}

/// A name is looked for among the parameters of photos first.
TEST(PhotoGain, NoParameterOfASceneIsNamedLikeOneOfAPhoto) {
  std::set<std::string_view> names;
  for (const Parameter& one : photo_parameter_table().rows) names.insert(one.name);
  EXPECT_TRUE(names.contains("gain"));
  for (const OwnerKind kind : {OwnerKind::kMaterial, OwnerKind::kLight, OwnerKind::kWorld})
    for (const Parameter& one : parameter_table(kind)) EXPECT_FALSE(names.contains(one.name));
}

TEST(PhotoGain, IsInTheFingerprintAndGoesWithASmallerPhoto) {
  std::vector<Photo> photos = photos_with_gain();
  check_photos(synthetic_scene(), photos);
  Photo other = photos[1];
  other.values.gain.b = 0.6;
  EXPECT_NE(other.fingerprint(), photos[1].fingerprint());
  EXPECT_EQ(other.resized(4).values.gain.b, 0.6);
}

}  // namespace
}  // namespace selenite
