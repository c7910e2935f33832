// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/run/fit.h"

#include <gtest/gtest.h>

#include <atomic>

#include "fit/synthetic_renderer.h"

namespace selenite {
namespace {

std::vector<Photo> both(const Scene& scene) {
  return {synthetic_capture(scene, "Left"), synthetic_capture(scene, "Right")};
}

FitResult run(const FitSettings& settings, const Scene& scene = synthetic_scene(),
              const std::vector<UnknownParameter>& unknowns = synthetic_unknowns()) {
  Fit fit(scene, both(scene), unknowns, settings);
  while (fit.step()) {
  }
  return fit.result();
}

TEST(Fit, AdamFindsTheTruthWithoutNoise) {
  FitSettings settings = synthetic_settings({0, 0});
  settings.iterations = 600;
  settings.spp = 2;
  const FitResult result = run(settings);
  EXPECT_EQ(result.stopped, StopReason::kIterations) << result.message;
  EXPECT_LT((result.best - synthetic_truth()).cwiseAbs().maxCoeff(), 0.01)
      << result.best.transpose();
}

TEST(Fit, AdamComesCloseUnderNoise) {
  FitSettings settings = synthetic_settings({0.5, 0.5});
  settings.iterations = 300;
  const FitResult result = run(settings);
  EXPECT_LT((result.best - synthetic_truth()).cwiseAbs().maxCoeff(), 0.1)
      << result.best.transpose();
  EXPECT_LT(result.best_validation, 1e-3);
}

TEST(Fit, HistoryHoldsEveryIterationAndTheFinalState) {
  FitSettings settings = synthetic_settings();
  settings.iterations = 12;
  const FitResult result = run(settings);
  ASSERT_EQ(result.history.size(), 13u);
  EXPECT_EQ(result.history.front().values,
            Unknowns(synthetic_scene(), synthetic_unknowns()).start());
  EXPECT_EQ(result.history.back().values, result.last);
  double best = 1e9;
  for (const HistoryRow& row : result.history) {
    const bool due = row.iteration % 5 == 0 || row.iteration == 12;
    EXPECT_EQ(std::isfinite(row.validation), due) << row.iteration;
    EXPECT_TRUE(std::isfinite(row.loss));
    if (due) best = std::min(best, row.validation);
  }
  EXPECT_EQ(result.best_validation, best);
  EXPECT_EQ(result.history[static_cast<std::size_t>(result.best_iteration)].values, result.best);
  EXPECT_EQ(result.iterations, 12);
  constexpr int kPixels = 2 * kSyntheticSize * kSyntheticSize;
  EXPECT_EQ(result.samples, kPixels * (12 * 4 + 4 * 16)) << "3 + 1 validations of 16 samples";
}

TEST(Fit, IsRepeatableAndSeedsDiffer) {
  FitSettings settings = synthetic_settings();
  settings.iterations = 10;
  const FitResult a = run(settings), b = run(settings);
  settings.seed = 1;
  const FitResult c = run(settings);
  ASSERT_EQ(a.history.size(), b.history.size());
  for (std::size_t i = 0; i < a.history.size(); ++i) {
    EXPECT_EQ(a.history[i].values, b.history[i].values);
    EXPECT_EQ(a.history[i].loss, b.history[i].loss);
  }
  EXPECT_NE(a.history[0].loss, c.history[0].loss);
}

TEST(Fit, EveryStepHasSeedsOfItsOwnAndValidationAlwaysTheSame) {
  std::vector<std::uint64_t> steps, validations;
  FitSettings settings = synthetic_settings();
  settings.iterations = 11;
  settings.renderer = [&](const Scene& scene, const Camera& camera, const SlotLayout& layout,
                          const RenderSettings& render_settings, Progress* progress) {
    (layout.slots.empty() ? validations : steps).push_back(render_settings.seed);
    return SyntheticRenderer()(scene, camera, layout, render_settings, progress);
  };
  run(settings);
  EXPECT_EQ(steps.size(), 22u);
  EXPECT_EQ(validations.size(), 8u);
  std::sort(steps.begin(), steps.end());
  EXPECT_EQ(std::adjacent_find(steps.begin(), steps.end()), steps.end());
  for (std::size_t i = 2; i < validations.size(); ++i)
    EXPECT_EQ(validations[i], validations[i - 2]);
  EXPECT_NE(validations[0], validations[1]);
  EXPECT_FALSE(std::binary_search(steps.begin(), steps.end(), validations[0]));
}

TEST(Fit, OneStepPerCameraMovesTwiceAnIteration) {
  FitSettings settings = synthetic_settings({0, 0});
  settings.iterations = 1;
  settings.loss = "dual-buffer";
  const Vector start = Unknowns(synthetic_scene(), synthetic_unknowns()).start();
  const Vector together = run(settings).last - start;
  settings.accumulate = false;
  const Vector each = run(settings).last - start;
  EXPECT_NEAR(std::abs(together[0]), 0.03, 1e-6);
  EXPECT_NEAR(std::abs(each[0]), 0.06, 0.01);
}

TEST(Fit, MoreThanKMaxSlotsTakeSeveralPassesOfTheSameImage) {
  constexpr int kMaterials = 12;  // 4 slots each
  const Scene scene = synthetic_scene(kMaterials);
  std::vector<UnknownParameter> unknowns;
  for (const Material& material : scene.appearance.materials)
    for (UnknownParameter one : synthetic_unknowns()) {
      one.owner = material.name;
      unknowns.push_back(one);
    }
  std::vector<std::size_t> widths;
  FitSettings settings = synthetic_settings();
  settings.iterations = 1;
  settings.renderer = [&](const Scene& now, const Camera& camera, const SlotLayout& layout,
                          const RenderSettings& render_settings, Progress* progress) {
    if (!layout.slots.empty()) widths.push_back(layout.slots.size());
    return SyntheticRenderer()(now, camera, layout, render_settings, progress);
  };
  const FitResult split = run(settings, scene, unknowns);
  EXPECT_EQ(widths, (std::vector<std::size_t>{32, 16, 32, 16}));
  // Each material alone takes the same step as among others.
  for (int m : {0, 7, 11}) {
    const auto first = unknowns.begin() + 4 * m;
    const FitResult alone = run(settings, scene, {first, first + 4});
    EXPECT_LT((split.last.segment(6 * m, 6) - alone.last).norm(), 1e-9) << m;
  }
}

TEST(Fit, BestIsNotAStateThatOnePixelFavoured) {
  FitSettings settings = synthetic_settings({0, 0});
  settings.iterations = 100;
  int validations = 0;
  settings.renderer = [&](const Scene& scene, const Camera& camera, const SlotLayout& layout,
                          const RenderSettings& render_settings, Progress* progress) {
    Film film = SyntheticRenderer{0, 0}(scene, camera, layout, render_settings, progress);
    // A bright path in the first validation: by its variance the loss looks smaller than it is.
    if (layout.slots.empty() && validations++ == 0) film.variance[7] = Colorf(100.f);
    return film;
  };
  const FitResult result = run(settings);
  EXPECT_LT(result.history[0].validation, -0.05);
  EXPECT_GT(result.best_iteration, 50);
}

// ---- stopping

TEST(Fit, ToleranceStopsOnTheMeanOfThreeValidations) {
  FitSettings settings = synthetic_settings();
  settings.iterations = 300;
  settings.tolerance = 0.005;
  const FitResult result = run(settings);
  EXPECT_EQ(result.stopped, StopReason::kTolerance);
  EXPECT_LT(result.iterations, 300);
  EXPECT_EQ(result.history.back().values, result.last);
}

TEST(Fit, OneLuckySampleDoesNotStopIt) {
  FitSettings settings = synthetic_settings({0, 0});
  settings.iterations = 20;
  settings.tolerance = 0.01;
  settings.validation_interval = 1;
  const Scene truth = synthetic_scene();
  int validations = 0;
  settings.renderer = [&](const Scene& scene, const Camera& camera, const SlotLayout& layout,
                          const RenderSettings& render_settings, Progress* progress) {
    // The sixth validation (two cameras each) sees the truth by chance.
    const bool lucky = layout.slots.empty() && (validations++ / 2) == 5;
    Film film =
        SyntheticRenderer{0, 0}(lucky ? truth : scene, camera, layout, render_settings, progress);
    if (!lucky)
      for (Colorf& c : film.mean) c += Colorf(0.5f);
    return film;
  };
  const FitResult result = run(settings);
  EXPECT_EQ(result.stopped, StopReason::kIterations);
  EXPECT_NEAR(result.history[5].validation, 0, 1e-6);
}

TEST(Fit, ToleranceZeroNeverStops) {
  FitSettings settings = synthetic_settings({0, 0});
  settings.iterations = 30;
  Fit fit(synthetic_scene(), both(synthetic_scene()),
          {{"Body", "roughness", {0.4}, 0.02, 0.999, 1e-9}}, settings);
  while (fit.step()) {
  }
  EXPECT_EQ(fit.result().stopped, StopReason::kIterations);
}

TEST(Fit, StopsWhenTooManySamplesWereDropped) {
  FitSettings settings = synthetic_settings();
  settings.renderer = [](const Scene& scene, const Camera& camera, const SlotLayout& layout,
                         const RenderSettings& render_settings, Progress* progress) {
    Film film = SyntheticRenderer()(scene, camera, layout, render_settings, progress);
    film.dropped = 20;
    film.first_dropped = "pixel (3, 4), sample 1: d/d Body:ior";
    return film;
  };
  const FitResult result = run(settings);
  EXPECT_EQ(result.stopped, StopReason::kDropped);
  EXPECT_NE(result.message.find("Body:ior"), std::string::npos) << result.message;
  EXPECT_LE(result.iterations, 1);
}

TEST(Fit, AFewDroppedSamplesAreCountedOnly) {
  FitSettings settings = synthetic_settings();
  settings.iterations = 5;
  settings.renderer = [](const Scene& scene, const Camera& camera, const SlotLayout& layout,
                         const RenderSettings& render_settings, Progress* progress) {
    Film film = SyntheticRenderer()(scene, camera, layout, render_settings, progress);
    film.dropped = layout.slots.empty() ? 0 : 1;
    return film;
  };
  const FitResult result = run(settings);
  EXPECT_EQ(result.stopped, StopReason::kIterations);
  EXPECT_EQ(result.dropped, 10);
}

TEST(Fit, ACancelledStepLeavesNoTrace) {
  for (bool accumulate : {true, false}) {
    FitSettings settings = synthetic_settings();
    settings.accumulate = accumulate;
    settings.iterations = 10;
    const FitResult whole = run(settings);
    int renders = 0;
    settings.renderer = [&](const Scene& scene, const Camera& camera, const SlotLayout& layout,
                            const RenderSettings& render_settings, Progress* progress) {
      // Iterations 0-5 with validations at 0 and 5 are 16 renders; the second of iteration 6 fails.
      if (++renders == 18) throw Cancelled("cancelled");
      return SyntheticRenderer()(scene, camera, layout, render_settings, progress);
    };
    const FitResult cut = run(settings);
    EXPECT_EQ(cut.stopped, StopReason::kCancelled);
    EXPECT_EQ(cut.iterations, 6);
    ASSERT_EQ(cut.history.size(), 6u);
    EXPECT_EQ(cut.last, whole.history[6].values);
    for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(cut.history[i].values, whole.history[i].values);
  }
}

TEST(Fit, AFailureIsToldWithItsIteration) {
  FitSettings settings = synthetic_settings();
  int renders = 0;
  settings.renderer = [&](const Scene& scene, const Camera& camera, const SlotLayout& layout,
                          const RenderSettings& render_settings, Progress* progress) {
    if (++renders == 6) throw std::runtime_error("no memory");
    return SyntheticRenderer()(scene, camera, layout, render_settings, progress);
  };
  Fit fit(synthetic_scene(), both(synthetic_scene()), synthetic_unknowns(), settings);
  while (fit.step()) {
  }
  EXPECT_EQ(fit.result().stopped, StopReason::kError);
  EXPECT_EQ(text_of(fit.faults()), "Iteration 1: no memory");
}

// ---- settings

struct BadSetting {
  const char* name;
  void (*spoil)(FitSettings&);
  const char* says;
};
class BadSettings : public ::testing::TestWithParam<BadSetting> {};
TEST_P(BadSettings, AreNamedWithTheirRange) {
  FitSettings settings = synthetic_settings();
  GetParam().spoil(settings);
  try {
    run(settings);
    FAIL() << "accepted";
  } catch (const InvalidArgument& error) {
    EXPECT_NE(std::string(error.what()).find(GetParam().says), std::string::npos) << error.what();
  }
}
INSTANTIATE_TEST_SUITE_P(
    Table, BadSettings,
    ::testing::Values(
        BadSetting{"iterations", [](FitSettings& s) { s.iterations = 0; }, "iterations = 0 must"},
        BadSetting{"spp", [](FitSettings& s) { s.spp = 0; }, "spp = 0 must"},
        BadSetting{"pairs", [](FitSettings& s) { s.spp = 1; }, "needs spp of at least 2"},
        BadSetting{"tolerance", [](FitSettings& s) { s.tolerance = std::nan(""); },
                   "tolerance = nan"},
        BadSetting{"depth", [](FitSettings& s) { s.depth = -1; }, "depth = -1"},
        BadSetting{"threads", [](FitSettings& s) { s.threads = -1; }, "threads = -1"},
        BadSetting{"many_threads", [](FitSettings& s) { s.threads = 1025; }, "threads = 1025 must"},
        BadSetting{"interval", [](FitSettings& s) { s.validation_interval = 0; }, "interval = 0"},
        BadSetting{"validation_spp", [](FitSettings& s) { s.validation_spp = 1; },
                   "must lie in [2"},
        BadSetting{"loss", [](FitSettings& s) { s.loss = "L2"; }, "dual-buffer"},
        BadSetting{"optimiser", [](FitSettings& s) { s.optimiser = "sgd"; }, "auto, adam"}),
    [](const auto& info) { return info.param.name; });

TEST(FitSettings, EveryThingThatIsAcceptedCanBeRendered) {
  for (const SettingRange& range : fit_ranges())
    for (const SettingRange& of_render : render_ranges())
      if (std::string(range.name) == of_render.name) {
        EXPECT_GE(range.lowest, of_render.lowest) << range.name;
        EXPECT_LE(range.highest, of_render.highest) << range.name;
      }
  FitSettings settings = synthetic_settings();
  settings.iterations = static_cast<int>(range_of(fit_ranges(), "iterations").highest);
  settings.spp = static_cast<int>(range_of(fit_ranges(), "spp").highest);
  settings.check();
  RenderSettings pass;
  pass.spp = 4 * settings.chosen_refinement_spp();  // of the informative pixels beside fields
  EXPECT_NO_THROW(pass.check());
  pass.spp = settings.chosen_validation_spp();
  EXPECT_NO_THROW(pass.check());
  settings.iterations = 30;
  settings.spp = 5;
  EXPECT_EQ(settings.chosen_refinement_spp(), 150);
}

TEST(Fit, RefusesABlackPhotoBeforeItStartsWhereTheLossDividesByItsMean) {
  FitSettings settings = synthetic_settings();
  const Scene scene = synthetic_scene();
  std::vector<Photo> photos = {synthetic_capture(scene, "Left")};
  for (Colorf& pixel : photos[0].reference) pixel = Colorf(0.f);
  EXPECT_NO_THROW(Fit(scene, photos, synthetic_unknowns(), settings));
  settings.loss = "brightness-independent-mse";
  try {
    Fit(scene, photos, synthetic_unknowns(), settings);
    FAIL() << "accepted";
  } catch (const InvalidArgument& error) {
    EXPECT_NE(std::string(error.what()).find("Photo 'Left': it is black"), std::string::npos)
        << error.what();
  }
}

TEST(Fit, ReportsBadPhotosUnknownsAndSettingsTogether) {
  FitSettings settings = synthetic_settings();
  settings.iterations = 0;
  const Scene scene = synthetic_scene();
  try {
    Fit(scene, {}, {{"Bodi", "ior", {1.5}, 1, 2, 0.03}}, settings);
    FAIL() << "accepted";
  } catch (const InvalidArgument& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("photo"), std::string::npos) << text;
    EXPECT_NE(text.find("Bodi"), std::string::npos) << text;
    EXPECT_NE(text.find("iterations"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace selenite
