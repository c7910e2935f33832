// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/inference/fisher_information.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "fit/problem/pixel_weights.h"
#include "fit/synthetic_renderer.h"

namespace selenite {
namespace {

using Matrix = Eigen::MatrixXd;

/// Without noise in it, every residual having the variance ratio / weight.
FisherInformation exact(const Matrix& normal, double ratio = 1) {
  return {normal, Matrix::Zero(normal.rows(), normal.cols()), ratio * normal, ratio, ratio};
}

FisherInformation uncertain(const Matrix& normal, double deviation) {
  FisherInformation found = exact(normal);
  found.normal_variance.setConstant(deviation * deviation);
  return found;
}

const Vector kUnit = Vector::Ones(2);

Vector errors(const std::vector<FisherInformation>& photos, const Vector& ranges = kUnit) {
  std::vector<Matrix> precisions;
  for (const FisherInformation& one : photos) precisions.push_back(one.precision());
  return expected_errors(precisions, ranges);
}

void expect_near(const Vector& found, const Vector& expected, double relative) {
  ASSERT_EQ(found.size(), expected.size());
  for (Eigen::Index k = 0; k < found.size(); ++k)
    EXPECT_NEAR(found[k], expected[k], relative * std::abs(expected[k])) << k;
}

Matrix diagonal(double first, double second) { return Vector{{first, second}}.asDiagonal(); }

TEST(FisherInformation, ErrorsAreTheRootsOfTheInverse) {
  const Matrix normal = 1e4 * Matrix{{4, 1}, {1, 2}};
  const Matrix prior = diagonal(1, 1) / (0.29 * 0.29);
  const Vector expected = (normal / 3 + prior).inverse().diagonal().cwiseSqrt();
  expect_near(errors({exact(normal, 3)}), expected, 1e-9);
}

// Each parameter shows alone: the error is the root of its own inverse, whatever the other one is.
TEST(FisherInformation, OfADiagonalJacobianIsThatOfEachParameter) {
  expect_near(errors({exact(diagonal(1e6, 1e8))}), Vector{{1e-3, 1e-4}}, 1e-4);
}

TEST(FisherInformation, OfTwoEqualPhotosIsTwice) {
  const FisherInformation one = exact(1e6 * Matrix{{1, 0.2}, {0.2, 3}});
  expect_near(errors({one, one}), errors({one}) * std::sqrt(0.5), 1e-3);
}

TEST(FisherInformation, APhotoWithABlindSpotIsHelpedByOneWithout) {
  const FisherInformation front = exact(diagonal(1e6, 0)), back = exact(diagonal(0, 1e6));
  const Vector before = errors({front});
  EXPECT_EQ(determined(before, kUnit), (std::vector<bool>{true, false}));
  EXPECT_NEAR(before[1], 0.29, 1e-9) << "as wide as the bounds leave it";
  const std::vector<std::vector<int>> groups{{0}, {1}};
  EXPECT_NEAR(information_gain(before, errors({front, front}), groups), std::log(2) / 4, 1e-3);
  EXPECT_NEAR(information_gain(before, errors({front, back}), groups), std::log(0.29 / 0.001) / 2,
              1e-2);
}

TEST(FisherInformation, WhatMakesUpForEachOtherIsOpenUntilAPhotoTellsThemApart) {
  const FisherInformation together = exact(Matrix::Constant(2, 2, 1e6));
  const FisherInformation apart = exact(1e6 * Matrix{{1, -1}, {-1, 1}});
  const Vector before = errors({together});
  EXPECT_EQ(determined(before, kUnit), (std::vector<bool>{false, false}));
  expect_near(errors({together, apart}), kUnit * 1e-3 / std::sqrt(2), 1e-3);
}

TEST(FisherInformation, WithinItsOwnNoiseCountsAsNone) {
  for (const double value : {-1e4, 1e4}) {
    const FisherInformation noise = uncertain(diagonal(1e6, value), 5e3);
    EXPECT_NEAR(errors({noise})[1], 0.29, 1e-9) << value;
    EXPECT_NEAR(errors({exact(diagonal(1e6, 0)), noise})[1], 0.29, 1e-9) << value;
  }
  EXPECT_NEAR(errors({uncertain(diagonal(1e6, 1e4), 1e3)})[1], 0.01, 2e-5);
}

// 200 photos with noise of the size of what they say.
TEST(FisherInformation, OfAnotherPhotoNeverMakesAnythingLessKnown) {
  const FisherInformation base = exact(1e6 * Matrix{{1, 0.2}, {0.2, 3}});
  const Vector before = errors({base});
  const auto normal_number = [](int photo, std::uint32_t entry) {
    const Random random(7, static_cast<std::uint32_t>(photo), entry);
    return std::sqrt(-2 * std::log(1 - random.uniform(0))) *
           std::cos(2 * kPi<double> * random.uniform(1));
  };
  for (int photo = 0; photo < 200; ++photo) {
    Matrix normal = diagonal(1e6, 3e6);
    for (std::uint32_t i = 0; i < 4; ++i) normal(i / 2, i % 2) += 1e6 * normal_number(photo, i);
    FisherInformation other = uncertain(normal, 1e6);
    other.low = 0.5;
    other.high = 2;
    const Vector after = errors({base, other});
    EXPECT_TRUE((after.array() <= before.array() * (1 + 1e-9)).all()) << photo;
  }
}

TEST(FisherInformation, NoiseInTheScoreStaysInsideWhatItCanBe) {
  FisherInformation wild = exact(diagonal(1e4, 1e4));
  wild.score_covariance = diagonal(-5, 1e9);
  wild.low = 0.5;
  wild.high = 2;
  expect_near(errors({wild}), Vector{{std::sqrt(0.5e-4), std::sqrt(2e-4)}}, 2e-3);
}

TEST(FisherInformation, GainCountsParametersAndNotChannelsAndHasNoUnit) {
  const Vector before = Vector::Constant(4, 0.2);
  const Vector after{{0.2, 0.2, 0.2, 0.1}}, scale{{1, 1, 1, 3}};
  const std::vector<std::vector<int>> groups{{0, 1, 2}, {3}};
  EXPECT_NEAR(information_gain(before, after, groups), std::log(2) / 2, 1e-12);
  EXPECT_NEAR(information_gain(scale.cwiseProduct(before), scale.cwiseProduct(after), groups),
              std::log(2) / 2, 1e-12);
}

TEST(FisherInformation, UncertaintyIsAShareOfWhatIsKnown) {
  const Matrix four = Matrix::Constant(1, 1, 4);
  EXPECT_EQ(uncertain(Matrix::Zero(1, 1), 1).relative_uncertainty(),
            std::numeric_limits<double>::infinity());
  EXPECT_EQ(exact(Matrix::Zero(1, 1)).relative_uncertainty(), 0)
      << "not seen at all: no samples change that";
  EXPECT_DOUBLE_EQ(uncertain(four, 1).relative_uncertainty(), 0.25);
}

TEST(FisherInformation, TheWeakestDirectionTellsWhatMoreSamplesAreNeededFor) {
  const FisherInformation one = uncertain(diagonal(100, 4), 1);
  EXPECT_NEAR(weakest_direction(std::vector{one}), 4, 1e-9);
  EXPECT_NEAR(weakest_direction(std::vector{one, one}), 4 * std::sqrt(2), 1e-9);
  EXPECT_EQ(weakest_direction(std::vector{exact(diagonal(1, 0))}), 0);
}

// ---- from pictures ----

constexpr int kSide = 48;
constexpr ResidualNoise kNoise{100, 0.02, 4};

/// Derivatives by one roughness that are known on paper.
struct OnPaper {
  Scene scene = synthetic_scene();
  Unknowns unknowns{scene, roughness_from(0.5)};
  Photo photo = grey_capture(kSide);
  PhotoJacobian seen;

  explicit OnPaper(double variance = 0.5) {
    seen.width = seen.height = kSide;
    seen.layout = unknowns.layout(scene);
    const Eigen::Index rows = 3 * kSide * kSide;
    seen.variance = Eigen::VectorXf::Constant(rows, static_cast<float>(variance));
    photo.reference.assign(photo.size(), Colorf(1));
  }
  /// slope(row) in all halves, with noise of a standard deviation in each half of each portion.
  template <class Slope>
  FisherInformation information(Slope&& slope, double deviation, std::uint64_t seed = 1,
                                const ResidualNoise& noise = kNoise) {
    check_photo(photo);
    seen.portions.clear();
    std::uint64_t half = 0;
    for (int portion = 0; portion < kJacobianPortions; ++portion) {
      Halves halves;
      halves.differentiated.resize(1);
      halves.differentiated[0] = true;
      for (Jacobian* one : {&halves.jacobian_a, &halves.jacobian_b}) {
        one->resize(seen.variance.size(), 1);
        const std::uint64_t key = mix64(seed * 1000 + half++);
        for (Eigen::Index i = 0; i < one->rows(); ++i) {
          const Random random(key, static_cast<std::uint32_t>(i), 0);
          (*one)(i, 0) = static_cast<float>(slope(i) + deviation * std::sqrt(12.0) *
                                                           (random.uniform(0) - 0.5));
        }
      }
      seen.portions.push_back({std::move(halves), 16});
    }
    return fisher_information(seen, photo, noise);
  }
};

double even_slope(Eigen::Index /*row*/) { return 2; }

// A brightness of 1.3, with the share of the mean; pixels that do not count are as if not there, but
// for the two rows beside them, whose neighbours are black.
TEST(FisherInformation, OfAPictureIsThatOfTheFormula) {
  OnPaper paper;
  paper.photo.weight.assign(paper.photo.size(), 1.f);
  for (std::size_t p = 0; p < paper.photo.size() / 4; ++p) paper.photo.weight[p] = 0;
  const FisherInformation found = paper.information(even_slope, 0);
  const double count = static_cast<double>(std::ranges::count(paper.photo.weight, 1.f));
  const double v = 0.5 / 100 + std::pow(0.02 * 1.3, 2);
  const double w = 1 / (0.5 / 64 + std::pow(0.05 * 1.3, 2));
  EXPECT_NEAR(found.normal(0, 0), 4 * w, 0.02 * 4 * w);
  EXPECT_NEAR(found.normal_variance(0, 0), 0, 1e-12);
  // A slope in all channels, whose noise goes together: three channels are no more than one.
  const double error = std::sqrt(v / (4 * 4 * count));
  EXPECT_NEAR(errors({found}, Vector{{4.0}})[0], error, 0.02 * error);
  const FisherInformation red =
      paper.information([](Eigen::Index i) { return i % 3 == 0 ? 2.0 : 0.0; }, 0);
  EXPECT_NEAR(errors({red}, Vector{{4.0}})[0], error, 0.02 * error);
}

// What a fit has left unexplained is in the weights and in the error; more pixels do not average it.
TEST(FisherInformation, KnowsAModelError) {
  OnPaper paper;
  ResidualNoise noise = kNoise;
  noise.pixels = 4;
  noise.model = {0.3, 0.1, 0};
  const FisherInformation found = paper.information(even_slope, 0, 1, noise);
  const double model = std::pow(0.3 * 1.3, 2) + std::pow(0.1, 2);
  const double w = 1 / (0.5 / 64 + std::pow(0.05 * 1.3, 2) + model);
  EXPECT_NEAR(found.normal(0, 0), 4 * w, 1e-3 * 4 * w);
  const double v = (0.5 / 100 + std::pow(0.02 * 1.3, 2)) / 4 + model;
  const double error = std::sqrt(v / (4 * static_cast<double>(paper.photo.size())));
  EXPECT_NEAR(errors({found}, Vector{{4.0}})[0], error, 1e-3 * error);
}

// A photo's noise has bright pixels; weighted down for it, each would say a hundredth of what it
// says in a fit.
TEST(FisherInformation, WeighsABrightSpeckAsAFitDoes) {
  OnPaper paper;
  paper.photo.reference[kSide * kSide / 2 + kSide / 2] = Colorf(100);
  const FisherInformation found = paper.information(even_slope, 0);
  std::vector<Photo> photos{paper.photo};
  check_photos(paper.scene, photos);
  const Problem problem{paper.unknowns, paper.seen.layout, photos, find_loss("robust"), 10};
  const Eigen::VectorXf of_fit = GaussNewton(problem).weights().by_variance(0, paper.seen.variance);
  const double expected = 4 * of_fit.cast<double>().sum();
  EXPECT_NEAR(found.normal(0, 0), expected, 1e-4 * expected);
  // The weight of the speck itself, were it its own measure of brightness.
  const Eigen::VectorXf own = box_blur(
      Eigen::Map<const Eigen::VectorXf>(&photos[0].reference[0].r, of_fit.size()), kSide, kSide, 2);
  const Eigen::Index speck = 3 * (kSide * kSide / 2 + kSide / 2);
  EXPECT_GT(own[speck], 4 * own[0]) << "the mean with the speck is four times that without";
  EXPECT_NEAR(of_fit[speck], of_fit[0], 0.2f * of_fit[0]);
}

// Noise of a standard deviation of 3 in a half of 16 samples, on a slope of 2.
TEST(FisherInformation, ProductsOfHalvesHaveNoBiasOfNoise) {
  OnPaper paper;
  constexpr int kDraws = 60;
  const double without = paper.information(even_slope, 0).normal(0, 0);
  double sum = 0, square_sum = 0, reported = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const FisherInformation found =
        paper.information(even_slope, 3, 100 + static_cast<std::uint64_t>(draw));
    sum += found.normal(0, 0) / kDraws;
    square_sum += square(found.normal(0, 0)) / kDraws;
    reported += found.normal_variance(0, 0) / kDraws;
  }
  const double deviation = std::sqrt(square_sum - sum * sum);
  // Products of one half with itself would be 1 + 9 / 4 / 4 = 1.6 times as much.
  EXPECT_NEAR(sum / without, 1, 0.01);
  EXPECT_GT(std::sqrt(reported) / deviation, 0.5);
  EXPECT_LT(std::sqrt(reported) / deviation, 2.0);
}

// Five standard deviations would be a false alarm in none of these ten, three in one of a hundred.
TEST(FisherInformation, OfNoiseAloneIsNotSeen) {
  OnPaper paper;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const FisherInformation found = paper.information([](Eigen::Index) { return 0.0; }, 5, seed);
    EXPECT_EQ(found.precision()(0, 0), 0) << seed;
    EXPECT_GT(found.relative_uncertainty(), 0.3) << seed;
  }
}

TEST(FisherInformation, RendersInPortionsAsARefinementDoes) {
  EXPECT_THROW(
      {
        const Scene scene = synthetic_scene();
        RenderSettings settings;
        settings.width = settings.height = 4;
        settings.spp = kLeastJacobianSpp - 1;
        (void)photo_jacobian(scene, Unknowns(scene, roughness_from(0.5)), grey_capture(4),
                             settings);
      },
      InvalidArgument);
}

// 20 renders of a photo that is 3 % off; their own noise is 20 % a half, in bright places more.
TEST(RelativeMisfit, FindsADifferenceBeyondNoiseAndNoNoise) {
  constexpr int kSize = 40, kRenders = 20, kSpp = 2;
  constexpr double kLevel = 0.5 + 0.3 * 0.5;  // with what keeps it away from 0
  const auto found = [&](double difference, double bright) {
    Photo photo = grey_capture(kSize);
    for (std::size_t p = 0; p < photo.size(); ++p)
      photo.reference[p] += Colorf(static_cast<float>(
          (p / kSize + p % kSize) % 2 == 0 ? difference * kLevel : -difference * kLevel));
    check_photo(photo);
    double sum = 0;
    for (std::uint64_t seed = 0; seed < kRenders; ++seed) {
      Film film(kSize, kSize, kSpp);
      for (std::size_t p = 0; p < film.size(); ++p) {
        const std::size_t x = p % kSize, y = p / kSize;
        const bool in_bright = x >= 5 && x < 9 && y >= 5 && y < 9;
        const double deviation = std::sqrt(0.01 + (in_bright ? bright * bright : 0));
        for (int c = 0; c < 3; ++c) {
          const Random random(seed + 50, static_cast<std::uint32_t>(p),
                              static_cast<std::uint32_t>(c));
          const auto half = [&](std::uint32_t i) {
            return 0.5 + deviation * std::sqrt(12.0) * (random.uniform(i) - 0.5);
          };
          const double a = half(0), b = half(1);
          film.half_a[p][c] = static_cast<float>(a);
          film.mean[p][c] = static_cast<float>((a + b) / 2);
          film.variance[p][c] = static_cast<float>(deviation * deviation / kSpp);
        }
      }
      sum += relative_misfit(film, photo) / kRenders;
    }
    return sum;
  };
  // Of products of two halves, in a plain mean.
  const double error = 0.01 / square(kLevel) / std::sqrt(kRenders * 3.0 * kSize * kSize);
  EXPECT_NEAR(found(0, 0), 0, 5 * error);
  EXPECT_NEAR(found(0.03, 0), square(0.03), 0.02 * square(0.03) + 5 * error);
  // Without the weights the bright places alone would have 100 times this error.
  EXPECT_NEAR(found(0.03, 10), square(0.03), 0.05 * square(0.03) + 20 * error);
}

}  // namespace
}  // namespace selenite
