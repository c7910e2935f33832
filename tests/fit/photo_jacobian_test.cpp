// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>

#include "fit/evaluate/seeds.h"
#include "fit/inference/fisher_information.h"
#include "fit/smoke.h"
#include "fit/taken_photos.h"
#include "math/error.h"
#include "scene/small_scenes.h"

namespace selenite {
namespace {

/// A matte square that fills the picture under a sky of radiance 2: a pixel is twice its colour.
Scene matte_scene() {
  SceneBuilder builder;
  place(builder, quad_mesh(50), builder.add_material(matte("Body", 0.4)));
  add_view(builder, {0, 0, 4}, {0, 0, 0});
  set_sky(builder, 2);
  return builder.build();
}

PhotoJacobian look_at_matte(const Scene& scene, int spp) {
  const Unknowns unknowns(scene, {{"Body", "base_color", {0.4, 0.5, 0.6}, 0, 1, 0.03},
                                  {"World", "strength", {2}, 0.01, 100, 0.03}});
  RenderSettings settings;
  settings.width = settings.height = 16;
  settings.spp = spp;
  settings.seed = 3;
  return photo_jacobian(scene, unknowns, of_camera("Camera 0"), settings);
}

// Means over 256 pixels of 32 samples, whose deviation is below 1: 5 standard errors are 0.08.
TEST(PhotoJacobian, HalvesHaveTheSlopesOnPaper) {
  const PhotoJacobian seen = look_at_matte(matte_scene(), 64);
  const InstrumentalVariables::Set means = instrumental_variables(seen).plain();
  for (const InstrumentalVariables::Half* one : {&means.a, &means.b}) {
    const Jacobian& half = one->slopes;
    ASSERT_EQ(half.rows(), 3 * 16 * 16);
    ASSERT_EQ(half.cols(), 4);
    for (Eigen::Index c = 0; c < 3; ++c) {
      double own = 0, sky = 0;
      for (Eigen::Index i = 0; i < half.rows(); ++i) {
        if (i % 3 != c) {
          EXPECT_EQ(half(i, c), 0);
          continue;
        }
        own += half(i, c) / 256.0;
        sky += half(i, 3) / 256.0;
      }
      EXPECT_NEAR(own, 2, 0.08);
      // By the logarithm of the strength: the radiance itself.
      EXPECT_NEAR(sky, 2 * (0.4 + 0.1 * static_cast<double>(c)), 0.08);
    }
  }
  EXPECT_NE(means.a.slopes, means.b.slopes);
  EXPECT_TRUE(seen.not_finite.empty());
}

// The variance of a mean falls with the samples, that of one sample does not. Means and variances of
// seeds scatter by 0.3 % and 0.7 %.
TEST(PhotoJacobian, PictureAndVarianceAreThoseOfAllPortions) {
  const Scene scene = smoke(std::vector<float>(8, 0.5f));
  const Unknowns unknowns(scene, {{"World", "strength", {0.3}, 0.01, 100, 0.03}});
  const auto seen = [&](int spp) {
    return photo_jacobian(scene, unknowns, of_camera("Camera 0"), square_settings(24, spp, 3));
  };
  const PhotoJacobian few = seen(30), many = seen(256);
  ASSERT_EQ(few.portions.size(), 4u);
  EXPECT_EQ(few.portions[0].spp + few.portions[1].spp + few.portions[2].spp + few.portions[3].spp,
            30);
  const Film film = render(scene, scene.camera("Camera 0"), {}, square_settings(24, 256, 5));
  const auto red = [](const Picture& picture) {
    double sum = 0;
    for (const Colorf& pixel : picture) sum += pixel.r / static_cast<double>(picture.size());
    return sum;
  };
  EXPECT_NEAR(red(many.mean) / red(film.mean), 1, 0.02);
  EXPECT_NEAR(red(many.mean) / red(few.mean), 1, 0.02);
  const double variance = many.variance.cast<double>().mean();
  EXPECT_NEAR(red(film.variance) * film.spp / variance, 1, 0.05);
  EXPECT_NEAR(few.variance.cast<double>().mean() / variance, 1, 0.05);
}

// Pixel by pixel, the roughness being left to differences: no path carries more in the one than in the
// other.
TEST(PhotoJacobian, PortionsHoldTheDerivativesThatARenderCarries) {
  const Scene scene = smoke(std::vector<float>(8, 0.5f));
  const Unknowns unknowns(scene, {{"World", "strength", {0.3}, 0.01, 100, 0.03}});
  const RenderSettings settings = square_settings(16, 64, 3);
  const PhotoJacobian seen = photo_jacobian(scene, unknowns, of_camera("Camera 0"), settings);
  const double slope = Reparametrization(unknowns).slope(unknowns.start())[0];
  const Scene here = unknowns.scene_with(scene, unknowns.start());
  ASSERT_EQ(seen.portions.size(), 4u);
  for (int portion = 0; portion < 4; ++portion) {
    RenderSettings part = settings;
    part.spp = seen.portions[static_cast<std::size_t>(portion)].spp;
    part.seed = seed_of(mix64(settings.seed), portion, 0);
    const Film film = render(here, here.camera("Camera 0"), seen.layout, part);
    const Halves& halves = seen.portions[static_cast<std::size_t>(portion)].halves;
    for (std::size_t p = 0; p < film.size(); ++p)
      for (int c = 0; c < 3; ++c) {
        const auto i = static_cast<Eigen::Index>(3 * p) + c;
        const double carried = film.slots[0].mean[p][c] * slope;
        EXPECT_NEAR((halves.jacobian_a(i, 0) + halves.jacobian_b(i, 0)) / 2, carried,
                    1e-4 * std::abs(carried) + 1e-5)
            << portion << ": pixel " << p << ", channel " << c;
      }
  }
}

TEST(PhotoJacobian, NeighbouringSeedsShareNoPortion) {
  const Scene scene = smoke(std::vector<float>(8, 0.5f));
  const Unknowns unknowns(scene, {{"World", "strength", {0.3}, 0.01, 100, 0.03}});
  std::vector<Eigen::VectorXf> pictures;
  for (const std::uint64_t seed : {0, 1, 2, 3})
    for (const PhotoJacobian::Portion& portion :
         photo_jacobian(scene, unknowns, of_camera("Camera 0"), square_settings(8, 8, seed))
             .portions)
      pictures.push_back(portion.halves.residual_a);
  for (std::size_t i = 0; i < pictures.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) EXPECT_NE(pictures[i], pictures[k]) << i << ' ' << k;
}

// The picture and the slopes are means over all samples, and more of them leave less open. One of 24
// and one of 72 samples.
TEST(PhotoJacobian, JoinsTheSamplesOfAnother) {
  const Scene scene = smoke(std::vector<float>(8, 0.5f));
  const Unknowns unknowns(scene, {{"Smoke", "extinction", {2, 2, 2}, 0.1, 20, 0.1}});
  const auto seen = [&](int spp, std::uint64_t seed) {
    return photo_jacobian(scene, unknowns, of_camera("Camera 0"), square_settings(16, spp, seed));
  };
  const PhotoJacobian first = seen(24, 1), second = seen(72, 2);
  PhotoJacobian both = first;
  both.join(second);
  EXPECT_EQ(both.spp(), 96);
  EXPECT_EQ(both.portions.size(), 8u);
  EXPECT_NEAR(both.mean[100].g, 0.25f * first.mean[100].g + 0.75f * second.mean[100].g, 1e-6);
  EXPECT_NEAR(both.variance[300], 0.25f * first.variance[300] + 0.75f * second.variance[300], 1e-6);
  const auto slope = [](const PhotoJacobian& one) {
    return instrumental_variables(one).plain().a.slopes(301, 1);
  };
  EXPECT_NEAR(slope(both), 0.25f * slope(first) + 0.75f * slope(second), 1e-5);
  const auto uncertainty = [](const PhotoJacobian& one) {
    Photo photo;
    photo.width = photo.height = 16;
    photo.reference = one.mean;
    check_photo(photo);
    return fisher_information(one, photo, {64, 0.01, 1}).relative_uncertainty();
  };
  EXPECT_LT(uncertainty(both), 0.8 * uncertainty(first));
  PhotoJacobian other = first;
  EXPECT_THROW(
      other.join(photo_jacobian(scene, unknowns, of_camera("Camera 0"), square_settings(8, 24, 1))),
      InvalidArgument);
}

TEST(PhotoJacobian, TooFewSamplesHaveNoSecondHalf) {
  EXPECT_THROW((void)look_at_matte(matte_scene(), 7), InvalidArgument);
}

}  // namespace
}  // namespace selenite
