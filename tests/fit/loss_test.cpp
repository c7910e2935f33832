// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/problem/loss.h"

#include <gtest/gtest.h>

#include "fit/synthetic_renderer.h"
#include "math/sample_mean.h"

namespace selenite {
namespace {

class EveryLoss : public ::testing::TestWithParam<std::string> {};

struct Setting {
  Scene scene = synthetic_scene();
  Unknowns unknowns{scene, synthetic_unknowns()};
  SlotLayout layout{unknowns.layout(scene)};
  std::vector<Photo> photos{synthetic_capture(scene, "Left")};
  Vector x = Vector{{0.25, 0.3, 0.5, 0.5, 0.4, 1.35}};

  Setting() {
    // A mask with all kinds of weights, and a reference that no values reach: residuals do not
    // vanish.
    photos[0].weight.assign(photos[0].size(), 1.f);
    for (std::size_t i = 0; i < photos[0].size(); i += 3) photos[0].weight[i] = 0.25f;
    for (std::size_t i = 0; i < photos[0].size(); i += 5) photos[0].weight[i] = 0;
    for (std::size_t i = 0; i < photos[0].size(); ++i)
      photos[0].reference[i] += Colorf(i % 2 ? 0.04f : 0.f);
    check_photos(scene, photos);
  }
  Film film(const Vector& at, const SyntheticRenderer& renderer, int spp,
            std::uint64_t seed) const {
    RenderSettings settings;
    settings.width = settings.height = kSyntheticSize;
    settings.spp = spp;
    settings.seed = seed;
    const Scene now = unknowns.scene_with(scene, at);
    return renderer(now, now.cameras[0], layout, settings, nullptr);
  }
};

/// Any loss of the list joins by itself. Fixed samples make the noisy loss a smooth function.
TEST_P(EveryLoss, SlopeAgreesWithFiniteDifference) {
  const Loss& loss = find_loss(GetParam());
  const Setting s;
  const SyntheticRenderer exact{0, 0};
  const LossResult at = loss.evaluate(s.film(s.x, exact, 2, 1), s.photos[0]);
  const Vector gradient = loss_gradient(s.layout, s.film(s.x, exact, 2, 1), at);
  for (Eigen::Index k = 0; k < s.x.size(); ++k) {
    constexpr double kStep = 1e-3;
    Vector low = s.x, high = s.x;
    low[k] -= kStep;
    high[k] += kStep;
    const double difference = (loss.evaluate(s.film(high, exact, 2, 1), s.photos[0]).value -
                               loss.evaluate(s.film(low, exact, 2, 1), s.photos[0]).value) /
                              (2 * kStep);
    // mae has kinks: a residual that changes its sign within the step moves the difference a
    // little.
    EXPECT_NEAR(gradient[k], difference, 1e-5 + 2e-2 * std::abs(difference))
        << s.unknowns.components()[static_cast<std::size_t>(k)].name;
  }
  EXPECT_GT(gradient.norm(), 1e-3) << "the test did test something";
}

TEST_P(EveryLoss, IgnoresPixelsOfWeightZero) {
  const Loss& loss = find_loss(GetParam());
  const Setting s;
  Film film = s.film(s.x, {}, 4, 2);
  const LossResult before = loss.evaluate(film, s.photos[0]);
  for (std::size_t i = 0; i < film.size(); i += 5) film.mean[i] = Colorf(1e6f);
  const LossResult after = loss.evaluate(film, s.photos[0]);
  EXPECT_EQ(before.value, after.value);
  for (std::size_t i = 0; i < film.size(); i += 5) EXPECT_EQ(after.slope[i].r, 0.f);
}

TEST_P(EveryLoss, IsZeroAtTheTruth) {
  const Setting s;
  std::vector<Photo> photos{synthetic_capture(s.scene, "Left")};
  check_photos(s.scene, photos);
  const LossResult at =
      find_loss(GetParam()).evaluate(s.film(synthetic_truth(), {0, 0}, 2, 1), photos[0]);
  EXPECT_NEAR(at.value, 0, 1e-12);
}

TEST_P(EveryLoss, HasHelpAndAName) { EXPECT_GT(find_loss(GetParam()).help.size(), 20u); }

std::vector<std::string> loss_names() {
  std::vector<std::string> names;
  for (const Loss& loss : losses()) names.emplace_back(loss.name);
  return names;
}
INSTANTIATE_TEST_SUITE_P(List, EveryLoss, ::testing::ValuesIn(loss_names()), [](const auto& info) {
  std::string name = info.param;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

TEST(Loss, UnknownNameListsTheNames) {
  try {
    find_loss("l2");
    FAIL();
  } catch (const InvalidArgument& error) {
    EXPECT_NE(std::string(error.what()).find("dual-buffer"), std::string::npos);
  }
}

struct Trial {
  Mean value;
  std::vector<Mean> gradient;
  double true_value = 0;
  Vector true_gradient;
  double worst_gradient_z() const {
    double worst = 0;
    for (std::size_t k = 0; k < gradient.size(); ++k)
      worst = std::max(worst, std::abs(gradient[k].z(true_gradient[static_cast<Eigen::Index>(k)])));
    return worst;
  }
};

Trial run_trial(const std::string& name, int spp, int seeds) {
  const Loss& loss = find_loss(name);
  const Setting s;
  Trial trial;
  const Film exact = s.film(s.x, {0, 0}, 2, 0);
  const LossResult truth = loss.evaluate(exact, s.photos[0]);
  trial.true_value = truth.value;
  trial.true_gradient = loss_gradient(s.layout, exact, truth);
  trial.gradient.resize(static_cast<std::size_t>(s.x.size()));
  for (int seed = 0; seed < seeds; ++seed) {
    const Film film = s.film(s.x, {0.5, 0.5}, spp, static_cast<std::uint64_t>(seed) + 100);
    const LossResult at = loss.evaluate(film, s.photos[0]);
    trial.value.add(at.unbiased);
    const Vector gradient = loss_gradient(s.layout, film, at);
    for (Eigen::Index k = 0; k < gradient.size(); ++k)
      trial.gradient[static_cast<std::size_t>(k)].add(gradient[k]);
  }
  return trial;
}

// |z| < 4 in 7 values: false alarm 4e-4; seeds are fixed.
class UnbiasedLoss : public ::testing::TestWithParam<std::pair<const char*, int>> {};
TEST_P(UnbiasedLoss, HasUnbiasedValueAndGradient) {
  const auto [name, spp] = GetParam();
  const Trial trial = run_trial(name, spp, 600);
  EXPECT_LT(std::abs(trial.value.z(trial.true_value)), 4);
  EXPECT_LT(trial.worst_gradient_z(), 4);
}
INSTANTIATE_TEST_SUITE_P(All, UnbiasedLoss,
                         ::testing::Values(std::pair{"dual-buffer", 2}, std::pair{"dual-buffer", 5},
                                           std::pair{"mean-bias-error", 2},
                                           std::pair{"mean-bias-error", 4}));

TEST(Loss, PlainSquaredErrorHasABiasedGradient) {
  const Trial trial = run_trial("mse", 2, 200);
  EXPECT_GT(trial.worst_gradient_z(), 20);
  EXPECT_LT(std::abs(trial.value.z(trial.true_value)), 4) << "its `unbiased` value is not";
}

/// The form over pairs of docs/method/losses.md, "All-pairs estimator", computed sample by
/// sample, is what films give.
TEST(Loss, DualBufferIsTheMeanOverAllPairsOfSamples) {
  const Setting s;
  constexpr int kSpp = 5;
  const SyntheticRenderer renderer{0.5, 0.3};
  // Samples one by one: the mean of n samples minus that of n - 1 gives the n-th.
  std::vector<Film> films;
  for (int n = 1; n <= kSpp; ++n) films.push_back(s.film(s.x, renderer, n, 7));
  const auto sample = [](const Picture& now, const Picture* before, std::size_t i, int c, int n) {
    return static_cast<double>(now[i][c]) * n - (before ? (*before)[i][c] * (n - 1.0) : 0);
  };
  double value = 0;
  Vector gradient = Vector::Zero(s.x.size());
  const Photo& photo = s.photos[0];
  for (std::size_t i = 0; i < photo.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      std::vector<double> image(kSpp);
      for (int n = 0; n < kSpp; ++n)
        image[static_cast<std::size_t>(n)] =
            sample(films[static_cast<std::size_t>(n)].mean,
                   n ? &films[static_cast<std::size_t>(n - 1)].mean : nullptr, i, c, n + 1);
      const double reference = photo.reference[i][c], share = photo.share(i) / (kSpp * (kSpp - 1));
      for (int a = 0; a < kSpp; ++a)
        for (int b = 0; b < kSpp; ++b)
          if (a != b)
            value += share * (image[static_cast<std::size_t>(a)] - reference) *
                     (image[static_cast<std::size_t>(b)] - reference);
      for (std::size_t k = 0; k < s.layout.rows.size(); ++k) {
        const UnknownRow& row = s.layout.rows[k];
        if (row.channel >= 0 && row.channel != c) continue;
        const auto slot = static_cast<std::size_t>(row.slot);
        for (int b = 0; b < kSpp; ++b) {
          const double slope = sample(
              films[static_cast<std::size_t>(b)].slots[slot].mean,
              b ? &films[static_cast<std::size_t>(b - 1)].slots[slot].mean : nullptr, i, c, b + 1);
          for (int a = 0; a < kSpp; ++a)
            if (a != b)
              gradient[static_cast<Eigen::Index>(k)] +=
                  2 * share * (image[static_cast<std::size_t>(a)] - reference) * slope;
        }
      }
    }
  const LossResult at = find_loss("dual-buffer").evaluate(films.back(), photo);
  EXPECT_NEAR(at.value, value, 2e-6 * std::abs(value) + 1e-8);
  EXPECT_LT((loss_gradient(s.layout, films.back(), at) - gradient).norm(), 1e-5 * gradient.norm());
}

TEST(Loss, StandardErrorIsTheSpreadOverSeeds) {
  const Setting s;
  for (const Vector& x : {s.x, synthetic_truth()}) {
    Mean values, variance;
    for (int seed = 0; seed < 400; ++seed) {
      const LossResult at =
          find_loss("dual-buffer")
              .evaluate(s.film(x, {}, 16, static_cast<std::uint64_t>(seed)), s.photos[0]);
      values.add(at.unbiased);
      variance.add(at.standard_error * at.standard_error);
    }
    const double spread = std::sqrt(values.square / values.n - std::pow(values.sum / values.n, 2));
    EXPECT_NEAR(std::sqrt(variance.sum / variance.n) / spread, 1, 0.2);
  }
}

TEST(Loss, MeanBiasIsRenderMinusPhoto) {
  const Setting s;
  Film film = s.film(s.x, {0, 0}, 2, 0);
  for (std::size_t i = 0; i < film.size(); ++i)
    film.mean[i] = s.photos[0].reference[i] + Colorf(0.5f, 0.f, -0.25f);
  const Color<double> bias = mean_bias(film, s.photos[0]);
  EXPECT_NEAR(bias.r, 0.5, 1e-6);
  EXPECT_NEAR(bias.g, 0, 1e-6);
  EXPECT_NEAR(bias.b, -0.25, 1e-6);
}

TEST(Loss, BrightnessIndependentMseIgnoresTheExposure) {
  const Setting s;
  const Film film = s.film(s.x, {0, 0}, 2, 0);
  Photo brighter = s.photos[0];
  for (Colorf& c : brighter.reference) c = c * 8.f;
  const Loss& loss = find_loss("brightness-independent-mse");
  EXPECT_NEAR(loss.evaluate(film, brighter).value, loss.evaluate(film, s.photos[0]).value, 1e-9);
}

TEST(Loss, BrightnessIndependentMseStaysFiniteOnABlackRender) {
  const Setting s;
  Film film = s.film(s.x, {0, 0}, 2, 0);
  for (Colorf& c : film.mean) c = Colorf(0.f);
  const LossResult at = find_loss("brightness-independent-mse").evaluate(film, s.photos[0]);
  EXPECT_TRUE(std::isfinite(at.value));
  for (const Colorf& c : at.slope) EXPECT_TRUE(std::isfinite(c.r));
}

}  // namespace
}  // namespace selenite
