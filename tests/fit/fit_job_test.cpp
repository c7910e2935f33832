// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/run/fit_job.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <future>
#include <string>

#include "fit/synthetic_renderer.h"

namespace selenite {
namespace {

std::vector<Photo> one(const Scene& scene) { return {synthetic_capture(scene, "Left")}; }

/// A renderer that holds every render until it is let go or cancelled, as a long one would.
struct Gate {
  std::atomic<int> started{0};
  std::atomic<bool> open{false};
  Renderer renderer() {
    return [this](const Scene& scene, const Camera& camera, const SlotLayout& layout,
                  const RenderSettings& settings, Progress* progress) {
      ++started;
      while (!open && !progress->cancelled) std::this_thread::yield();
      return SyntheticRenderer()(scene, camera, layout, settings, progress);
    };
  }
  void wait_for_render() const {
    while (started == 0) std::this_thread::yield();
  }
};

TEST(FitJob, DoesWhatTheFitDoes) {
  FitSettings settings = synthetic_settings();
  settings.iterations = 12;
  const Scene scene = synthetic_scene();
  FitJob job(scene, one(scene), synthetic_unknowns(), settings);
  EXPECT_FALSE(job.state().running);
  EXPECT_EQ(job.preview(0), nullptr);
  job.start();
  job.join();
  Fit fit(scene, one(scene), synthetic_unknowns(), settings);
  while (fit.step()) {
  }
  EXPECT_EQ(job.result().newest.result.last, fit.result().last);
  EXPECT_EQ(job.result().newest.result.best, fit.result().best);
  const FitState state = job.state();
  EXPECT_TRUE(state.done);
  EXPECT_FALSE(state.running);
  EXPECT_EQ(state.iteration, 12);
  EXPECT_EQ(state.stopped, StopReason::kIterations);
  EXPECT_EQ(state.seconds_left, 0);
  EXPECT_TRUE(state.faults.empty());
  ASSERT_NE(job.preview(0), nullptr);
  EXPECT_EQ(job.preview(0)->size(), static_cast<std::size_t>(kSyntheticSize * kSyntheticSize));
}

TEST(FitJob, CancelEndsItSoonWithAConsistentState) {
  Gate gate;
  FitSettings settings = synthetic_settings();
  settings.renderer = gate.renderer();
  const Scene scene = synthetic_scene();
  FitJob job(scene, one(scene), synthetic_unknowns(), settings);
  job.start();
  gate.wait_for_render();
  EXPECT_TRUE(job.state().running);
  EXPECT_EQ(job.state().stopped, StopReason::kNone);
  job.cancel();
  job.join();
  const FitState state = job.state();
  EXPECT_TRUE(state.done);
  EXPECT_EQ(state.stopped, StopReason::kCancelled);
  EXPECT_TRUE(state.faults.empty());
  EXPECT_EQ(state.iteration, 0);
  EXPECT_EQ(job.result().newest.result.best, job.result().newest.problem->unknowns().start());
}

TEST(FitJob, TheDestructorEndsARunningFit) {
  Gate gate;
  FitSettings settings = synthetic_settings();
  settings.renderer = gate.renderer();
  const Scene scene = synthetic_scene();
  {
    FitJob job(scene, one(scene), synthetic_unknowns(), settings);
    job.start();
    gate.wait_for_render();
  }
  SUCCEED();
}

TEST(FitJob, MayBeDroppedWithoutHavingBeenStarted) {
  const Scene scene = synthetic_scene();
  const FitJob job(scene, one(scene), synthetic_unknowns(), synthetic_settings());
  EXPECT_EQ(job.state().seconds, 0);
}

TEST(FitJob, StartsOnce) {
  FitSettings settings = synthetic_settings();
  settings.iterations = 1;
  const Scene scene = synthetic_scene();
  FitJob job(scene, one(scene), synthetic_unknowns(), settings);
  job.start();
  EXPECT_THROW(job.start(), InvalidArgument);
  job.join();
  job.join();
}

/// Of a fit whose first render throws `Error`.
template <class Error>
FitState failed(const Error& error) {
  FitSettings settings = synthetic_settings();
  settings.renderer = [error](const Scene&, const Camera&, const SlotLayout&, const RenderSettings&,
                              Progress*) -> Film { throw error; };
  const Scene scene = synthetic_scene();
  FitJob job(scene, one(scene), synthetic_unknowns(), settings);
  job.start();
  job.join();
  EXPECT_TRUE(job.state().done);
  EXPECT_EQ(job.state().stopped, StopReason::kError);
  return job.state();
}

TEST(FitJob, AnErrorIsAFaultOfTheState) {
  const FitState plain = failed(std::runtime_error("broken"));
  ASSERT_EQ(plain.faults.size(), 1U);
  EXPECT_EQ(plain.faults[0].line(), "Iteration 0: broken");
  const FitState memory = failed(std::bad_alloc());
  ASSERT_EQ(memory.faults.size(), 1U);
  EXPECT_EQ(memory.faults[0].cure, "lower the height or fit fewer photos at once");
  const FitState refused = failed(Refused("Camera 'A'", "it is gone", "add it"));
  ASSERT_EQ(refused.faults.size(), 1U);
  EXPECT_EQ(refused.faults[0].line(), "Camera 'A': it is gone; add it");
}

// What is read without its lock shows under the thread sanitizer (./dev test native --preset thread).
TEST(FitJob, CanBeWatchedFromManyThreads) {
  FitSettings settings = synthetic_settings();
  settings.iterations = 40;
  const Scene scene = synthetic_scene();
  FitJob job(scene, one(scene), synthetic_unknowns(), settings);
  job.start();
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "WatchedStates";
  std::filesystem::create_directories(folder);
  std::vector<std::future<int>> watchers;
  for (int i = 0; i < 3; ++i)
    watchers.push_back(std::async(std::launch::async, [&, i] {
      int last = 0;
      for (int asked = 0; !job.state().done; ++asked) {
        const FitState state = job.state();
        EXPECT_GE(state.iteration, last);
        last = state.iteration;
        EXPECT_EQ(job.result().newest.result.last.size(), 6);
        job.preview(0);
        // A name of its own: while one thread looks at a file, another may ask for the next.
        job.request_state(folder / (std::to_string(i) + "." + std::to_string(asked)));
        if (const auto saved = job.take_state()) {
          EXPECT_GT(std::filesystem::file_size(saved->file), 0U);
        }
        EXPECT_GE(job.seconds(), 0);
      }
      return last;
    }));
  job.join();
  for (auto& watcher : watchers) EXPECT_LE(watcher.get(), 40);
  std::filesystem::remove_all(folder);
}

TEST(FitJob, NamesTheRangeOfPreviews) {
  const Scene scene = synthetic_scene();
  const FitJob job(scene, one(scene), synthetic_unknowns(), synthetic_settings());
  EXPECT_THROW(job.preview(1), InvalidArgument);
  EXPECT_THROW(job.preview(-1), InvalidArgument);
}

}  // namespace
}  // namespace selenite
