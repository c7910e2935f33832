// SPDX-License-Identifier: GPL-3.0-or-later
// A fit whose photos others render takes the same steps as one that renders itself.
#include "fit/problem/render_workers.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "fit/evaluate/packed_film.h"
#include "fit/evaluate/photo_question.h"
#include "fit/run/stage_worker.h"
#include "fit/run/staged_fit.h"
#include "fit/same_result.h"
#include "fit/synthetic_renderer.h"

namespace selenite {
namespace {

/// Workers in this process. They answer the newest question first.
class Here final : public RenderWorkers {
 public:
  Here(const std::vector<UnknownParameter>& unknowns, std::vector<Stage> stages, int at_once)
      : worker_(unknowns, without_pixels(std::move(stages)), 1), at_once_(at_once) {}

  std::int64_t ask(const std::string& question, double work) override {
    EXPECT_GT(work, 0);
    waiting_[++asked] = question;
    most_waiting = std::max(most_waiting, waiting_.size());
    return asked;
  }
  std::string answer(std::int64_t number, const Progress*) override {
    for (auto one = waiting_.rbegin(); one != waiting_.rend(); ++one)
      answers_[one->first] = worker_.answer(one->second);
    waiting_.clear();
    return std::move(answers_.extract(number).mapped());
  }
  void forget(std::int64_t number) override {
    waiting_.erase(number);
    answers_.erase(number);
    ++forgotten;
  }
  int busy_with() const override { return at_once_; }
  std::size_t left() const { return waiting_.size() + answers_.size(); }

  std::int64_t asked = 0;
  int forgotten = 0;
  std::size_t most_waiting = 0;

 private:
  static std::vector<Stage> without_pixels(std::vector<Stage> stages) {
    for (Stage& stage : stages)
      for (Photo& photo : stage.photos) {
        photo.width = photo.height = 1;
        photo.reference = {Colorf(1)};
        photo.weight = {1};
      }
    return stages;
  }

  StageWorker worker_;
  int at_once_;
  std::map<std::int64_t, std::string> waiting_, answers_;
};

Stage stage_of(const Scene& scene, const std::vector<UnknownParameter>& unknowns,
               const FitSettings& settings) {
  Stage stage;
  for (const UnknownParameter& one : unknowns) stage.parameters.push_back(one.name());
  stage.scene = scene;
  stage.photos = {synthetic_capture(scene, "Left"), synthetic_capture(scene, "Right")};
  // Some pixels do not count: they are not rendered.
  stage.photos[0].weight.assign(stage.photos[0].size(), 0);
  std::fill_n(stage.photos[0].weight.begin(), 20, 1.f);
  stage.settings = settings;
  return stage;
}

std::vector<PhaseKind> expect_same_steps(const std::vector<UnknownParameter>& unknowns,
                                         std::vector<Stage> stages, int at_once) {
  StagedFit plain(unknowns, stages);
  const auto workers = std::make_shared<Here>(unknowns, stages, at_once);
  for (Stage& one : stages) one.settings.workers = workers;
  std::set<PhaseKind> phases;
  {
    StagedFit fit(unknowns, stages);
    for (bool more = true; more;) {
      phases.insert(plain.fit().result().phase);
      more = plain.step();
      EXPECT_EQ(fit.step(), more);
      expect_same_result(plain.fit().result(), fit.fit().result());
      if (testing::Test::HasFailure()) break;
    }
    EXPECT_EQ(fit.fit().result().message, "");
  }
  EXPECT_GT(workers->asked, 0);
  EXPECT_GE(workers->most_waiting, 2u) << "they are never busy with two photos";
  EXPECT_EQ(workers->left(), 0u);
  EXPECT_LE(workers->forgotten, workers->asked / 10) << "most of what is expected is needed";
  return {phases.begin(), phases.end()};
}

TEST(RenderWorkers, AFitTakesTheSameStepsInAllPhases) {
  FitSettings settings = synthetic_settings();
  settings.optimiser = "gauss-newton";
  settings.search = settings.refinement = "on";
  settings.iterations = 12;
  settings.tolerance = 0;
  for (const int at_once : {1, 3, 40}) {
    const std::vector<PhaseKind> phases =
        expect_same_steps(synthetic_unknowns(),
                          {stage_of(synthetic_scene(), synthetic_unknowns(), settings)}, at_once);
    for (const PhaseKind one :
         {PhaseKind::kMultiStart, PhaseKind::kDescent, PhaseKind::kRefinement})
      EXPECT_TRUE(std::ranges::count(phases, one)) << "else its renders are not seen";
  }
}

TEST(RenderWorkers, AdamTakesTheSameStepsAfterEachPhotoAndAfterAll) {
  for (const bool accumulate : {false, true}) {
    FitSettings settings = synthetic_settings();
    settings.optimiser = "adam";
    settings.refinement = "off";
    settings.accumulate = accumulate;
    settings.iterations = 8;
    settings.tolerance = 0;
    expect_same_steps(synthetic_unknowns(),
                      {stage_of(synthetic_scene(), synthetic_unknowns(), settings)}, 2);
  }
}

TEST(RenderWorkers, KnowWhereAStageStarted) {
  const Scene scene = synthetic_scene();
  const std::vector<UnknownParameter> unknowns = synthetic_unknowns();
  FitSettings settings = synthetic_settings();
  settings.optimiser = "adam";
  settings.iterations = 6;
  settings.tolerance = 0;
  // The colour is found first and stays: a worker has to know it.
  Stage first = stage_of(scene, {unknowns[0]}, settings);
  Stage second = stage_of(scene, {unknowns.begin() + 1, unknowns.end()}, settings);
  first.name = "colour";
  second.name = "rest";
  second.settings.seed = 7;
  expect_same_steps(unknowns, {first, second}, 2);
}

TEST(RenderWorkers, AFreeGainAndAnAlignmentAreTheFits) {
  FitSettings settings = synthetic_settings();
  settings.optimiser = "gauss-newton";
  settings.search = "on";
  settings.iterations = 6;
  settings.tolerance = 0;
  Stage stage = stage_of(synthetic_scene(), synthetic_unknowns(), settings);
  stage.photos[0].gain_freedom = GainFreedom::kRgb;
  stage.photos[1].align = true;
  expect_same_steps(synthetic_unknowns(), {stage}, 2);
}

TEST(RenderWorkers, RefuseDamagedQuestions) {
  const std::vector<UnknownParameter> unknowns = synthetic_unknowns();
  const Stage stage = stage_of(synthetic_scene(), unknowns, synthetic_settings());
  StageWorker worker(unknowns, {stage}, 1);
  for (const std::string& bad : {std::string(), std::string("short"), std::string(64, 'x')})
    EXPECT_THROW(worker.answer(bad), InvalidArgument);
}

Film noisy_film(int slots) {
  Film film(4, 3, 8, slots);
  for (std::size_t i = 0; i < film.size(); ++i) {
    const auto x = static_cast<float>(i);
    film.mean[i] = {x, -x, 1 / (x + 1)};
    film.half_a[i] = {x + 0.5f, -0.f, x};
    for (SlotFilm& slot : film.slots) slot.mean[i] = slot.covariance[i] = {-x, x, 0};
  }
  film.dropped = 3;
  film.first_dropped = "pixel 2";
  film.cpu_seconds = 0.25;
  return film;
}

void expect_same(const Film& one, const Film& other) {
  const auto bytes = [](const Picture& p) {
    return std::string(reinterpret_cast<const char*>(p.data()), p.size() * sizeof(Colorf));
  };
  EXPECT_EQ(bytes(one.mean), bytes(other.mean));
  EXPECT_EQ(bytes(one.half_a), bytes(other.half_a));
  EXPECT_EQ(bytes(one.variance), bytes(other.variance));
  ASSERT_EQ(one.slots.size(), other.slots.size());
  for (std::size_t s = 0; s < one.slots.size(); ++s) {
    EXPECT_EQ(bytes(one.slots[s].mean), bytes(other.slots[s].mean));
    EXPECT_EQ(bytes(one.slots[s].covariance), bytes(other.slots[s].covariance));
    EXPECT_EQ(one.slots[s].aim_excess.size(), other.slots[s].aim_excess.size());
  }
  EXPECT_EQ(one.spp, other.spp);
  EXPECT_EQ(one.dropped, other.dropped);
  EXPECT_EQ(one.first_dropped, other.first_dropped);
  EXPECT_EQ(one.cpu_seconds, other.cpu_seconds);
}

TEST(PackedFilm, ComesBackBitByBit) {
  const Film film = noisy_film(2);
  expect_same(film, unpacked_film(packed(film, nullptr), nullptr));
  // Outside of the mask it is not the same everywhere: nothing may be left out.
  PixelMask some(film.size());
  some[1] = some[5] = 1;
  expect_same(film, unpacked_film(packed(film, &some), &some));
}

TEST(PackedFilm, IsAsLargeAsWhatWasRendered) {
  Film film = noisy_film(2);
  const std::size_t whole = packed(film, nullptr).size();
  PixelMask some(film.size());
  some[1] = some[5] = 1;
  const auto blacken = [&](Picture& picture, float black) {
    for (std::size_t i = 0; i < picture.size(); ++i)
      if (!some[i]) picture[i] = Colorf(black);
  };
  blacken(film.mean, 0);
  blacken(film.half_a, 0);
  for (SlotFilm& slot : film.slots) {
    blacken(slot.mean, -0.f);
    blacken(slot.covariance, 0);
  }
  const std::string bytes = packed(film, &some);
  expect_same(film, unpacked_film(bytes, &some));
  EXPECT_LT(bytes.size() + 8 * 6 * sizeof(Colorf), whole)
      << "six pictures are of two pixels, not of twelve";
  EXPECT_THROW(unpacked_film(bytes, nullptr), InvalidArgument);
  EXPECT_THROW(unpacked_film(std::string_view(bytes).substr(0, bytes.size() - 1), &some),
               InvalidArgument);
  EXPECT_THROW(unpacked_film(bytes + "x", &some), InvalidArgument);
}

TEST(PackedFilm, TakesABitForABlackPixel) {
  Film film = noisy_film(2);
  const std::size_t whole = packed(film, nullptr).size();
  for (SlotFilm& slot : film.slots)
    for (std::size_t i = 3; i < film.size(); ++i) slot.mean[i] = Colorf(0.f);
  film.slots[1].mean[8] = Colorf(-0.f);  // which has other bits than black
  const std::string bytes = packed(film, nullptr);
  expect_same(film, unpacked_film(bytes, nullptr));
  EXPECT_LT(bytes.size() + 15 * sizeof(Colorf), whole);
  PixelMask some(film.size());
  some[0] = some[4] = some[8] = 1;
  for (std::size_t i = 0; i < film.size(); ++i)
    if (!some[i])
      film.mean[i] = film.half_a[i] = film.slots[0].mean[i] = film.slots[1].mean[i] = Colorf(1.f);
  expect_same(film, unpacked_film(packed(film, &some), &some));
  EXPECT_THROW(unpacked_film(bytes.substr(0, bytes.size() - 4), nullptr), InvalidArgument);
}

}  // namespace
}  // namespace selenite
