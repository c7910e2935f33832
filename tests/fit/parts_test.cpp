// SPDX-License-Identifier: GPL-3.0-or-later
// Parts of the photos, fitted alone where the photos are not explained.
#include <gtest/gtest.h>

#include <cmath>

#include "fit/phases/parts/part_disagreement.h"
#include "fit/run/fit.h"
#include "fit/synthetic_renderer.h"

namespace selenite {
namespace {

/// One roughness at 0.5, known within `error` in its coordinate, and what parts say that lie `apart`.
struct Widened {
  Confidence one;
  Reparametrization reparametrization;
  double at = 0;

  Widened(double error, const std::vector<double>& apart,
          const std::vector<PartAnswer>& others = {})
      : Widened(Unknowns(synthetic_scene(), roughness_from(0.5)), error, apart, others) {}

 private:
  Widened(const Unknowns& unknowns, double error, const std::vector<double>& apart,
          const std::vector<PartAnswer>& others)
      : reparametrization(unknowns), at(reparametrization.from_value(0, 0.5)) {
    std::vector<PartAnswer> parts;
    for (const double way : apart) {
      Confidence sure;
      sure.determined = true;
      parts.push_back({Vector::Constant(1, value(way)), {sure}});
    }
    parts.insert(parts.end(), others.begin(), others.end());
    TrustReport report;
    report.components.resize(1);
    report.components[0].interval = {value(-kQuantile90 * error), value(kQuantile90 * error)};
    report.components[0].standard_error = error;
    report.components[0].determined = true;
    report.covariance = Eigen::MatrixXd::Constant(1, 1, error * error);
    widen_by_parts(unknowns, reparametrization, Vector::Constant(1, 0.5), parts, report);
    one = report.components[0];
    variance = report.covariance(0, 0);
  }

 public:
  double value(double away) const { return reparametrization.to_value(0, at + away); }
  double variance = 0;
};

// Variance of the mean of four: (4 x 0.1^2) / (4 x 3); Student's t with three degrees of freedom.
TEST(PartsOfPhotos, WidenByTheirScatter) {
  const Widened found(0.01, {0.1, -0.1, 0.1, -0.1});
  const double half = 2.3534 * std::sqrt(0.04 / 12);
  EXPECT_NEAR(found.one.interval[0], found.value(-half), 1e-9);
  EXPECT_NEAR(found.one.interval[1], found.value(half), 1e-9);
  EXPECT_NEAR(std::sqrt(found.variance), half / kQuantile90, 1e-6);
  // What the report had as noise is a small share of it.
  EXPECT_NEAR(found.one.lasting, 1 - std::pow(kQuantile90 * 0.01 / half, 2), 0.01);
}

TEST(PartsOfPhotos, AreLeftAloneWithinChance) {
  const double error = 0.1;
  const Widened found(error, {0.15, -0.15, 0.15, -0.15});  // each has half the standard error
  EXPECT_NEAR(found.one.interval[1], found.value(kQuantile90 * error), 1e-9);
  EXPECT_NEAR(found.variance, error * error, 1e-12);
}

TEST(PartsOfPhotos, LeaveNothingDeterminedWhereTheyContradictEachOther) {
  EXPECT_FALSE(Widened(0.01, {1, -1}).one.determined);
  EXPECT_TRUE(Widened(0.01, {0.05, -0.05}).one.determined);
}

// It counts by the nearest value that it permits; one that permits the answer says nothing.
TEST(PartsOfPhotos, OneThatDeterminesNothingMayExcludeTheAnswer) {
  Confidence open;
  open.interval = {0.02, 0.999};
  const std::vector<PartAnswer> silent{{Vector::Constant(1, 0.999), {open}}};
  EXPECT_NEAR(Widened(0.01, {0}, silent).variance, 1e-4, 1e-9);
  open.interval = {0.6, 0.999};
  const std::vector<PartAnswer> excluding{{Vector::Constant(1, 0.999), {open}}};
  const Widened found(0.01, {0}, excluding);
  const double way = found.reparametrization.from_value(0, 0.6) - found.at;
  EXPECT_NEAR(found.one.interval[1], found.value(2.92 * std::sqrt(way * way / 2)), 1e-6);
}

/// The picture is the roughness, with noise.
struct Plain {
  Film operator()(const Scene& scene, const Camera&, const SlotLayout& layout,
                  const RenderSettings& settings, Progress*) const {
    const double r = scene.appearance.materials[0].values.roughness;
    return evenly_noisy_film(layout, settings, 0.02,
                             [=](std::size_t) { return std::pair(r, 1.0); });
  }
};

FitResult fitted(const std::vector<float>& levels) {
  std::vector<Photo> photos;
  for (const float level : levels) {
    Photo photo = grey_capture();
    photo.id = "photo" + std::to_string(photos.size());
    photo.reference.assign(photo.size(), Colorf(level));
    photos.push_back(std::move(photo));
  }
  FitSettings settings = exact_settings(Plain(), 12);
  settings.search = "off";
  Fit fit(synthetic_scene(), photos, roughness_from(0.5), settings);
  while (fit.step()) {
  }
  EXPECT_EQ(fit.result().message, "");
  return fit.result();
}

// Two photos that want 0.45 and 0.55: the jackknife needs three.
TEST(PartsOfPhotos, AnIntervalHoldsWhatEachPhotoWants) {
  const FitResult found = fitted({0.45f, 0.55f});
  ASSERT_FALSE(found.report.misfit.explained);
  EXPECT_EQ(found.phase, PhaseKind::kParts);
  const Confidence& one = found.report.components[0];
  EXPECT_LT(one.interval[0], 0.45);
  EXPECT_GT(one.interval[1], 0.55);
  EXPECT_NEAR(found.best[0], 0.49, 0.02) << "the answer stays that of all photos";
}

TEST(PartsOfPhotos, AreNotAskedWhereThePhotosAreExplained) {
  const FitResult found = fitted({0.5f, 0.5f});
  ASSERT_TRUE(found.report.misfit.explained);
  EXPECT_NE(found.phase, PhaseKind::kParts);
  EXPECT_LT(found.report.components[0].interval[1] - found.report.components[0].interval[0], 0.01);
}

TEST(PartsOfPhotos, GoOnToTheSameBits) {
  std::vector<Photo> photos;
  for (const float level : {0.45f, 0.55f}) {
    Photo photo = grey_capture();
    photo.id = "photo" + std::to_string(photos.size());
    photo.reference.assign(photo.size(), Colorf(level));
    photos.push_back(std::move(photo));
  }
  FitSettings settings = exact_settings(Plain(), 12);
  settings.search = "off";
  Fit whole(synthetic_scene(), photos, roughness_from(0.5), settings);
  std::vector<std::string> saved;
  while (whole.step())
    if (whole.result().phase == PhaseKind::kParts) saved.push_back(whole.saved());
  ASSERT_GT(saved.size(), 3u);
  for (const std::string& state : saved) {
    Fit second(synthetic_scene(), photos, roughness_from(0.5), settings);
    second.restore(state);
    while (second.step()) {
    }
    EXPECT_EQ(second.result().report.components[0].interval,
              whole.result().report.components[0].interval);
    EXPECT_EQ(second.result().samples, whole.result().samples);
  }
}

}  // namespace
}  // namespace selenite
