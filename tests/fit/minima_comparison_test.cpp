// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/minima_comparison.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "fit/given_evaluator.h"
#include "fit/problem/pixel_weights.h"
#include "fit/run/fit.h"
#include "fit/synthetic_renderer.h"

namespace selenite {
namespace {

constexpr double kOne = 0.2, kOther = 0.7;

/// Pictures of one scalar, `roughness`, that are 0.5 at two of its values. In every second pixel the
/// second of them is off by `difference` times its distance from the first.
struct Twins {
  double difference = 0, noise = 0.1;

  Film operator()(const Scene& scene, const Camera&, const SlotLayout& layout,
                  const RenderSettings& settings, Progress*) const {
    const double r = scene.appearance.materials[0].values.roughness;
    return evenly_noisy_film(layout, settings, noise, [=, this](std::size_t i) {
      const double tilt = i % 2 == 0 ? 0 : difference;
      return std::pair(0.5 + (r - kOne) * (r - kOther + tilt), 2 * r - kOne - kOther + tilt);
    });
  }
};

std::unique_ptr<Fit> fit_from(double start, const FitSettings& settings) {
  return std::make_unique<Fit>(synthetic_scene(), std::vector{grey_capture()},
                               roughness_from(start), settings);
}

FitResult ended(Fit& fit) {
  double fraction = 0;
  PhaseKind phase = PhaseKind::kMultiStart;
  while (fit.step()) {
    const double now = fit.result().phase_fraction;
    if (fit.result().phase == phase) {
      EXPECT_GE(now, fraction) << phase_text(phase);
    }
    EXPECT_LE(now, 1);
    fraction = now;
    phase = fit.result().phase;
  }
  EXPECT_EQ(fit.result().message, "");
  return fit.result();
}

FitResult run(const Twins& twins, std::uint64_t seed) {
  FitSettings settings = exact_settings(twins, 20);
  settings.seed = seed;
  return ended(*fit_from(0.45, settings));
}

// The two are one test: a comparison that lets all stand, or none, fails one of them. Of 64 pixels each
// round takes a twin in twenty for worse: of 200 fits with two rounds 166 reported it, with three 162.
TEST(AlternativeMinima, ThatExplainThePhotosAsWellAreTold) {
  constexpr int kFits = 20;
  int reported = 0;
  for (int seed = 1; seed <= kFits; ++seed) {
    const FitResult found = run({}, static_cast<std::uint64_t>(seed));
    const double twin = found.best[0] < 0.45 ? kOther : kOne;
    EXPECT_NEAR(found.best[0], kOne + kOther - twin, 0.05) << seed;
    if (found.report.alternatives.empty()) continue;
    ++reported;
    EXPECT_NEAR(found.report.alternatives[0][0], twin, 0.1) << seed;
    EXPECT_EQ(found.report.ambiguous, std::vector<int>{0}) << seed;
    EXPECT_FALSE(found.report.components[0].determined) << seed;
  }
  EXPECT_GE(reported, 0.7 * kFits);
}

TEST(AlternativeMinima, ThatThePhotosTellApartAreNot) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const FitResult found = run({.difference = 0.5}, seed);
    EXPECT_NEAR(found.best[0], kOne, 0.02);
    EXPECT_TRUE(found.report.alternatives.empty()) << seed;
    EXPECT_TRUE(found.report.ambiguous.empty());
    EXPECT_TRUE(found.report.components[0].determined);
  }
}

/// The same twins, but light comes by rare bright paths: by every hundredth everywhere, or by every
/// thousandth in a strip, with all else bright and quiet.
enum class Rare { kEverywhere, kInAStrip };

Film by_rare_paths(const Scene& scene, const RenderSettings& settings, Rare rare,
                   double difference) {
  const double r = scene.appearance.materials[0].values.roughness;
  Film film(settings.width, settings.height, settings.spp);
  const int n = settings.spp, even = (n + 1) / 2;
  for (std::size_t i = 0; i < film.size(); ++i) {
    const double share = rare == Rare::kEverywhere ? 0.01 : i < film.size() / 4 ? 0.001 : 0.1;
    const double value = 0.5 + (r - kOne) * (r - kOther + (i % 2 == 0 ? 0 : difference));
    Random random(settings.seed, static_cast<std::uint32_t>(i), 0);
    double all = 0, half = 0;
    for (int s = 0; s < n; ++s) {
      const double sample = random.uniform(s) < share ? value / share : 0;
      all += sample;
      if (s % 2 == 0) half += sample;
    }
    const double squares = all * value / share;
    film.mean[i] = Colorf(static_cast<float>(all / n));
    film.half_a[i] = Colorf(static_cast<float>(half / even));
    film.variance[i] = Colorf(static_cast<float>((squares - all * all / n) / (n * (n - 1.0))));
  }
  return film;
}

/// Of 20 comparisons of the answer kOne with kOther, those that the alternative survives.
int stands(Rare rare, double difference) {
  const Scene scene = synthetic_scene();
  std::vector<Photo> photos{grey_capture(32)};
  check_photos(scene, photos);
  const Unknowns unknowns(scene, roughness_from(kOne));
  const SlotLayout layout = unknowns.layout(scene);
  const Problem problem{unknowns, layout, photos, losses()[0], 10};
  GivenEvaluator render([&](const Vector& x, const Photo& photo, int spp, std::uint64_t seed,
                            std::optional<Differences>) {
    RenderSettings settings;
    settings.width = photo.width;
    settings.height = photo.height;
    settings.spp = spp;
    settings.seed = seed;
    return by_rare_paths(unknowns.scene_with(scene, x), settings, rare, difference);
  });
  int stood = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    MinimaComparison alternatives(problem, {relative_weights(photos[0], 1)},
                                  {Vector::Constant(1, kOne)}, {Vector::Constant(1, kOther)}, seed,
                                  256);
    while (alternatives.step(render)) {
    }
    TrustReport report;
    report.components.push_back({.interval = {kOne - 0.01, kOne + 0.01}, .determined = true});
    stood += static_cast<int>(alternatives.pending(report).size());
  }
  return stood;
}

// Squares of residuals are mostly those of the few bright pixels of the strip: by them alone 16 of 20
// would stand.
TEST(AlternativeMinima, AreToldApartInLightOfRareBrightPaths) {
  EXPECT_LE(stands(Rare::kEverywhere, 0.4), 1) << "brighter by 2/5 in every second pixel";
  EXPECT_LE(stands(Rare::kInAStrip, 0.3), 4) << "by 3/10";
  for (const Rare rare : {Rare::kEverywhere, Rare::kInAStrip})
    EXPECT_GE(stands(rare, 0), 19) << "as good";
}

TEST(AlternativeMinima, AreThoseOfTheSearchOnly) {
  FitSettings settings = exact_settings(Twins(), 20);
  settings.search = "off";
  const FitResult found = ended(*fit_from(0.75, settings));
  EXPECT_NEAR(found.best[0], kOther, 0.05);
  EXPECT_TRUE(found.report.alternatives.empty());
  EXPECT_TRUE(found.report.components[0].determined);
}

/// A surface and its coat, which act alike: two kinds of pixels show the sum and the product of their
/// roughnesses. A third kind, in every fourth pixel, shows `difference` times that of the surface.
struct Coated {
  double difference = 0;

  Film operator()(const Scene& scene, const Camera&, const SlotLayout& layout,
                  const RenderSettings& settings, Progress*) const {
    const Principled<double>& m = scene.appearance.materials[0].values;
    const double r = m.roughness, c = m.coat_roughness;
    const auto slopes = [&](std::size_t i) {
      if (i % 4 == 3) return std::pair(difference, 0.0);
      return i % 2 == 0 ? std::pair(1.0, 1.0) : std::pair(2 * c, 2 * r);
    };
    Film film = evenly_noisy_film(layout, settings, 0.05, [&](std::size_t i) {
      const double shown = i % 4 == 3   ? difference * (r - kOne)
                           : i % 2 == 0 ? r + c - kOne - kOther
                                        : 2 * (r * c - kOne * kOther);
      return std::pair(0.5 + shown, slopes(i).first);
    });
    for (std::size_t s = 0; s < film.slots.size(); ++s) {
      if (scene.description(layout.slots[s].parameter).name != "coat_roughness") continue;
      for (std::size_t i = 0; i < film.size(); ++i)
        film.slots[s].mean[i] = film.slots[s].half_a[i] =
            Colorf(static_cast<float>(slopes(i).second));
    }
    return film;
  }
};

/// From the values exchanged, without a search.
std::unique_ptr<Fit> coated_fit(double difference) {
  FitSettings settings = exact_settings(Coated{difference}, 20);
  settings.search = "off";
  return std::make_unique<Fit>(
      synthetic_scene(), std::vector{grey_capture()},
      std::vector<UnknownParameter>{{"Body", "roughness", {kOther}, 0.02, 0.999, 0.03},
                                    {"Body", "coat_roughness", {kOne}, 0.02, 0.999, 0.03}},
      settings);
}

TEST(AlternativeMinima, WinWhereThePhotosAreNearerToThem) {
  const auto fit = coated_fit(0.1);
  while (fit->result().phase == PhaseKind::kDescent && fit->step()) {
  }
  EXPECT_NEAR(fit->values()[0], kOther, 0.05) << "steps find no way out";
  int refinements = fit->result().phase == PhaseKind::kRefinement;
  PhaseKind before = fit->result().phase;
  while (fit->step()) {
    const PhaseKind now = fit->result().phase;
    refinements += now == PhaseKind::kRefinement && before != now;
    before = now;
  }
  EXPECT_EQ(refinements, 2) << "of the answer, then of what the photos are nearer to";
  const FitResult& found = fit->result();
  EXPECT_EQ(found.message, "");
  EXPECT_NEAR(found.best[0], kOne, 0.02);
  EXPECT_NEAR(found.best[1], kOther, 0.02);
  EXPECT_EQ(found.best, found.last);
  EXPECT_TRUE(found.report.alternatives.empty()) << "what it left has lost";
  EXPECT_TRUE(found.report.components[0].determined && found.report.components[1].determined);
}

TEST(AlternativeMinima, ThatActAlikeAreToldWithoutASearch) {
  const FitResult found = ended(*coated_fit(0));
  const double twin = found.best[0] < 0.45 ? kOther : kOne;
  EXPECT_NEAR(found.best[0], kOne + kOther - twin, 0.05);
  ASSERT_EQ(found.report.alternatives.size(), 1u);
  EXPECT_NEAR(found.report.alternatives[0][0], twin, 0.05);
  EXPECT_EQ(found.report.ambiguous, (std::vector{0, 1}));
}

TEST(AlternativeMinima, AreRememberedByASavedFit) {
  const FitSettings settings = exact_settings(Twins(), 20);
  const auto whole = fit_from(0.45, settings), resumed = fit_from(0.45, settings);
  while (whole->result().iterations < 5) whole->step();
  resumed->restore(whole->saved());
  const FitResult expected = ended(*whole), found = ended(*resumed);
  ASSERT_GE(expected.report.alternatives.size(), 1u);
  EXPECT_EQ(found.report.alternatives, expected.report.alternatives);
  EXPECT_EQ(found.report.ambiguous, expected.report.ambiguous);
}

}  // namespace
}  // namespace selenite
