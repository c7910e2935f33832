// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cstring>

#include "math/error.h"
#include "render/picture_statistics.h"
#include "scene/small_scenes.h"

// What a film promises: the same bytes for any number of threads, independent seeds and halves,
// honest variances.
namespace selenite {
namespace {

/// A glossy half-transmissive sphere over a ground: enough noise of several kinds.
Scene noisy_scene() {
  SceneBuilder builder;
  Material m = plastic("Sphere");
  m.values.base_color = {0.7, 0.5, 0.3};
  m.values.transmission = 0.5;
  m.values.roughness = 0.4;
  place(builder, sphere_mesh(1, 10), builder.add_material(m));
  place(builder, quad_mesh(3), builder.add_material(matte("Ground", 0.6)), translation({0, 0, -1}));
  Light lamp;
  lamp.name = "Lamp";
  lamp.radius = 0.3;
  lamp.values.power = 200;
  lamp.to_world = translation({1, -1.5, 3});
  builder.add_light(lamp);
  add_view(builder, {0, -4, 1.5}, {0, 0, 0}, 45);
  set_sky(builder, 0.3);
  return builder.build();
}

SlotLayout two_slots(const Scene& scene) {
  return ticked(scene, {{"Sphere", "base_color"}, {"Sphere", "roughness"}});
}

bool same_bytes(const Picture& a, const Picture& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Colorf)) == 0;
}
bool same_bytes(const Film& a, const Film& b) {
  bool same = same_bytes(a.mean, b.mean) && same_bytes(a.half_a, b.half_a) &&
              same_bytes(a.variance, b.variance) && a.slots.size() == b.slots.size();
  for (std::size_t s = 0; same && s < a.slots.size(); ++s)
    same = same_bytes(a.slots[s].mean, b.slots[s].mean) &&
           same_bytes(a.slots[s].half_a, b.slots[s].half_a) &&
           same_bytes(a.slots[s].variance, b.slots[s].variance) &&
           same_bytes(a.slots[s].covariance, b.slots[s].covariance);
  return same;
}

/// Residuals of a picture against a better one, all channels of all pixels.
std::vector<double> residuals(const Picture& picture, const Picture& truth) {
  std::vector<double> r;
  for (std::size_t i = 0; i < picture.size(); ++i) r.push_back(picture[i].g - truth[i].g);
  return r;
}

TEST(Film, IsTheSameForAnyNumberOfThreads) {
  const Scene scene = noisy_scene();
  RenderSettings settings = settings_of(1, 3);
  settings.width = 37;  // tiles of 16: odd rests on both sides
  settings.height = 21;
  const Film one = render_view(scene, settings, two_slots(scene));
  for (const int threads : {2, 5}) {
    settings.threads = threads;
    EXPECT_TRUE(same_bytes(one, render_view(scene, settings, two_slots(scene)))) << threads;
  }
}

TEST(Film, APixelDoesNotDependOnTheSizeOfItsSampleCount) {
  // Sample i of a pixel is the same path whatever comes after it: 8 samples continue 4.
  const Scene scene = noisy_scene();
  const Film four = render_view(scene, settings_of(8, 4)),
             one = render_view(scene, settings_of(8, 1)),
             two = render_view(scene, settings_of(8, 2));
  for (std::size_t i = 0; i < four.size(); ++i) {
    EXPECT_FLOAT_EQ(one.mean[i].g, two.half_a[i].g);
    EXPECT_NEAR(four.half_b(four.mean[i], four.half_a[i]).g + four.half_a[i].g, 2 * four.mean[i].g,
                1e-5 * four.mean[i].g);
  }
}

TEST(Film, PixelsOutsideTheMaskAreBlackAndTheOthersAsWithoutIt) {
  const Scene scene = noisy_scene();
  RenderSettings settings = settings_of(1, 4);
  settings.width = 37;
  settings.height = 21;
  PixelMask mask(std::size_t{37} * 21, 0);
  for (std::size_t p = 0; p < mask.size(); p += 5) mask[p] = 1;
  for (std::size_t p = 37 * 16; p < 37 * 18; ++p) mask[p] = 1;  // and rows of a second tile
  for (const int lanes : {0, 1}) {
    settings.lanes = lanes;
    settings.pixels = nullptr;
    const Film whole = render_view(scene, settings, two_slots(scene));
    settings.pixels = std::make_shared<const PixelMask>(mask);
    const Film some = render_view(scene, settings, two_slots(scene));
    EXPECT_EQ(some.lanes, whole.lanes);
    for (std::size_t p = 0; p < mask.size(); ++p)
      for (int c = 0; c < 3; ++c) {
        const float share = mask[p];
        // Eight paths in lockstep meet other neighbours: equal but for rounding.
        EXPECT_NEAR(some.mean[p][c], share * whole.mean[p][c], 1e-5) << p;
        EXPECT_NEAR(some.half_a[p][c], share * whole.half_a[p][c], 1e-5) << p;
        EXPECT_NEAR(some.slots[1].mean[p][c], share * whole.slots[1].mean[p][c], 1e-4) << p;
      }
  }
}

TEST(Film, DifferentSeedsGiveUnrelatedNoise) {
  const Scene scene = noisy_scene();
  const Film truth = render_view(scene, settings_of(24, 300, 999));
  const std::vector<double> first =
      residuals(render_view(scene, settings_of(24, 4, 0)).mean, truth.mean);
  for (const std::uint64_t seed : {1ull, 2ull, 1ull << 32, ~0ull}) {
    const std::vector<double> other =
        residuals(render_view(scene, settings_of(24, 4, seed)).mean, truth.mean);
    EXPECT_NE(first, other);
    EXPECT_LT(std::abs(correlation_z(first, other)), 4) << "seed " << seed;
  }
}

TEST(Film, HalvesAreIndependentAndAverageToTheMean) {
  const Scene scene = noisy_scene();
  const SlotLayout layout = two_slots(scene);
  const Film truth = render_view(scene, settings_of(24, 300, 999), layout);
  for (const int spp : {2, 7, 8}) {
    const Film film = render_view(scene, settings_of(24, spp, 5), layout);
    const double evens = (spp + 1) / 2, odds = spp / 2;
    const auto judge = [&](const Picture& mean, const Picture& half_a, const Picture& best) {
      Picture half_b;
      for (std::size_t i = 0; i < film.size(); ++i) {
        half_b.push_back(film.half_b(mean[i], half_a[i]));
        for (int c = 0; c < 3; ++c)
          ASSERT_NEAR((half_a[i][c] * evens + half_b[i][c] * odds) / spp, mean[i][c],
                      1e-5 * (1 + std::abs(mean[i][c])));
      }
      EXPECT_FALSE(same_bytes(half_a, half_b));
      EXPECT_LT(std::abs(correlation_z(residuals(half_a, best), residuals(half_b, best))), 4);
    };
    judge(film.mean, film.half_a, truth.mean);
    for (std::size_t s = 0; s < film.slots.size(); ++s)
      judge(film.slots[s].mean, film.slots[s].half_a, truth.slots[s].mean);
  }
}

TEST(Film, VariancesAndCovariancesMatchTheScatterOverSeeds) {
  // 150 pictures: what the films say about themselves against how their means really scatter. The
  // comparison is over sums of all pixels, with the scatter of the difference itself as error bar.
  const Scene scene = noisy_scene();
  const SlotLayout layout = two_slots(scene);
  constexpr int kSize = 10, kPictures = 150;
  std::vector<Film> films;
  for (int seed = 0; seed < kPictures; ++seed)
    films.push_back(render_view(scene, settings_of(kSize, 6, 1000 + seed), layout));
  const int slots = static_cast<int>(layout.slots.size());
  const auto judge = [&](auto&& a, auto&& b, auto&& claimed, const char* what) {
    Tally gap, size;
    for (std::size_t pixel = 0; pixel < films[0].size(); ++pixel) {
      double ma = 0, mb = 0, said = 0, scatter = 0;
      for (const Film& film : films) {
        ma += a(film)[pixel].r / kPictures;
        mb += b(film)[pixel].r / kPictures;
        said += claimed(film)[pixel].r / kPictures;
      }
      for (const Film& film : films)
        scatter += (a(film)[pixel].r - ma) * (b(film)[pixel].r - mb) / (kPictures - 1);
      gap.add(said - scatter);
      size.add(std::abs(said));
    }
    EXPECT_LT(std::abs(gap.estimate().z(0)), 4) << what;
    EXPECT_LT(gap.estimate().error, 0.1 * size.mean()) << what;
  };
  judge(
      [](const Film& f) -> auto& { return f.mean; }, [](const Film& f) -> auto& { return f.mean; },
      [](const Film& f) -> auto& { return f.variance; }, "variance of the image");
  for (int s = 0; s < slots; ++s) {
    const auto slope = [s](const Film& f) -> auto& { return f.slots[s].mean; };
    judge(
        slope, slope, [s](const Film& f) -> auto& { return f.slots[s].variance; },
        "variance of a derivative");
    judge(
        slope, [](const Film& f) -> auto& { return f.mean; },
        [s](const Film& f) -> auto& { return f.slots[s].covariance; },
        "covariance of image and derivative");
  }
}

TEST(Film, OneSampleHasNoVarianceAndNoPictureHasANegativeOne) {
  const Scene scene = noisy_scene();
  for (const Colorf& v : render_view(scene, settings_of(8, 1)).variance) EXPECT_EQ(v.g, 0);
  // A picture without noise: emitter seen directly. Rounding must not leave a negative variance,
  // whose root is not a number.
  SceneBuilder builder;
  place(builder, quad_mesh(5), builder.add_material(emitter("Wall", 0.7)));
  add_view(builder, {0, 0, 3}, {0, 0, 0});
  const Scene wall = builder.build();
  const Film film =
      render_view(wall, settings_of(8, 37), ticked(wall, {{"Wall", "emission_color"}}));
  for (std::size_t i = 0; i < film.size(); ++i) {
    ASSERT_GE(film.variance[i].r, 0);
    ASSERT_GE(film.slots[0].variance[i].r, 0);
    EXPECT_LT(film.variance[i].r, 1e-6);
    EXPECT_FLOAT_EQ(film.mean[i].r, 0.7f);
    EXPECT_FLOAT_EQ(film.slots[0].mean[i].r, 0.7f);
  }
}

TEST(Film, ReportsItsProgressAndCanBeCancelled) {
  const Scene scene = noisy_scene();
  Progress progress;
  render(scene, scene.cameras[0], {}, settings_of(33, 1), &progress);
  EXPECT_EQ(progress.fraction, 1);
  progress.cancelled = true;
  for (const int threads : {1, 3}) {
    RenderSettings settings = settings_of(64, 1 << 16);  // minutes, were it not cancelled
    settings.threads = threads;
    EXPECT_THROW(render(scene, scene.cameras[0], {}, settings, &progress), Cancelled);
  }
}

TEST(Film, CountsItsTime) {
  // Windows counts a process's time in steps of 1/64 s.
  const Film film = render_view(noisy_scene(), settings_of(16, 1024));
  EXPECT_GT(film.seconds, 0);
  EXPECT_GT(film.cpu_seconds, 0);
  EXPECT_EQ(film.width, 16);
  EXPECT_EQ(film.spp, 1024);
}

struct BadSettings {
  const char* words;
  void (*spoil)(RenderSettings&);
};
void PrintTo(const BadSettings& b, std::ostream* out) { *out << b.words; }
class Settings : public testing::TestWithParam<BadSettings> {};

TEST_P(Settings, OutOfRangeAreRefusedByName) {
  const Scene scene = noisy_scene();
  RenderSettings settings = settings_of(8, 1);
  EXPECT_NO_THROW(settings.check());
  GetParam().spoil(settings);
  try {
    render(scene, scene.cameras[0], {}, settings);
    FAIL() << "rendered";
  } catch (const InvalidArgument& error) {
    EXPECT_NE(std::string(error.what()).find(GetParam().words), std::string::npos) << error.what();
  }
}
INSTANTIATE_TEST_SUITE_P(
    Bad, Settings,
    testing::Values(
        BadSettings{"width", [](RenderSettings& s) { s.width = 0; }},
        BadSettings{"height", [](RenderSettings& s) { s.height = -3; }},
        BadSettings{"number of pixels", [](RenderSettings& s) { s.width = s.height = 65536; }},
        BadSettings{"samples per pixel", [](RenderSettings& s) { s.spp = 0; }},
        BadSettings{"samples per pixel", [](RenderSettings& s) { s.spp = 1 << 30; }},
        BadSettings{"depth", [](RenderSettings& s) { s.depth = -1; }},
        BadSettings{"size of the mask",
                    [](RenderSettings& s) { s.pixels = std::make_shared<const PixelMask>(7, 1); }},
        BadSettings{"depth", [](RenderSettings& s) { s.depth = 2'000'000; }},
        BadSettings{"threads", [](RenderSettings& s) { s.threads = 1025; }},
        BadSettings{"threads", [](RenderSettings& s) { s.threads = -1; }}));

}  // namespace
}  // namespace selenite
