// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/objective/gain_slopes.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "fit/objective/closed_form_gain.h"
#include "fit/objective/photo_weights.h"
#include "fit/problem/pixel_weights.h"
#include "fit/synthetic_renderer.h"
#include "math/scalar.h"

namespace selenite {
namespace {

constexpr int kSide = 16;

/// A photo whose picture depends on one grey number: light times it, and what it leaves alone.
struct OneNumber {
  Scene scene = synthetic_scene();
  Unknowns unknowns{scene, {{"Body", "roughness", {0.4}, 0.05, 1, 0.03}}};
  std::vector<Photo> photos{photo()};
  SlotLayout layout{unknowns.layout(scene)};
  Problem problem{unknowns, layout, photos, find_loss("robust"), 1};

  static Photo photo() {
    Photo photo = grey_capture(kSide);
    photo.gain_freedom = GainFreedom::kScalar;
    check_photo(photo);
    return photo;
  }
  /// Picture and derivative without noise.
  Observation seen() const {
    Film film(kSide, kSide, 4, 1);
    for (std::size_t i = 0; i < film.size(); ++i) {
      const auto at = static_cast<float>(i);
      film.mean[i] = Colorf(0.5f + 0.2f * std::sin(0.3f * at));
      film.slots[0].mean[i] = Colorf(0.3f + 0.4f * std::cos(0.2f * at));
    }
    return {0, std::move(film), {}};
  }
};

TEST(GainSlopes, GiveAGainItsShareOfTheJointCovariance) {
  const OneNumber one;
  const Observation seen = one.seen();
  GainSlopes sums(one.problem);
  sums.add(one.problem, seen, Vector::Constant(1, 2), 3);
  const Eigen::MatrixXd slopes = sums.slopes()[0];
  ASSERT_EQ(slopes.rows(), 3);

  // The normal matrix of the number and of the logarithm of the gain, by hand.
  const Eigen::VectorXf weights = relative_weights(one.photos[0], 1);
  Eigen::Matrix2d joint = Eigen::Matrix2d::Zero();
  for (std::size_t i = 0; i < seen.film.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      const Eigen::Vector2d row(2 * static_cast<double>(seen.film.slots[0].mean[i][c]),
                                static_cast<double>(seen.film.mean[i][c]));
      joint += static_cast<double>(weights[static_cast<Eigen::Index>(3 * i) + c]) * row *
               row.transpose();
    }
  joint(1, 1) += gain_prior(one.problem, one.photos[0]);
  const double scale = 1e-4;  // of squared errors
  const Eigen::Matrix2d covariance = scale * joint.inverse();
  const auto given = static_cast<float>(std::sqrt(scale / joint(1, 1)));
  const Colorf gain(2);
  const Colorf error = joint_gain_error(gain, gain * given, slopes,
                                        Eigen::MatrixXd::Constant(1, 1, covariance(0, 0)));
  const double expected = 2 * std::sqrt(covariance(1, 1));
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(error[c], expected, 1e-4 * expected);
  EXPECT_GT(expected, 1.05 * 2 * static_cast<double>(given)) << "else nothing is shown";
}

TEST(GainSlopes, OfAPhotoWithoutAFreeGainAreNone) {
  OneNumber one;
  one.photos[0].gain_freedom = GainFreedom::kNone;
  GainSlopes sums(one.problem);
  sums.add(one.problem, one.seen(), Vector::Constant(1, 2), 3);
  ASSERT_EQ(sums.slopes().size(), 1u);
  EXPECT_EQ(sums.slopes()[0].rows(), 0);
  const Colorf error = joint_gain_error(Colorf(1), Colorf(0.1f), sums.slopes()[0],
                                        Eigen::MatrixXd::Constant(1, 1, 4));
  EXPECT_EQ(error, Colorf(0.1f));
}

// The equations are a mean over photos: beside another photo the prior is half of them.
TEST(GainSlopes, APriorCountsByItsShareOfThePhotos) {
  const auto covariance_of = [](int further_photos) {
    OneNumber one;
    for (int i = 0; i < further_photos; ++i) {
      one.photos.push_back(OneNumber::photo());
      one.photos.back().gain_freedom = GainFreedom::kNone;
    }
    GainSlopes sums(one.problem);
    sums.add(one.problem, one.seen(), Vector::Constant(1, 2), 3);
    const double slope = sums.slopes()[0](0, 0);
    return sums.prior_covariance()(0, 0) / square(slope);
  };
  const OneNumber one;
  const double alone = square(gain_prior(one.problem, one.photos[0]) * kGainPrior.log_deviation);
  EXPECT_NEAR(covariance_of(0), alone, 1e-6 * alone);
  EXPECT_NEAR(covariance_of(1), alone / 4, 1e-6 * alone);
}

// Nothing holds the brightness but the prior of the gain: a factor of two either way.
TEST(GainSlopes, AnErrorIsAtMostThatOfThePrior) {
  const Colorf error =
      joint_gain_error(Colorf(3), Colorf(0.1f), Eigen::MatrixXd::Constant(3, 1, -5),
                       Eigen::MatrixXd::Constant(1, 1, 1));
  EXPECT_FLOAT_EQ(error.r, 3 * static_cast<float>(kGainPrior.log_deviation));
}

}  // namespace
}  // namespace selenite
