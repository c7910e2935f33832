// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <system_error>

#include "fit/problem/saved_state.h"
#include "fit/run/fit_job.h"
#include "fit/same_result.h"
#include "fit/synthetic_renderer.h"

namespace selenite {
namespace {

std::vector<Photo> both(const Scene& scene) {
  return {synthetic_capture(scene, "Left"), synthetic_capture(scene, "Right")};
}

FitSettings twelve(const std::string& optimiser, bool accumulate) {
  FitSettings settings = synthetic_settings();
  settings.iterations = 12;
  settings.optimiser = optimiser;
  settings.accumulate = accumulate;
  return settings;
}

class SavedFit : public testing::TestWithParam<std::tuple<const char*, bool, int>> {};

TEST_P(SavedFit, GoesOnToTheSameBits) {
  const auto [optimiser, accumulate, steps] = GetParam();
  const Scene scene = synthetic_scene();
  const FitSettings settings = twelve(optimiser, accumulate);
  Fit whole(scene, both(scene), synthetic_unknowns(), settings);
  std::string saved;
  while (whole.step())
    if (whole.result().iterations == steps) saved = whole.saved();
  Fit second(scene, both(scene), synthetic_unknowns(), settings);
  second.restore(saved);
  EXPECT_EQ(second.result().iterations, steps);
  while (second.step()) {
  }
  expect_same_result(whole.result(), second.result());
}

INSTANTIATE_TEST_SUITE_P(Optimisers, SavedFit,
                         testing::Values(std::tuple{"gauss-newton", true, 1},
                                         std::tuple{"gauss-newton", true, 7},
                                         std::tuple{"adam", true, 7},
                                         std::tuple{"adam", false, 4}));

/// Up to `most` states of each phase, from its first step on.
std::map<PhaseKind, std::vector<std::string>> states_of(Fit& fit, std::size_t most) {
  std::map<PhaseKind, std::vector<std::string>> states;
  std::map<PhaseKind, int> steps;
  while (fit.step()) {
    std::vector<std::string>& found = states[fit.result().phase];
    if (steps[fit.result().phase]++ % 7 == 0 && found.size() < most) found.push_back(fit.saved());
  }
  return states;
}

void expect_same_report(const TrustReport& a, const TrustReport& b) {
  EXPECT_EQ(a.passes, b.passes);
  EXPECT_EQ(a.misfit.value, b.misfit.value);
  EXPECT_EQ(a.alternatives, b.alternatives);
  EXPECT_EQ(a.ambiguous, b.ambiguous);
  ASSERT_EQ(a.components.size(), b.components.size());
  for (std::size_t k = 0; k < a.components.size(); ++k) {
    EXPECT_EQ(a.components[k].interval, b.components[k].interval) << k;
    EXPECT_EQ(a.components[k].standard_error, b.components[k].standard_error) << k;
  }
}

TEST(SavedFit, IsResumedInTheMidstOfAnyPhase) {
  const Scene scene = synthetic_scene();
  FitSettings settings = synthetic_settings({0.5, 0.5});
  settings.optimiser = "auto";
  settings.search = settings.refinement = "auto";
  settings.iterations = 14;
  settings.spp = 4;
  // Values exchanged between two that act alike are an alternative to be compared.
  std::vector<UnknownParameter> unknowns = synthetic_unknowns();
  unknowns.push_back({"Body", "coat_roughness", {0.2}, 0.02, 0.999, 0.03});
  Fit whole(scene, both(scene), unknowns, settings);
  const auto states = states_of(whole, 4);
  for (const PhaseKind phase : {PhaseKind::kMultiStart, PhaseKind::kDescent, PhaseKind::kRefinement,
                                PhaseKind::kComparison}) {
    SCOPED_TRACE(phase_text(phase));
    ASSERT_TRUE(states.contains(phase));
    for (const std::string& state : states.at(phase)) {
      Fit second(scene, both(scene), unknowns, settings);
      second.restore(state);
      EXPECT_EQ(second.result().phase, phase);
      EXPECT_EQ(second.saved(), state);
      while (second.step()) {
      }
      expect_same_result(whole.result(), second.result());
      expect_same_report(whole.result().report, second.result().report);
    }
  }
}

TEST(SavedFit, IsRefusedWhereItDoesNotBelong) {
  const Scene scene = synthetic_scene();
  const FitSettings settings = twelve("gauss-newton", true);
  Fit fit(scene, both(scene), synthetic_unknowns(), settings);
  fit.step();
  const std::string saved = fit.saved();
  EXPECT_THROW(fit.restore(saved), InvalidArgument) << "it has begun";
  FitSettings other = settings;
  other.seed = 5;
  Fit otherwise(scene, both(scene), synthetic_unknowns(), other);
  EXPECT_THROW(otherwise.restore(saved), InvalidArgument);
  Fit adam(scene, both(scene), synthetic_unknowns(), twelve("adam", true));
  EXPECT_THROW(adam.restore(saved), InvalidArgument);
  std::vector<Photo> photos = both(scene);
  photos[1].reference[5].b += 1e-3f;
  Fit retouched(scene, photos, synthetic_unknowns(), settings);
  EXPECT_THROW(retouched.restore(saved), InvalidArgument) << "a photo has changed";
}

TEST(SavedFit, DamagedBytesAreRefused) {
  const Scene scene = synthetic_scene();
  const FitSettings settings = twelve("gauss-newton", true);
  Fit fit(scene, both(scene), synthetic_unknowns(), settings);
  fit.step();
  const std::string saved = fit.saved();
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{5}, saved.size() / 2, saved.size() - 1})
    EXPECT_THROW(Fit(scene, both(scene), synthetic_unknowns(), settings)
                     .restore(std::string_view(saved).substr(0, size)),
                 InvalidArgument)
        << size;
  for (std::size_t at = 0; at < saved.size(); at += saved.size() / 50) {
    std::string wrong = saved;
    wrong[at] = static_cast<char>(wrong[at] ^ 1);
    EXPECT_THROW(Fit(scene, both(scene), synthetic_unknowns(), settings).restore(wrong),
                 InvalidArgument)
        << at;
  }
}

class StateFiles : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder); }
  void TearDown() override { std::filesystem::remove_all(folder); }
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) /
      testing::UnitTest::GetInstance()->current_test_info()->name();
};

TEST_F(StateFiles, TheJobHandsThemOutOnceAndCountsTheirSeconds) {
  const Scene scene = synthetic_scene();
  FitSettings settings = twelve("gauss-newton", true);
  settings.iterations = 100000;
  FitJob job(scene, both(scene), synthetic_unknowns(), settings);
  EXPECT_FALSE(job.take_state());
  job.start();
  const auto file = folder / "state";
  job.request_state(file);
  std::optional<WrittenState> saved;
  while (!saved) saved = job.take_state();
  EXPECT_EQ(saved->file, file);
  EXPECT_GT(saved->seconds, 0);
  EXPECT_FALSE(job.take_state());
  EXPECT_THROW(job.restore(file, 0), InvalidArgument) << "it has been started";
  job.cancel();
  job.join();
  FitJob second(scene, both(scene), synthetic_unknowns(), settings);
  second.restore(file, 50);
  EXPECT_GE(second.state().seconds, 50);
  EXPECT_GT(second.state().iteration, 0);
}

TEST_F(StateFiles, HoldWhatIsSavedInMemory) {
  const Scene scene = synthetic_scene();
  Fit fit(scene, both(scene), synthetic_unknowns(), twelve("gauss-newton", true));
  fit.step();
  SavedState::write(folder / "state", fit);
  std::ifstream stream(folder / "state", std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  EXPECT_TRUE(bytes == fit.saved());  // too long to be shown
}

TEST_F(StateFiles, DamagedOnesAreRefused) {
  const Scene scene = synthetic_scene();
  const FitSettings settings = twelve("gauss-newton", true);
  Fit fit(scene, both(scene), synthetic_unknowns(), settings);
  fit.step();
  const auto file = folder / "state";
  SavedState::write(file, fit);
  const auto size = std::filesystem::file_size(file);
  for (const std::uintmax_t left : {size - 1, size / 2, std::uintmax_t{5}, std::uintmax_t{0}}) {
    std::filesystem::resize_file(file, left);
    FitJob job(scene, both(scene), synthetic_unknowns(), settings);
    EXPECT_THROW(job.restore(file, 0), InvalidArgument) << left;
  }
  FitJob job(scene, both(scene), synthetic_unknowns(), settings);
  EXPECT_THROW(job.restore(folder / "none", 0), std::system_error);
  const std::string saved = fit.saved();
  for (std::size_t at = 0; at < saved.size(); at += saved.size() / 50) {
    std::string wrong = saved;
    wrong[at] = static_cast<char>(wrong[at] ^ 1);
    std::ofstream(file, std::ios::binary) << wrong;
    EXPECT_THROW(SavedState::read(file, fit), InvalidArgument) << at;
  }
}

TEST_F(StateFiles, AreGoneUnlessTheyAreSealed) {
  for (const bool sealed : {true, false}) {
    const auto file = folder / (sealed ? "whole" : "part");
    {
      StateFile state(file, StateFile::kWrite, 3);
      state.write("abc");
      if (sealed) state.seal();
    }
    EXPECT_EQ(std::filesystem::exists(file), sealed);
  }
}

TEST_F(StateFiles, ThatCannotBeWrittenAreSaidAndLeaveNothing) {
  const Scene scene = synthetic_scene();
  FitJob job(scene, both(scene), synthetic_unknowns(), twelve("gauss-newton", true));
  job.start();
  job.join();
  job.request_state(folder / "none" / "state");
  try {
    (void)job.take_state();
    FAIL() << "there is no such folder";
  } catch (const std::system_error& error) {
    EXPECT_EQ(error.code(), std::errc::no_such_file_or_directory);
  }
  EXPECT_FALSE(job.take_state());
  EXPECT_TRUE(std::filesystem::is_empty(folder));
}

}  // namespace
}  // namespace selenite
