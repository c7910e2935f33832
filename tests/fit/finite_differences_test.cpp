// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/evaluate/finite_differences.h"

#include <gtest/gtest.h>

#include "fit/solver/instrumental_variables.h"
#include "fit/synthetic_renderer.h"
#include "math/sample_mean.h"

namespace selenite {
namespace {
constexpr Eigen::Index kRoughness = 3, kTransmission = 4, kIor = 5;
/// Away from the truth, so that residuals do not vanish.
struct Setting {
  Scene scene;
  Unknowns unknowns;
  SlotLayout layout{unknowns.layout(scene)};
  std::vector<Photo> photos{synthetic_capture(scene, "Left")};
  Vector x{{0.25, 0.3, 0.5, 0.25, 0.7, 1.35}};
  const Loss& loss = find_loss("dual-buffer");
  Problem problem{unknowns, layout, photos, loss, 10};
  Reparametrization reparametrization{unknowns};

  explicit Setting(const std::vector<UnknownParameter>& wanted = synthetic_unknowns(),
                   int materials = 1)
      : scene(synthetic_scene(materials)), unknowns(scene, wanted) {
    check_photos(scene, photos);
  }

  Film film(const Vector& at, const SyntheticRenderer& renderer, int spp, std::uint64_t seed,
            const SlotLayout& slots) const {
    RenderSettings settings;
    settings.width = settings.height = kSyntheticSize;
    settings.spp = spp;
    settings.seed = seed;
    const Scene now = unknowns.scene_with(scene, at);
    return renderer(now, now.cameras[0], slots, settings, nullptr);
  }
  Film film(const Vector& at, const SyntheticRenderer& renderer, int spp,
            std::uint64_t seed) const {
    return film(at, renderer, spp, seed, layout);
  }
  Film with_differences(const SyntheticRenderer& renderer, int spp, std::uint64_t seed,
                        Purpose purpose = Purpose::kGradient, Differences which = {}) const {
    return render_derivatives(problem, &reparametrization, unknowns.scene_with(scene, x), photos[0],
                              x, purpose, which,
                              [&](const Vector& at, const SlotLayout& slots, Paths paths) {
                                const std::uint64_t other = paths == Paths::kOther ? 1000000 : 0;
                                return film(at, renderer, spp, seed + other, slots);
                              });
  }
  Vector gradient(const Film& of) const {
    return loss_gradient(layout, of, loss.evaluate(of, photos[0]));
  }
  double expected_loss(const Vector& at) const {
    return loss.evaluate(film(at, {0, 0}, 2, 0), photos[0]).value;
  }
};

TEST(FiniteDifferences, GradientsTakeTheIorOnly) {
  const Setting s;
  const SyntheticRenderer renderer{0.5, 0.5};
  const Film plain = s.film(s.x, renderer, 4, 1), with = s.with_differences(renderer, 4, 1);
  for (Eigen::Index k = 0; k < s.x.size(); ++k) {
    const auto slot = static_cast<std::size_t>(s.layout.rows[static_cast<std::size_t>(k)].slot);
    const bool same = plain.slots[slot].mean[20].g == with.slots[slot].mean[20].g;
    EXPECT_EQ(same, k != kIor) << k;
  }
}

/// The derivative is the better estimate where little is refracted, or widely.
TEST(FiniteDifferences, GradientsKeepTheDerivativeByIorWithoutSharpRefraction) {
  Setting s;
  for (const auto& [roughness, transmission] :
       {std::pair{0.05, 0.05}, std::pair{0.05, 0.0}, std::pair{0.6, 1.0}}) {
    s.x[kRoughness] = roughness;
    s.x[kTransmission] = transmission;
    const Film plain = s.film(s.x, {0.5, 0.5}, 4, 1), with = s.with_differences({0.5, 0.5}, 4, 1);
    const auto slot = static_cast<std::size_t>(s.layout.rows[kIor].slot);
    EXPECT_EQ(plain.slots[slot].mean[20].g, with.slots[slot].mean[20].g) << roughness;
  }
}

TEST(FiniteDifferences, ATexturedRoughnessMayBeSharp) {
  const Setting s({synthetic_unknowns()[3]});
  Scene scene = s.scene;
  const auto pictures = [&] {
    int count = 0;
    (void)render_derivatives(s.problem, &s.reparametrization, scene, s.photos[0],
                             s.unknowns.start(), Purpose::kGradient, {},
                             [&](const Vector& at, const SlotLayout& layout, Paths) {
                               ++count;
                               return s.film(at, {0.5, 0.5}, 4, 1, layout);
                             });
    return count;
  };
  scene.appearance.materials[0].values.roughness = 0.9;
  EXPECT_EQ(pictures(), 1);
  FieldMap map;
  map.field = scene.find("Body", "roughness").field;
  scene.appearance.materials[0].maps = {map};
  EXPECT_EQ(pictures(), 3);
}

/// Paths choose otherwise where they carry derivatives: equal seeds are not equal paths then. Two
/// pictures without derivatives go together, and one with the film does if it carries what the film
/// does. What differences replace nothing carries.
TEST(FiniteDifferences, WhatIsHeldAgainstTheFilmIsRenderedLikeIt) {
  Setting s;
  const std::size_t all = s.layout.slots.size();
  const auto asked = [&](Purpose purpose, Side side) {
    std::vector<std::size_t> slots;
    (void)render_derivatives(s.problem, &s.reparametrization, s.unknowns.scene_with(s.scene, s.x),
                             s.photos[0], s.x, purpose, {side},
                             [&](const Vector& at, const SlotLayout& layout, Paths paths) {
                               if (paths != Paths::kDirect) slots.push_back(layout.slots.size());
                               return s.film(at, {0.5, 0.5}, 4, 1, layout);
                             });
    return slots;
  };
  using Slots = std::vector<std::size_t>;
  const std::size_t rest = all - 2;  // without roughness and IOR
  EXPECT_EQ(asked(Purpose::kInstrumental, Side::kUp), Slots(3, rest));
  EXPECT_EQ(asked(Purpose::kInstrumental, Side::kDown), Slots(3, rest));
  EXPECT_EQ(asked(Purpose::kInstrumental, Side::kBoth), (Slots{rest, 0, 0, 0, 0}));
  EXPECT_EQ(asked(Purpose::kGradient, Side::kBoth), (Slots{all - 1, 0, 0}));
  s.x[kIor] = 9.5;  // up by 0.35 in log(x - 1) would be beyond 10: one side only
  EXPECT_EQ(asked(Purpose::kInstrumental, Side::kBoth), (Slots{rest, 0, 0, rest}));
}

/// Through glass a highlight changes by little noise, and what is seen through it by much. The picture at
/// x is shared by roughness and IOR.
TEST(FiniteDifferences, InstrumentsOfGlassHaveTheirDirectShare) {
  Setting s;
  const auto direct = [&](Purpose purpose, Side side, DirectOf of = DirectOf::kAll) {
    int pictures = 0;
    const Film film = render_derivatives(
        s.problem, &s.reparametrization, s.unknowns.scene_with(s.scene, s.x), s.photos[0], s.x,
        purpose, {.side = side, .of_roughness = side, .direct = of},
        [&](const Vector& at, const SlotLayout& layout, Paths paths) {
          pictures += paths == Paths::kDirect;
          return s.film(at, {0.5, 0.5}, 4, 1, layout);
        });
    std::vector<Eigen::Index> apart;
    for (Eigen::Index k = 0; k < s.x.size(); ++k) {
      const UnknownRow& row = s.layout.rows[static_cast<std::size_t>(k)];
      const SlotFilm& slot = film.slots[static_cast<std::size_t>(row.slot)];
      EXPECT_EQ(slot.direct.size(), slot.direct_half_a.size()) << k;
      if (slot.direct.empty()) continue;
      apart.push_back(k);
      // The renderer of this test has no other surface to go to.
      EXPECT_EQ(slot.direct[20].g, slot.mean[20].g) << k;
      EXPECT_EQ(slot.direct_half_a[20].g, slot.half_a[20].g) << k;
    }
    return std::pair{pictures, apart};
  };
  using Found = std::pair<int, std::vector<Eigen::Index>>;
  const std::vector<Eigen::Index> both{kRoughness, kIor};
  EXPECT_EQ(direct(Purpose::kInstrumental, Side::kUp), (Found{3, both}));
  EXPECT_EQ(direct(Purpose::kInstrumental, Side::kBoth), (Found{4, both}));
  EXPECT_EQ(direct(Purpose::kGradient, Side::kBoth), (Found{0, {}}));
  EXPECT_EQ(direct(Purpose::kInstrumental, Side::kUp, DirectOf::kMedia), (Found{0, {}}));
  s.scene.appearance.materials[0].values.extinction = Color<double>(2);
  EXPECT_EQ(direct(Purpose::kInstrumental, Side::kUp, DirectOf::kMedia), (Found{3, both}));
  s.x[kTransmission] = 0;
  EXPECT_EQ(direct(Purpose::kInstrumental, Side::kUp), (Found{0, {}}));
}

/// Whatever their number, each comes once in a round, from above and from below in turns.
TEST(FiniteDifferences, AreTakenInRounds) {
  constexpr int kDifferences = 5, kIterations = 40;
  std::vector<std::vector<Side>> sides(kDifferences);
  std::vector<int> pictures;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const Differences now = differences_of(Purpose::kInstrumental, iteration);
    pictures.push_back(0);
    for (int i = 0; i < kDifferences; ++i) {
      EXPECT_EQ(now.of_roughness, now.side);
      if (!now.taken(i)) continue;
      sides[static_cast<std::size_t>(i)].push_back(now.side);
      ++pictures.back();
    }
  }
  EXPECT_EQ(std::vector<int>(pictures.begin(), pictures.begin() + 10),
            (std::vector<int>{5, 5, 5, 5, 2, 2, 1, 2, 2, 1}));
  for (const std::vector<Side>& of_one : sides) {
    EXPECT_EQ(of_one.size(), 4u + 36 / 3);
    for (std::size_t n = 0; n < of_one.size(); ++n)
      EXPECT_EQ(of_one[n], n % 2 == 0 ? Side::kUp : Side::kDown);
  }
  for (const int iteration : {0, 1, 17}) {
    const Differences gradient = differences_of(Purpose::kGradient, iteration);
    EXPECT_EQ(gradient.side, Side::kBoth);
    for (int i = 0; i < kDifferences; ++i) EXPECT_TRUE(gradient.taken(i));
  }
}

TEST(FiniteDifferences, ARoughnessHasASideOfItsOwn) {
  const Setting s;
  const auto slots = [&](Differences which) {
    return s.with_differences({0.5, 0.5}, 4, 1, Purpose::kInstrumental, which).slots;
  };
  const auto up = slots({Side::kUp}), both = slots({Side::kBoth});
  const auto mixed = slots({Side::kUp, Side::kBoth});
  const auto slot_of = [&](int component) {
    return static_cast<std::size_t>(s.layout.rows[static_cast<std::size_t>(component)].slot);
  };
  const auto red = [](const SlotFilm& slot) { return slot.mean.front().r; };
  EXPECT_EQ(red(mixed[slot_of(kRoughness)]), red(both[slot_of(kRoughness)]));
  EXPECT_NE(red(mixed[slot_of(kRoughness)]), red(up[slot_of(kRoughness)]));
  EXPECT_EQ(red(mixed[slot_of(kIor)]), red(up[slot_of(kIor)]));
  EXPECT_NE(red(mixed[slot_of(kIor)]), red(both[slot_of(kIor)]));
}

/// Extinctions, roughness and IOR alone: nothing is carried, so that no third picture is needed.
TEST(FiniteDifferences, DifferencesAloneNeedNoPictureBetween) {
  const auto all = synthetic_unknowns();
  const auto rendered = [](const Setting& s, Differences which, Film* film = nullptr) {
    std::vector<double> iors;
    const Film found = render_derivatives(
        s.problem, &s.reparametrization, s.unknowns.scene_with(s.scene, s.unknowns.start()),
        s.photos[0], s.unknowns.start(), Purpose::kInstrumental, which,
        [&](const Vector& at, const SlotLayout& layout, Paths paths) {
          if (paths != Paths::kDirect) iors.push_back(at[at.size() - 1]);
          return s.film(at, {0.5, 0.5}, 4, 1, layout);
        });
    if (film) *film = found;
    return iors;
  };
  const Setting two({all[1], all[3]}), colour({all[0], all[3]});
  const double ior = two.unknowns.start()[1];
  Film with, without;
  EXPECT_EQ(rendered(two, {Side::kBoth}, &with).size(), 5u);
  const std::vector<double> ends = rendered(two, {.side = Side::kBoth, .picture = false}, &without);
  ASSERT_EQ(ends.size(), 4u);
  EXPECT_LT(std::min(ends[2], ends[3]), ior);
  EXPECT_GT(std::max(ends[2], ends[3]), ior);
  for (std::size_t slot = 0; slot < 2; ++slot)
    EXPECT_EQ(with.slots[slot].mean[20].g, without.slots[slot].mean[20].g);
  EXPECT_EQ(without.mean[20].g, 0);
  EXPECT_GT(without.variance[20].g, 0);
  // What is carried needs it; so do differences from one side, and where none is left.
  EXPECT_EQ(rendered(colour, {.side = Side::kBoth, .picture = false}).size(), 3u);
  EXPECT_EQ(rendered(two, {.side = Side::kUp, .picture = false}).size(), 3u);
  const Setting roughness({all[1]});
  EXPECT_EQ(
      rendered(roughness, {.side = Side::kBoth, .roughnesses = false, .picture = false}).size(),
      1u);
}

TEST(FiniteDifferences, RoughnessesAndSharpRefractionsCanBeLeftOut) {
  Setting s;
  s.x[kTransmission] = 0.9;
  const auto is_left_out = [&](std::size_t k, const Differences& which) {
    const Film film = s.with_differences({0.5, 0.5}, 4, 1, Purpose::kInstrumental, which);
    return film.slots[static_cast<std::size_t>(s.layout.rows[k].slot)].mean.empty();
  };
  for (const bool sharp : {true, false}) {
    s.x[kRoughness] = sharp ? 0.05 : 0.6;
    EXPECT_TRUE(is_left_out(kRoughness, {.roughnesses = false}));
    EXPECT_FALSE(is_left_out(kIor, {.roughnesses = false}) ||
                 is_left_out(kRoughness, {.refractions = false}));
    EXPECT_EQ(is_left_out(kIor, {.refractions = false}), sharp);
  }
}

TEST(FiniteDifferences, SlotsOfThoseNotTakenAreEmpty) {
  const Setting s;
  const Film film = s.with_differences({0.5, 0.5}, 4, 1, Purpose::kInstrumental,
                                       {.side = Side::kUp, .first = 1, .every = 3});
  const Halves halves = split_halves(s.problem, {0, film, {}}, s.reparametrization.slope(s.x));
  const Film all = s.with_differences({0.5, 0.5}, 4, 1, Purpose::kInstrumental, {Side::kUp});
  const Halves whole = split_halves(s.problem, {0, all, {}}, s.reparametrization.slope(s.x));
  for (Eigen::Index k = 0; k < s.x.size(); ++k) {
    EXPECT_TRUE(whole.differentiated[k]);
    EXPECT_EQ(halves.differentiated[k], k != kRoughness);
    if (k == kRoughness)
      EXPECT_TRUE((halves.jacobian_a.col(k).array() == 0).all());
    else
      EXPECT_EQ(halves.jacobian_a.col(k), whole.jacobian_a.col(k)) << k;
  }
}

/// Slots of one owner follow each other in the layout, whatever the order of the unknowns; of so many
/// a render takes a part at a time.
TEST(FiniteDifferences, EveryDerivativeIsInItsSlot) {
  constexpr int kMaterials = 12;
  std::vector<UnknownParameter> wanted;
  for (UnknownParameter one : synthetic_unknowns())
    for (int i = 0; i < kMaterials; ++i) {
      one.owner = i == 0 ? "Body" : "Body" + std::to_string(i);
      wanted.push_back(one);
    }
  const Setting s(wanted, kMaterials);
  ASSERT_GT(s.layout.slots.size(), static_cast<std::size_t>(kMaxSlots));
  const auto name = [](const Slot& slot) {
    return static_cast<float>(100 * slot.parameter.owner + 10 * slot.parameter.field +
                              slot.component);
  };
  int passes = 0;
  const Film film = render_derivatives(
      s.problem, nullptr, s.scene, s.photos[0], s.unknowns.start(), Purpose::kInstrumental,
      {Side::kUp}, [&](const Vector&, const SlotLayout& layout, Paths) {
        ++passes;
        EXPECT_LE(layout.slots.size(), static_cast<std::size_t>(kMaxSlots));
        Film part(1, 1, 2, static_cast<int>(layout.slots.size()));
        for (std::size_t i = 0; i < layout.slots.size(); ++i)
          part.slots[i].mean[0].r = name(layout.slots[i]);
        return part;
      });
  EXPECT_GT(passes, 1);
  ASSERT_EQ(film.slots.size(), s.layout.slots.size());
  for (std::size_t i = 0; i < film.slots.size(); ++i)
    EXPECT_EQ(film.slots[i].mean[0].r, name(s.layout.slots[i])) << i;
}

TEST(FiniteDifferences, InstrumentsTakeTheRoughnessToo) {
  const Setting s;
  const SyntheticRenderer renderer{0.5, 0.5};
  const Film plain = s.film(s.x, renderer, 4, 1);
  const Film with = s.with_differences(renderer, 4, 1, Purpose::kInstrumental, {Side::kUp});
  for (const Eigen::Index k : {kRoughness, kTransmission, kIor}) {
    const auto slot = static_cast<std::size_t>(s.layout.rows[static_cast<std::size_t>(k)].slot);
    const bool same = plain.slots[slot].mean[20].g == with.slots[slot].mean[20].g;
    EXPECT_EQ(same, k == kTransmission) << k;
  }
}

/// The expectation of the gradient is the one of pictures without noise, whatever the samples.
/// |z| < 4: false alarm 6e-5 for each number of samples; seeds are fixed.
class DifferenceSamples : public testing::TestWithParam<int> {
 protected:
  /// z of the mean gradient by IOR with the covariances that the film says, and without any.
  struct Result {
    double as_said, without;
  };
  static Result gradients(const Setting& s) {
    const SyntheticRenderer renderer{0.5, 0.5};
    const double expected = s.gradient(s.with_differences({0, 0}, 2, 0))[kIor];
    Mean as_said, without;
    for (std::uint64_t seed = 0; seed < 600; ++seed) {
      Film film = s.with_differences(renderer, GetParam(), 100 + seed);
      as_said.add(s.gradient(film)[kIor]);
      for (SlotFilm& slot : film.slots) slot.covariance.assign(film.size(), Colorf(0.f));
      without.add(s.gradient(film)[kIor]);
    }
    return {as_said.z(expected), without.z(expected)};
  }
};
/// Two pictures with random numbers of their own.
TEST_P(DifferenceSamples, GiveAnUnbiasedGradientOfTheLoss) {
  const Result z = gradients(Setting());
  EXPECT_LT(std::abs(z.as_said), 4);
  EXPECT_EQ(z.as_said, z.without) << "there is no covariance";
}
/// One picture, held against the film.
TEST_P(DifferenceSamples, GiveAnUnbiasedGradientAtTheEndOfTheRange) {
  Setting s;
  s.x[kIor] = 9.5;
  const Result z = gradients(s);
  EXPECT_LT(std::abs(z.as_said), 4);
  EXPECT_GT(std::abs(z.without), 8) << "the test could not have failed";
}
INSTANTIATE_TEST_SUITE_P(Each, DifferenceSamples, testing::Values(2, 3, 4, 5));

/// What the step's length costs: some percent of the slope away from the truth, nothing at it.
TEST(FiniteDifferences, ExpectedGradientIsNearlyTheSlopeOfTheExpectedLoss) {
  const Setting s;
  constexpr double kStep = 1e-4;
  Vector low = s.x, high = s.x;
  low[kIor] -= kStep;
  high[kIor] += kStep;
  const double slope = (s.expected_loss(high) - s.expected_loss(low)) / (2 * kStep);
  EXPECT_NEAR(s.gradient(s.with_differences({0, 0}, 2, 0))[kIor], slope, 0.1 * std::abs(slope));
  EXPECT_GT(std::abs(slope), 1e-3);

  Setting truth;
  truth.x = synthetic_truth();
  EXPECT_NEAR(truth.gradient(truth.with_differences({0, 0}, 2, 0))[kIor], 0, 1e-9);
}

TEST(FiniteDifferences, OneSampleHasNoCovarianceAndStaysFinite) {
  const Setting s;
  const Film film = s.with_differences({0.5, 0.5}, 1, 3);
  const auto slot = static_cast<std::size_t>(s.layout.rows[kIor].slot);
  for (std::size_t i = 0; i < film.size(); ++i) {
    EXPECT_EQ(film.slots[slot].covariance[i].r, 0.f);
    EXPECT_TRUE(std::isfinite(film.slots[slot].mean[i].r));
  }
}

TEST(FiniteDifferences, ASideThatLeavesTheRangeGivesWay) {
  Setting s;
  s.x[kIor] = 9.5;  // up by 0.35 in log(x - 1) would be beyond 10
  const Film film = s.with_differences({0, 0}, 2, 0);
  const Film plain = s.film(s.x, {0, 0}, 2, 0);
  const auto slot = static_cast<std::size_t>(s.layout.rows[kIor].slot);
  EXPECT_NE(film.slots[slot].mean[20].g, plain.slots[slot].mean[20].g);
  EXPECT_NEAR(film.slots[slot].mean[20].g / plain.slots[slot].mean[20].g, 1, 0.3);
}

TEST(FiniteDifferences, AdamRendersTwoMorePicturesAStep) {
  const Setting s;
  FitSettings settings = synthetic_settings();
  settings.finite_differences = true;
  settings.iterations = 3;
  settings.validation_interval = 100;
  std::vector<UnknownParameter> unknowns = synthetic_unknowns();
  unknowns[1].start = {0.1};  // roughness
  int with_slots = 0, without = 0;
  settings.renderer = [&](const Scene& scene, const Camera& camera, const SlotLayout& layout,
                          const RenderSettings& render_settings, Progress* progress) {
    ++(layout.slots.empty() ? without : with_slots);
    return SyntheticRenderer()(scene, camera, layout, render_settings, progress);
  };
  Fit fit(s.scene, {synthetic_capture(s.scene, "Left")}, unknowns, settings);
  while (fit.step()) {
  }
  EXPECT_EQ(with_slots, 3);
  EXPECT_EQ(without, 3 * 2 + 2) << "and the validations at both ends";
}

}  // namespace
}  // namespace selenite
