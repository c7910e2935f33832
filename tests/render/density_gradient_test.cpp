// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <limits>

#include "math/error.h"
#include "render/difference.h"
#include "render/driver/field_gradient.h"
#include "render/media_scenes.h"
#include "render/picture_statistics.h"
#include "scene/small_scenes.h"

// The derivative by every voxel of a density grid.
namespace selenite {
namespace {

constexpr int kVoxels = 8;
const Transform kPlace = matrix({0.5, 0, 0}, {0, 0.5, 0}, {0, 0, 0.5}, {0.5, 0.5, 0.5});

PlacedGrid cube(const char* name, std::vector<float> values) {
  return {std::make_shared<Grid>(name, std::array<int, 3>{2, 2, 2}, 1, std::move(values)), kPlace};
}
Material medium(const Color<double>& extinction, double albedo, bool smoky) {
  Material m = smoky ? matte("Medium", 0) : glass("Medium", 1.35, 0.3);
  if (smoky) m.values.alpha = 0;
  m.values.extinction = extinction;
  m.values.albedo = Color<double>(albedo);
  m.values.anisotropy = 0.3;
  return m;
}
PixelLoss mean_loss(const RenderSettings& s) {
  const auto share = 1.0f / static_cast<float>(3 * s.width * s.height);
  return [share](std::size_t, const Film&) { return PixelSlope{Colorf(share), {}}; };
}
double mean_of_all(const Film& film) {
  return (mean_of(film, 0).mean + mean_of(film, 1).mean + mean_of(film, 2).mean) / 3;
}
FieldGradient gradient_of(const Scene& scene, const RenderSettings& settings,
                          const std::vector<GridKind>& kinds = {GridKind::kDensity}) {
  std::vector<FieldRef> unknown;
  for (const GridKind kind : kinds) unknown.push_back(GridRef{scene.material("Medium"), kind});
  return render_field_gradient(scene, scene.cameras[0], unknown, settings, mean_loss(settings));
}

struct Constant {
  Color<double> extinction;  ///< of the homogeneous medium
  double albedo;
  bool smoky;
};
void PrintTo(const Constant& c, std::ostream* out) {
  *out << "extinction " << c.extinction.r << ", " << c.extinction.g << ", " << c.extinction.b
       << ", albedo " << c.albedo << (c.smoky ? ", smoke" : "");
}
class ConstantDensity : public testing::TestWithParam<Constant> {};

TEST_P(ConstantDensity, AddsUpToTheDerivativeByExtinction) {
  const auto [extinction, albedo, smoky] = GetParam();
  constexpr double kDensity = 0.7f;
  Material m = medium(extinction / kDensity, albedo, smoky);
  m.density_grid = cube("density", std::vector<float>(kVoxels, 0.7f));
  const Scene grid = lit_ball(m), plain = lit_ball(medium(extinction, albedo, smoky));
  Tally sums, wants;
  for (int seed = 0; seed < 16; ++seed) {
    const FieldGradient found = gradient_of(grid, settings_of(6, 200, 100 + seed));
    const Film film = render_view(plain, settings_of(6, 200, 300 + seed),
                                  ticked(plain, {{"Medium", "extinction"}}));
    ASSERT_TRUE(complete(found.film) && complete(film));
    double sum = 0, want = 0;
    for (const double d : found.fields[0]) sum += d;
    for (int c = 0; c < 3; ++c) want += extinction[c] / kDensity * slope_of(film, 0, c).mean / 3;
    sums.add(sum);
    wants.add(want);
  }
  const Estimate got = sums.estimate(), want = wants.estimate();
  RecordProperty("z", std::to_string(got.z(want)));
  RecordProperty("error_per_slope",
                 std::to_string(std::hypot(got.error, want.error) / std::abs(want.mean)));
  // Student's t of some 30 degrees of freedom: 1 false alarm in 2700 a case.
  EXPECT_LT(std::abs(got.z(want)), 4)
      << got.mean << " +- " << got.error << ", " << want.mean << " +- " << want.error;
  EXPECT_LT(got.error, 0.15 * std::abs(want.mean));
}
INSTANTIATE_TEST_SUITE_P(
    Media, ConstantDensity,
    testing::Values(Constant{Color<double>(3), 0.8, false}, Constant{{0.5, 2, 6}, 0.9, false},
                    Constant{Color<double>(1), 0, false}, Constant{Color<double>(2), 0, true},
                    Constant{Color<double>(0.2), 1, true}, Constant{{0.5, 2, 6}, 0.7, true},
                    Constant{Color<double>(12), 0.5, true}));

struct Place {
  std::string name;
  std::vector<float> density;
  int voxel;
  double albedo = 0.7;
  bool smoky = true, albedo_grid = false;
  int spp = 160;  ///< of the derivative; a difference has a quarter more
};
void PrintTo(const Place& p, std::ostream* out) { *out << p.name << ", voxel " << p.voxel; }
class DensityVoxel : public testing::TestWithParam<Place> {};

TEST_P(DensityVoxel, AgreesWithDifferencesOfRenders) {
  const Place& p = GetParam();
  const float h = 0.2f, here = p.density[p.voxel];
  const auto scene_at = [&](float step) {
    std::vector<float> density = p.density;
    density[p.voxel] = here + step;
    Material m = medium({1, 1.5, 2}, p.albedo, p.smoky);
    m.density_grid = cube("density", density);
    if (p.albedo_grid)
      m.albedo_grid = cube("albedo", {0.2f, 0.9f, 0.5f, 0.7f, 0.4f, 0.6f, 0.8f, 0.0f});
    return lit_ball(m);
  };
  const auto displaced = [&](float step, const RenderSettings& settings) {
    return mean_of_all(render_view(scene_at(step), settings));
  };
  DifferencePairs pairs;
  for (int seed = 0; seed < 12; ++seed) {
    const FieldGradient found = gradient_of(scene_at(0), settings_of(6, p.spp, 70 + seed));
    ASSERT_TRUE(complete(found.film));
    // Equal seeds: while the densest voxel stays, the majorant does, and so do most paths.
    const RenderSettings many = settings_of(6, p.spp * 5 / 4, 700 + seed);
    pairs.add(found.fields[0][p.voxel],
              difference_slope(here, h, std::numeric_limits<float>::max(),
                               [&](float step) { return displaced(step, many); }));
  }
  pairs.expect_agreement();
}

std::vector<Place> places() {
  const std::vector<float> mixed = {0.4f, 1.1f, 0.8f, 2.0f, 0.6f, 0.5f, 1.4f, 0.3f};
  std::vector<float> hole = mixed;
  hole[1] = hole[6] = 0;
  const std::vector<float> nothing(kVoxels, 0);
  return {{"mixed", mixed, 1},
          {"mixed", mixed, 6},
          {"glass", mixed, 4, 0.7, false, false, 400},
          {"one empty", hole, 6, 0.7, true, false, 400},
          {"one empty in glass", hole, 6, 0.7, false, false, 400},
          {"all empty", nothing, 4, 0.7, true, false, 400},
          {"all empty, white", nothing, 1, 1, true, false, 400},
          {"black", mixed, 2, 0},
          {"black, one empty", hole, 6, 0},
          {"white", mixed, 5, 1, true, false, 400},
          {"white, one empty", hole, 1, 1},
          {"with albedo grid", hole, 6, 0.7, true, true}};
}
INSTANTIATE_TEST_SUITE_P(Densities, DensityVoxel, testing::ValuesIn(places()));

TEST(DensityGradient, OfTheEmptyHalfOfASlabIsWhatTheLawOfBeerSays) {
  // Light passes exp(-sigma (a + b)) of two layers; nothing is scattered, so each layer's derivative
  // is minus sigma times what comes through, also that of an empty layer.
  Material m = fog(Color<double>{0.5, 1, 2}, 0);
  m.density_grid = {std::make_shared<Grid>("density", std::array<int, 3>{1, 2, 1}, 1,
                                           std::vector<float>{0, 0.9f}),
                    kPlace};
  const RenderSettings settings = settings_of(4, 20000);
  const FieldGradient found = gradient_of(slab(m), settings);
  ASSERT_TRUE(complete(found.film));
  double want = 0;
  for (const double sigma : {0.5, 1.0, 2.0}) want -= sigma * std::exp(-0.9 * sigma) / 3;
  EXPECT_NEAR(found.fields[0][0], want, 0.015 * std::abs(want));
  EXPECT_NEAR(found.fields[0][1], want, 0.015 * std::abs(want));
}

TEST(DensityGradient, BesideTheAlbedosIsTheSame) {
  // Both grids unknown, or one of them: each has the derivative that it has alone.
  Material m = medium({1, 1.5, 2}, 0.5, true);
  m.density_grid = cube("density", {0.4f, 0, 0.8f, 2, 0.6f, 0.5f, 1.4f, 0.3f});
  m.albedo_grid = cube("albedo", {0.2f, 0.9f, 0.5f, 0, 0.4f, 0.6f, 0.8f, 1});
  const Scene scene = lit_ball(m);
  std::vector<Tally> gap(2 * kVoxels), size(2 * kVoxels);
  for (int seed = 0; seed < 12; ++seed) {
    const RenderSettings settings = settings_of(6, 200, 40 + seed);
    const FieldGradient both =
        gradient_of(scene, settings, {GridKind::kAlbedo, GridKind::kDensity});
    const FieldGradient albedo = gradient_of(scene, settings, {GridKind::kAlbedo});
    const FieldGradient density = gradient_of(scene, settings);
    for (int v = 0; v < kVoxels; ++v) {
      gap[v].add(both.fields[0][v] - albedo.fields[0][v]);
      gap[kVoxels + v].add(both.fields[1][v] - density.fields[0][v]);
      size[v].add(std::abs(albedo.fields[0][v]));
      size[kVoxels + v].add(std::abs(density.fields[0][v]));
    }
  }
  for (int i = 0; i < 2 * kVoxels; ++i) {
    const Estimate e = gap[i].estimate();
    // t of 11 degrees of freedom beyond 5.5, 16 comparisons: 1 false alarm in 300.
    EXPECT_LT(std::abs(e.mean), 5.5 * e.error + 1e-6 * size[i].mean()) << i;
  }
}

TEST(DensityGradient, OfOverlappingMediaIsThatOfEach) {
  // Two kinds of smoke in one another, of constant grids: null collisions belong to both.
  const auto scene_of = [](bool grids) {
    SceneBuilder builder;
    for (int i = 0; i < 2; ++i) {
      Material m = medium(Color<double>(i == 0 ? 1 : 2), 0.6, true);
      m.name = i == 0 ? "Medium" : "Other";
      if (grids) m.density_grid = cube("density", std::vector<float>(kVoxels, 1));
      place(builder, sphere_mesh(i == 0 ? 1 : 0.7, 12), builder.add_material(m),
            translation({0.2 * i, 0, 0}));
    }
    add_view(builder, {0, -4, 1}, {0, 0, 0}, 70);
    set_sky(builder, 0.5);
    return builder.build();
  };
  const Scene grids = scene_of(true), plain = scene_of(false);
  const std::vector<FieldRef> unknown = {GridRef{0, GridKind::kDensity},
                                         GridRef{1, GridKind::kDensity}};
  Tally sums[2], wants[2];
  for (int seed = 0; seed < 16; ++seed) {
    const RenderSettings settings = settings_of(6, 300, 100 + seed);
    const FieldGradient found =
        render_field_gradient(grids, grids.cameras[0], unknown, settings, mean_loss(settings));
    const Film film =
        render_view(plain, settings_of(6, 300, 300 + seed),
                    ticked(plain, {{"Medium", "extinction"}, {"Other", "extinction"}}));
    ASSERT_TRUE(complete(found.film) && complete(film));
    for (int i = 0; i < 2; ++i) {
      double sum = 0, want = 0;
      for (const double d : found.fields[i]) sum += d;
      for (int c = 0; c < 3; ++c) want += (i + 1) * slope_of(film, i, c).mean / 3;
      sums[i].add(sum);
      wants[i].add(want);
    }
  }
  for (int i = 0; i < 2; ++i) {
    const Estimate got = sums[i].estimate(), want = wants[i].estimate();
    EXPECT_LT(std::abs(got.z(want)), 4) << i << ": " << got.mean << " +- " << got.error << ", "
                                        << want.mean << " +- " << want.error;
    EXPECT_LT(got.error, 0.15 * std::abs(want.mean)) << i;
  }
}

TEST(DensityGradient, IsTheSameForAnyNumberOfThreads) {
  Material m = medium({1, 2, 3}, 0.7, true);
  m.density_grid = cube("density", {0.4f, 0, 0.8f, 2, 0.6f, 0.5f, 1.4f, 0.3f});
  const Scene scene = lit_ball(m);
  RenderSettings settings = settings_of(40, 3);
  const FieldGradient one = gradient_of(scene, settings);
  for (const int threads : {2, 5}) {
    settings.threads = threads;
    EXPECT_EQ(one.fields, gradient_of(scene, settings).fields);
  }
}

TEST(DensityGradient, NeedsAGridAndNamesItOnce) {
  Material m = medium({1, 2, 3}, 0.7, true);
  const RenderSettings settings = settings_of(2, 1);
  EXPECT_THROW(gradient_of(lit_ball(m), settings), InvalidArgument);
  m.density_grid = cube("density", std::vector<float>(kVoxels, 1));
  EXPECT_THROW(gradient_of(lit_ball(m), settings, {GridKind::kDensity, GridKind::kDensity}),
               InvalidArgument);
}

}  // namespace
}  // namespace selenite
