// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/photo/photo.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fit/run/fit.h"
#include "fit/synthetic_renderer.h"
#include "math/error.h"

namespace selenite {
namespace {

struct BadPhoto {
  const char* name;
  void (*spoil)(std::vector<Photo>&);
  const char* says;
};
class BadPhotos : public ::testing::TestWithParam<BadPhoto> {};
TEST_P(BadPhotos, AreNamedWithTheirCure) {
  const Scene scene = synthetic_scene();
  std::vector<Photo> photos{synthetic_capture(scene, "Left", 4)};
  GetParam().spoil(photos);
  try {
    check_photos(scene, photos);
    FAIL() << "accepted";
  } catch (const std::exception& error) {
    EXPECT_NE(std::string(error.what()).find(GetParam().says), std::string::npos) << error.what();
  }
}
using Photos = std::vector<Photo>;
INSTANTIATE_TEST_SUITE_P(
    Table, BadPhotos,
    ::testing::Values(
        BadPhoto{"none", [](Photos& c) { c.clear(); }, "at least one camera"},
        BadPhoto{"camera", [](Photos& c) { c[0].camera = "Top"; }, "Left"},
        BadPhoto{"twice", [](Photos& c) { c.push_back(c[0]); }, "another photo has its id"},
        BadPhoto{"empty", [](Photos& c) { c[0].width = 0; }, "at least 1"},
        BadPhoto{"size", [](Photos& c) { c[0].width = 5; }, "holds 16 pixels, not 5 x 4"},
        BadPhoto{"mask_size", [](Photos& c) { c[0].weight.assign(3, 1.f); }, "its mask holds 3"},
        BadPhoto{"negative", [](Photos& c) { c[0].weight.assign(16, -1.f); }, ">= 0"},
        BadPhoto{"no_pixel", [](Photos& c) { c[0].weight.assign(16, 0.f); }, "leaves no pixel"},
        BadPhoto{"nan", [](Photos& c) { c[0].reference[3].g = std::nanf(""); },
                 "1 pixels are not"}),
    [](const auto& info) { return info.param.name; });

TEST(Photos, NanUnderTheMaskIsBlack) {
  const Scene scene = synthetic_scene();
  Photos photos{synthetic_capture(scene, "Left", 4)};
  photos[0].reference[3].g = std::nanf("");
  photos[0].weight.assign(16, 1.f);
  photos[0].weight[3] = 0;
  check_photos(scene, photos);
  EXPECT_EQ(photos[0].reference[3].g, 0.f);
  EXPECT_EQ(photos[0].total_weight, 15);
}

TEST(Photos, OfOneCameraNeedIdsOfTheirOwn) {
  const Scene scene = synthetic_scene();
  Photos photos(2, synthetic_capture(scene, "Left", 4));
  photos[1].id = "Left#2";
  check_photos(scene, photos);
  EXPECT_EQ(photos[0].id, "Left") << "the camera's name, unless given";
  EXPECT_EQ(photos[1].id, "Left#2");
}

/// Values after some iterations by Adam, whose derivatives have no noise.
Vector fitted_to(const Photos& photos) {
  FitSettings settings = synthetic_settings({0, 0});
  settings.loss = "mse";
  settings.iterations = 20;
  Fit fit(synthetic_scene(), photos, synthetic_unknowns(), settings);
  while (fit.step()) {
  }
  return fit.result().last;
}

TEST(Photos, OfOneCameraGiveTheGradientOfBoth) {
  const Scene scene = synthetic_scene();
  Photos both(2, synthetic_capture(scene, "Left"));
  both[1].id = "Left#2";
  Photo mean = both[0];
  for (std::size_t i = 0; i < mean.size(); ++i) {
    both[1].reference[i] = Colorf(0.1f, 0.5f, 0.9f);
    mean.reference[i] = (both[0].reference[i] + both[1].reference[i]) * 0.5f;
  }
  // The derivative of a mean of squares is linear in the photo.
  const Vector found = fitted_to(both), expected = fitted_to({mean});
  EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_GT((found - fitted_to({both[0]})).cwiseAbs().maxCoeff(), 0.01);
  EXPECT_GT((found - fitted_to({both[1]})).cwiseAbs().maxCoeff(), 0.01);
}

TEST(ResizedPhoto, AveragesWhatAPixelCoversAndLeavesOutWhatIsMasked) {
  Photo photo;
  photo.camera = "Left";
  photo.width = 8;
  photo.height = 4;
  photo.weight.assign(32, 1.f);
  for (int i = 0; i < 32; ++i) photo.reference.emplace_back(static_cast<float>(i));
  photo.weight[0] = 0;
  const Photo small = photo.resized(4);
  ASSERT_EQ(small.width, 4);
  ASSERT_EQ(small.height, 2);
  EXPECT_EQ(small.weight[0], 0.f);
  EXPECT_EQ(small.weight[1], 1.f);
  EXPECT_FLOAT_EQ(small.reference[1].r, (2 + 3 + 10 + 11) / 4.f);
  EXPECT_DOUBLE_EQ(small.total_weight, 7);
  EXPECT_EQ(photo.resized(8).width, 8) << "never larger";
}

TEST(ResizedPhoto, KeepsTheMeanAtAnUnevenRatio) {
  Photo photo;
  photo.camera = "Left";
  photo.width = photo.height = 5;
  photo.weight.assign(25, 1.f);
  double sum = 0;
  for (int i = 0; i < 25; ++i) {
    photo.reference.emplace_back(static_cast<float>(i * i));
    sum += i * i;
  }
  const Photo small = photo.resized(3);
  double small_sum = 0;
  for (const Colorf& c : small.reference) small_sum += c.r;
  EXPECT_NEAR(small_sum / 9, sum / 25, 1e-3);
}

TEST(ResizedPhoto, KeepsWhoItIs) {
  Photos photos{synthetic_capture(synthetic_scene(), "Left", 8)};
  photos[0].id = "Left#2";
  check_photos(synthetic_scene(), photos);
  const Photo small = photos[0].resized(4);
  EXPECT_EQ(small.width, 4);
  EXPECT_EQ(small.id, "Left#2");
  EXPECT_EQ(small.camera, "Left");
}

TEST(PhotoFingerprint, ChangesWithEachPartOfThePhoto) {
  const Scene scene = synthetic_scene();
  Photos photos{synthetic_capture(scene, "Left", 4)};
  check_photos(scene, photos);
  const Photo& photo = photos[0];
  EXPECT_EQ(photo.fingerprint(), Photo(photo).fingerprint());
  void (*const changes[])(Photo&) = {
      [](Photo& p) { p.id = "Left#2"; },
      [](Photo& p) { p.camera = "Right"; },
      [](Photo& p) { p.id = "Right"; },
      [](Photo& p) { p.width = 2, p.height = 8; },
      [](Photo& p) { p.frame.aspect = 1.01; },
      [](Photo& p) { p.frame.width = 41; },
      [](Photo& p) { p.frame.window.right = 0.9; },
      [](Photo& p) { p.reference[7].g = std::nextafter(p.reference[7].g, 2.f); },
      [](Photo& p) { std::swap(p.reference[7].r, p.reference[7].g); },
      [](Photo& p) { p.weight[15] = 0.5f; }};
  std::vector<std::uint64_t> found{photo.fingerprint()};
  for (const auto& change : changes) {
    Photo other = photo;
    change(other);
    for (const std::uint64_t known : found) EXPECT_NE(other.fingerprint(), known) << found.size();
    found.push_back(other.fingerprint());
  }
}

}  // namespace
}  // namespace selenite
