// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/driver/field_gradient.h"

#include <gtest/gtest.h>

#include <cstring>

#include "math/error.h"
#include "render/derivatives/tape.h"
#include "render/derivatives/throughput.h"
#include "render/difference.h"
#include "render/driver/aim_pilot.h"
#include "render/media_scenes.h"
#include "render/picture_statistics.h"
#include "scene/small_scenes.h"

namespace selenite {
namespace {

constexpr int kVoxels = 8;

/// A rough glass ball whose medium has 2 x 2 x 2 albedos, over a ground, under a lamp and a sky.
/// `smoky`: no glass around it, so that lamps are seen from inside.
Scene grid_ball(const std::vector<float>& albedo, int channels, bool density = false,
                bool smoky = false) {
  Material m = smoky ? matte("Medium", 0) : glass("Medium", 1.35, 0.3);
  if (smoky) m.values.alpha = 0;
  m.values.extinction = {2, 3, 4};
  m.values.anisotropy = 0.3;
  const Transform place_grid = matrix({0.5, 0, 0}, {0, 0.5, 0}, {0, 0, 0.5}, {0.5, 0.5, 0.5});
  m.albedo_grid = {std::make_shared<Grid>("albedo", std::array<int, 3>{2, 2, 2}, channels, albedo),
                   place_grid};
  if (density)
    m.density_grid = {std::make_shared<Grid>("density", std::array<int, 3>{1, 1, 2}, 1,
                                             std::vector<float>{0.4f, 1.5f}),
                      place_grid};
  return lit_ball(m);
}

FieldGradient gradient_of(const Scene& scene, const RenderSettings& settings,
                          const PixelLoss& loss) {
  return render_field_gradient(scene, scene.cameras[0],
                               {GridRef{scene.material("Medium"), GridKind::kAlbedo}}, settings,
                               loss);
}

/// The mean of the picture over pixels and channels.
PixelLoss mean_loss(const RenderSettings& s) {
  const auto share = 1.0f / static_cast<float>(3 * s.width * s.height);
  return [share](std::size_t, const Film&) { return PixelSlope{Colorf(share), {}}; };
}
double mean_of_all(const Film& film) {
  return (mean_of(film, 0).mean + mean_of(film, 1).mean + mean_of(film, 2).mean) / 3;
}

struct Place {
  std::string name;
  std::vector<float> albedo;  ///< one number a voxel
  int voxel;
  bool density = false, smoky = false;
};
void PrintTo(const Place& p, std::ostream* out) { *out << p.name << ", voxel " << p.voxel; }
class Voxel : public testing::TestWithParam<Place> {};

TEST_P(Voxel, AgreesWithDifferencesOfRenders) {
  const Place& p = GetParam();
  const float h = 0.1f, here = p.albedo[p.voxel];
  const auto displaced = [&](float step, const RenderSettings& settings) {
    std::vector<float> albedo = p.albedo;
    albedo[p.voxel] = here + step;
    const Scene scene = grid_ball(albedo, 1, p.density, p.smoky);
    return mean_of_all(render_view(scene, settings));
  };
  const Scene scene = grid_ball(p.albedo, 1, p.density, p.smoky);
  DifferencePairs pairs;
  for (int seed = 0; seed < 12; ++seed) {
    const RenderSettings settings = settings_of(6, 150, 70 + seed);
    const FieldGradient found = gradient_of(scene, settings, mean_loss(settings));
    ASSERT_TRUE(complete(found.film));
    pairs.add(found.fields[0][p.voxel],
              difference_slope(here, h, 1, [&](float step) { return displaced(step, settings); }));
  }
  pairs.expect_agreement();
}

std::vector<Place> places() {
  const std::vector<float> mixed = {0.2f, 0.9f, 0.5f, 0.7f, 0.4f, 0.6f, 0.8f, 0.3f};
  std::vector<float> hole = mixed, white = mixed;
  hole[2] = 0;
  white[5] = 1;
  const std::vector<float> black(kVoxels, 0), bright(kVoxels, 1);
  return {{"mixed", mixed, 0},
          {"mixed", mixed, 5},
          {"one black", hole, 2},
          {"one white", white, 5},
          {"all black", black, 4},
          {"all white", bright, 3},
          {"with density", mixed, 6, true},
          {"black with density", black, 1, true},
          {"smoke", mixed, 6, false, true},
          {"black smoke with density", black, 4, true, true}};
}
INSTANTIATE_TEST_SUITE_P(Albedos, Voxel, testing::ValuesIn(places()));

TEST(FieldGradient, AddsUpToTheDerivativeByOneAlbedo) {
  for (const float albedo : {0.0f, 0.6f, 1.0f}) {
    const Scene grid = grid_ball(std::vector<float>(3 * kVoxels, albedo), 3);
    Material m = grid.appearance.materials[0];
    m.albedo_grid = {};
    m.values.albedo = Color<double>(albedo);
    Scene plain = grid;
    plain.appearance.materials[0] = m;
    Tally gap[3], size[3];
    for (int seed = 0; seed < 8; ++seed) {
      const RenderSettings settings = settings_of(6, 150, 30 + seed);
      const FieldGradient found = gradient_of(grid, settings, mean_loss(settings));
      const Film film = render_view(plain, settings, ticked(plain, {{"Medium", "albedo"}}));
      for (int c = 0; c < 3; ++c) {
        double sum = 0;
        for (int v = 0; v < kVoxels; ++v) sum += found.fields[0][3 * v + c];
        const double want = slope_of(film, 0, c).mean / 3;
        gap[c].add(sum - want);
        size[c].add(want);
      }
    }
    for (int c = 0; c < 3; ++c) {
      const Estimate e = gap[c].estimate();
      // The paths are the same but for the choice of channels; t of 7 degrees of freedom beyond 5.4:
      // 1 false alarm in 1000.
      EXPECT_LT(std::abs(e.mean), 5.4 * e.error + 1e-5 * size[c].mean()) << albedo << " " << c;
      EXPECT_GT(size[c].mean(), 10 * e.error);
    }
  }
}

TEST(FieldGradient, TheTapeTellsTheRadianceItself) {
  Tape tape;
  tape.add_light(Colorf(0.5f));
  const FieldSlope zero{Colorf(1), {{}, 0}, 1}, one{Colorf(1), {{}, 1}, 1};
  tape.record(Colorf(2), Colorf(2), Colorf(0), &zero, 1);
  tape.add_light(Colorf(3));
  tape.record(Colorf(0), Colorf(0.25f), Colorf(0.5f), &one, 1);
  tape.add_light(Colorf(8));
  // 0.5 + 2 * a * (3 + 0.25 * b * 8) at a = 0, b = 0.5: by a 2 * (3 + 0.25 * 0.5 * 8) = 8; by b 0.
  float by[2] = {};
  const Colorf light = tape.sweep(
      Colorf(1), [&](const FieldPlace& place, const Colorf& d) { by[place.field] = d.g; });
  EXPECT_FLOAT_EQ(light.r, 0.5f);
  // A branch that looks up 0: its light is none, its derivative is the throughput before and after.
  Throughput<kTaped> beta(1);
  tape.clear();
  beta.tape = &tape;
  beta.multiply(3);
  Throughput<kTaped> branch = beta;
  branch.branches();
  branch.multiply_recorded(Colorf(0), &zero, 1);
  branch.multiply(0.5f);
  Radiance<kTaped> radiance(1);
  radiance.add(branch, Factor<kTaped>{Colorf(4)}, 1);
  by[0] = 0;
  EXPECT_EQ(tape.sweep(Colorf(1), [&](const FieldPlace&, const Colorf& d) { by[0] += d.g; }).r, 0);
  EXPECT_FLOAT_EQ(by[0], 6);
  by[0] = 8;
  EXPECT_FLOAT_EQ(by[0], 8);
  EXPECT_FLOAT_EQ(by[1], 0);
}

TEST(FieldGradient, SquaredLossIsUnbiasedFromTwoSamples) {
  // Two samples a pixel and many seeds, against the product of the means of many samples.
  const Scene ball = grid_ball(std::vector<float>(kVoxels, 0.7f), 1);
  const RenderSettings many = settings_of(1, 20000, 5);
  const Scene scene = decide_aims(ball, ball.cameras[0], {}, many);  // once, not for each seed
  constexpr float kReference = 0.3f;
  const PixelLoss square = [](std::size_t pixel, const Film& film) {
    return PixelSlope{(film.mean[pixel] - Colorf(kReference)) * 2.0f, Colorf(2)};
  };
  const PixelLoss red = [](std::size_t, const Film&) { return PixelSlope{{1, 0, 0}, {}}; };
  const PixelLoss green = [](std::size_t, const Film&) { return PixelSlope{{0, 1, 0}, {}}; };
  const PixelLoss blue = [](std::size_t, const Film&) { return PixelSlope{{0, 0, 1}, {}}; };
  std::vector<double> want(kVoxels);
  for (int c = 0; c < 3; ++c) {
    const FieldGradient part = gradient_of(scene, many, c == 0 ? red : c == 1 ? green : blue);
    for (int v = 0; v < kVoxels; ++v)
      want[v] += 2 * (part.film.mean[0][c] - kReference) * part.fields[0][v];
  }
  std::vector<Tally> got(kVoxels);
  for (int seed = 0; seed < 6000; ++seed) {
    const FieldGradient one = gradient_of(scene, settings_of(1, 2, 1000 + seed), square);
    for (int v = 0; v < kVoxels; ++v) got[v].add(one.fields[0][v]);
  }
  for (int v = 0; v < kVoxels; ++v) {
    const Estimate e = got[v].estimate();
    // 8 comparisons; the truth's own error is within the 3 %.
    EXPECT_LT(std::abs(e.mean - want[v]), 4 * e.error + 0.03 * std::abs(want[v])) << v;
  }
}

TEST(FieldGradient, IsTheSameForAnyNumberOfThreads) {
  const Scene scene = grid_ball({0.2f, 0.9f, 0.5f, 0.7f, 0.4f, 0.6f, 0.8f, 0.3f}, 1, true);
  RenderSettings settings = settings_of(40, 3);
  const FieldGradient one = gradient_of(scene, settings, mean_loss(settings));
  for (const int threads : {2, 5}) {
    settings.threads = threads;
    const FieldGradient other = gradient_of(scene, settings, mean_loss(settings));
    EXPECT_EQ(one.fields[0], other.fields[0]);
    EXPECT_EQ(0, std::memcmp(one.film.mean.data(), other.film.mean.data(),
                             one.film.mean.size() * sizeof(Colorf)));
  }
}

TEST(FieldGradient, NeedsAGrid) {
  Scene scene = grid_ball(std::vector<float>(kVoxels, 0.5f), 1);
  scene.appearance.materials[0].albedo_grid = {};
  const RenderSettings settings = settings_of(2, 1);
  EXPECT_THROW(gradient_of(scene, settings, mean_loss(settings)), InvalidArgument);
}

/// The cells' rows, added up, are the gradient of the same sum from the same samples.
TEST(FieldJacobian, CellsAddUpToTheGradient) {
  std::vector<float> albedo(24);
  for (std::size_t k = 0; k < albedo.size(); ++k) albedo[k] = 0.3f + 0.025f * static_cast<float>(k);
  const Scene scene = grid_ball(albedo, 3);
  const std::vector<FieldRef> unknown = {GridRef{scene.material("Medium"), GridKind::kAlbedo}};
  RenderSettings settings;
  settings.width = 37;  // neither tiles nor cells fit
  settings.height = 21;
  settings.spp = 4;
  settings.seed = 3;
  std::vector<float> weights(37 * 21);
  for (std::size_t p = 0; p < weights.size(); ++p) weights[p] = 0.1f + static_cast<float>(p % 7);
  const FieldGradient gradient = render_field_gradient(
      scene, scene.cameras[0], unknown, settings, [&](std::size_t pixel, const Film&) {
        return PixelSlope{Colorf(weights[pixel]), {}};
      });
  for (const int cell : {4, 8, 16}) {
    const FieldJacobian found =
        render_field_jacobian(scene, scene.cameras[0], unknown, settings, weights, cell);
    ASSERT_EQ(found.fields[0].rows(), (36 / cell + 1) * (20 / cell + 1));
    ASSERT_EQ(found.fields[0].cols(), 24);
    for (Eigen::Index k = 0; k < 24; ++k) {
      const double whole = gradient.fields[0][static_cast<std::size_t>(k)];
      EXPECT_NEAR(found.fields[0].col(k).sum(), whole, 1e-4 * std::abs(whole)) << k;
    }
    EXPECT_EQ(found.film.mean[400].g, gradient.film.mean[400].g);
  }
}

/// A cell knows only its own pixels: those beside the ball know nothing of its voxels.
TEST(FieldJacobian, ACellKnowsItsOwnPixels) {
  const Scene scene = grid_ball(std::vector<float>(24, 0.6f), 3);
  const std::vector<FieldRef> unknown = {GridRef{scene.material("Medium"), GridKind::kAlbedo}};
  RenderSettings settings;
  settings.width = settings.height = 32;
  settings.spp = 4;
  std::vector<float> all(32 * 32, 1), one(32 * 32, 0);
  for (int y = 16; y < 24; ++y)
    for (int x = 8; x < 16; ++x) one[static_cast<std::size_t>(32 * y + x)] = 1;
  const auto jacobian = [&](const std::vector<float>& weights) {
    return render_field_jacobian(scene, scene.cameras[0], unknown, settings, weights, 8).fields[0];
  };
  const CellJacobian of_all = jacobian(all), of_one = jacobian(one);
  EXPECT_GT(of_one.row(9).norm(), 0);
  EXPECT_EQ(of_one.row(9), of_all.row(9));
  EXPECT_EQ(of_one.topRows(9).norm() + of_one.bottomRows(6).norm(), 0);
}

TEST(FieldJacobian, NamesWhatDoesNotFit) {
  const Scene scene = grid_ball(std::vector<float>(8, 0.6f), 1);
  const std::vector<FieldRef> unknown = {GridRef{scene.material("Medium"), GridKind::kAlbedo}};
  RenderSettings settings;
  settings.width = settings.height = 16;
  settings.spp = 1;
  const auto render_with = [&](std::size_t weights, int cell) {
    (void)render_field_jacobian(scene, scene.cameras[0], unknown, settings,
                                std::vector<float>(weights, 1), cell);
  };
  EXPECT_NO_THROW(render_with(256, 8));
  EXPECT_THROW(render_with(255, 8), InvalidArgument);
  EXPECT_THROW(render_with(256, 0), InvalidArgument);
  EXPECT_THROW(render_with(256, 5), InvalidArgument);
  EXPECT_THROW(render_with(256, 32), InvalidArgument);
}

}  // namespace
}  // namespace selenite
