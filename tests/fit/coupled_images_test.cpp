// SPDX-License-Identifier: GPL-3.0-or-later
// Images whose numbers act on all channels of the pictures: one system of equations for all of them.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <random>

#include "fit/image_scenes.h"
#include "fit/problem/pixel_weights.h"
#include "fit/solver/bounded_influence.h"
#include "fit/solver/field_gauss_newton.h"
#include "fit/taken_photos.h"
#include "scene/shader/shader.h"

namespace selenite {
namespace {

constexpr int kSide = 12, kAlong = 6;
constexpr Eigen::Index kCells = kSide * kSide, kTexelCount = kAlong * kAlong;

std::shared_ptr<const Texture> grey_texels() {
  return std::make_shared<Texture>(
      "Wood", kAlong, kAlong, std::vector<Colorf>(kTexelCount, Colorf(0.5f)), std::vector<float>{},
      false, Extension::kRepeat, Interpolation::kLinear);
}

/// A board with images of its base colour, its roughness and a node.
Scene mapped_board() {
  Scene scene = board({0.5f, 0.5f, 0.5f, 0.5f});
  Material& material = scene.appearance.materials[0];
  material.maps[0].texture = grey_texels();
  FieldMap rough;
  rough.field = field_number("roughness");
  rough.texture = grey_texels();
  material.maps.push_back(rough);
  ShaderImage bumps;
  bumps.name = "Bumps.image";
  bumps.channels = 3;
  bumps.map.field = 0;
  bumps.map.texture = grey_texels();
  material.images.push_back(bumps);
  return scene;
}

struct Case {
  std::string name;
  std::vector<const char*> images;
};
void PrintTo(const Case& wanted, std::ostream* out) { *out << wanted.name; }

/// Photos of a world that is linear in the numbers of some images; each pixel sees four texels.
struct LinearMaps {
  Scene scene = mapped_board();
  std::vector<Photo> photos{3, taken_photos(scene, kSide, 1)[0]};
  Fields fields;
  std::unique_ptr<FieldGaussNewton> newton;
  std::vector<Eigen::VectorXf> weights;
  Eigen::Index numbers = 0;
  /// Of all photos: by photo, cell and channel; in the end of the numbers of all images.
  Eigen::MatrixXd jacobian;
  std::mt19937 random{3};

  static std::vector<UnknownParameter> wanted(const Case& of) {
    std::vector<UnknownParameter> all;
    for (const char* image : of.images) all.push_back({"Board", image, {}, 0, 1, 0.03});
    return all;
  }

  explicit LinearMaps(const Case& of) : fields(scene, wanted(of)) {
    for (std::size_t i = 0; i < photos.size(); ++i) {
      photos[i].id = std::to_string(i);
      photos[i].reference.assign(photos[i].size(), Colorf(0.5f));
      weights.push_back(relative_weights(photos[i], photos.size()));
    }
    newton = FieldGaussNewton::of(fields, photos);
    newton->set_values(fields.start());
    for (const Vector& one : fields.start()) numbers += one.size();
    jacobian = Eigen::MatrixXd::Zero(3 * kCells * std::ssize(photos), numbers);
    for (std::size_t i = 0; i < photos.size(); ++i) gather(i);
  }

  void gather(std::size_t i) {
    std::uniform_real_distribution<float> some(0.5f, 1.5f);
    FieldJacobian derivatives;
    Eigen::Index first = 0;
    for (std::size_t f = 0; f < fields.refs().size(); ++f) {
      const bool by_channel = fields.acts_by_channel(f);
      const int kinds = by_channel ? 1 : fields.channels(f);
      PlaceSlopes seen(kCells);
      for (int p = 0; p < kCells; ++p) {
        const int x = std::min(p % kSide / 2, kAlong - 2), y = std::min(p / kSide / 2, kAlong - 2);
        for (const int texel :
             {y * kAlong + x, y * kAlong + x + 1, (y + 1) * kAlong + x, (y + 1) * kAlong + x + 1})
          for (int k = 0; k < kinds; ++k) {
            const Colorf slope{some(random), some(random), -some(random)};
            seen[static_cast<std::size_t>(p)].push_back(
                {static_cast<std::uint32_t>(texel * kinds + k), slope});
            for (int c = 0; c < 3; ++c)
              jacobian((static_cast<Eigen::Index>(i) * kCells + p) * 3 + c,
                       first + (by_channel ? 3 * texel + c : texel * kinds + k)) = slope[c];
          }
      }
      derivatives.fields.emplace_back(kCells, 0);
      derivatives.places.push_back(seen);
      first += fields.start()[f].size();
    }
    newton->gather(i, derivatives);
  }

  /// What photos show of numbers that are off by so much, with errors.
  Eigen::VectorXd add_residuals(const Eigen::VectorXd& off, double error) {
    std::normal_distribution<double> normal;
    Eigen::VectorXd residual = jacobian * off;
    for (double& one : residual) one += error * normal(random);
    for (std::size_t i = 0; i < photos.size(); ++i) {
      Halves halves;
      halves.residual_a =
          residual.segment(static_cast<Eigen::Index>(i) * 3 * kCells, 3 * kCells).cast<float>();
      halves.residual_b = halves.residual_a;
      halves.variance = Eigen::VectorXf::Zero(3 * kCells);
      newton->add_residual(i, halves, weights[i], 0);
    }
    return residual;
  }

  Eigen::VectorXd values() const {
    Eigen::VectorXd all(numbers);
    Eigen::Index at = 0;
    for (const Vector& one : newton->values()) {
      all.segment(at, one.size()) = one;
      at += one.size();
    }
    return all;
  }

  /// Weights of all residuals, less those by which a cell would count for more than its neighbours.
  Eigen::VectorXd bounded_weights() const {
    Eigen::VectorXd all(jacobian.rows());
    for (std::size_t i = 0; i < photos.size(); ++i) {
      const Eigen::Index first = static_cast<Eigen::Index>(i) * 3 * kCells;
      const Eigen::ArrayXd rows =
          weights[i].cast<double>().array() *
          jacobian.middleRows(first, 3 * kCells).rowwise().squaredNorm().array();
      const Eigen::ArrayXf strength =
          rows.reshaped(3, kCells).colwise().sum().transpose().cast<float>();
      const Eigen::ArrayXf factors = bounded_influence(strength, kSide);
      all.segment(first, 3 * kCells) = weights[i].cast<double>().cwiseProduct(
          factors.replicate(1, 3).transpose().reshaped().matrix().cast<double>());
    }
    return all;
  }

  /// Of each image and channel: differences between neighbours in a repeated image, and from the mean.
  Eigen::MatrixXd prior() const {
    constexpr FieldPriorOptions kPrior;
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(numbers, numbers);
    Eigen::Index first = 0;
    for (std::size_t f = 0; f < fields.refs().size(); ++f) {
      const int n = fields.channels(f);
      // So few texels differ as much as those of colours.
      const double difference =
          fields.acts_by_channel(f)
              ? kPrior.image_difference
              : std::min(kPrior.image_difference,
                         kPrior.number_difference * kPrior.number_side / kAlong);
      const auto at = [&](int x, int y, int k) {
        return first + (y % kAlong * kAlong + x % kAlong) * n + k;
      };
      const auto add = [&](Eigen::Index a, Eigen::Index b) {
        Eigen::VectorXd way = Eigen::VectorXd::Zero(numbers);
        way[a] = 1;
        way[b] -= 1;
        sum += way * way.transpose() / (difference * difference);
      };
      for (int k = 0; k < n; ++k) {
        Eigen::VectorXd mine = Eigen::VectorXd::Zero(numbers);
        for (int y = 0; y < kAlong; ++y)
          for (int x = 0; x < kAlong; ++x) {
            add(at(x, y, k), at(x + 1, y, k));
            add(at(x, y, k), at(x, y + 1, k));
            mine[at(x, y, k)] = 1;
          }
        sum += (Eigen::MatrixXd(mine.asDiagonal()) - mine * mine.transpose() / kTexelCount) /
               (kPrior.image_deviation * kPrior.image_deviation);
      }
      first += fields.start()[f].size();
    }
    return sum;
  }
};

class CoupledImages : public testing::TestWithParam<Case> {};

TEST_P(CoupledImages, AStepIsThatOfTheDenseEquations) {
  LinearMaps world(GetParam());
  const Eigen::VectorXd off = Eigen::VectorXd::NullaryExpr(
      world.numbers, [](Eigen::Index k) { return 0.1 * std::sin(0.7 * static_cast<double>(k)); });
  const Eigen::VectorXd residual = world.add_residuals(off, 0.1);
  const Eigen::VectorXd before = world.values();
  world.newton->solve(1);
  world.newton->advance(Eigen::VectorXd(0));

  const Eigen::VectorXd weight = world.bounded_weights();
  const Eigen::MatrixXd weighted = weight.asDiagonal() * world.jacobian;
  Eigen::MatrixXd normal = world.jacobian.transpose() * weighted;
  Eigen::Index first = 0;
  Eigen::VectorXd damping(world.numbers);
  for (const Vector& one : world.fields.start()) {
    const Eigen::VectorXd strength = normal.diagonal().segment(first, one.size());
    damping.segment(first, one.size())
        .setConstant(FieldGaussNewtonOptions{}.last_damping * strength.squaredNorm() /
                     strength.sum());
    first += one.size();
  }
  normal += world.newton->prior_strength() * world.prior();
  normal.diagonal() += damping;
  const Eigen::VectorXd expected = -normal.llt().solve(weighted.transpose() * residual);
  ASSERT_LT(expected.cwiseAbs().maxCoeff(), FieldPriorOptions{}.longest);
  // Conjugate gradients end where a residual is 1e-4 of the first; with 1e-7 this is below 2e-4.
  EXPECT_LT((world.values() - before - expected).norm(), 3e-3 * expected.norm());
  EXPECT_GT(expected.dot(-off), 0.5 * off.squaredNorm()) << "towards where the numbers are";
}

/// The residuals of three channels, less a degree of freedom a number, tell the errors.
TEST_P(CoupledImages, ThePriorCountsByTheErrors) {
  LinearMaps world(GetParam());
  world.add_residuals(Eigen::VectorXd::Zero(world.numbers), 0.05);
  world.newton->solve(1);
  const Eigen::VectorXd weight = world.bounded_weights();
  const Eigen::VectorXd strength = weight.cwiseProduct(world.jacobian.rowwise().squaredNorm());
  const double variance = strength.dot(weight) / strength.sum() * 0.05 * 0.05;
  EXPECT_NEAR(world.newton->prior_strength(), variance, 0.15 * variance);
}

/// The board's image as the colour of a Normal Map node; `mixes`: as the share of the surface, too.
Scene bumpy_board(bool mixes) {
  Scene scene = mapped_board();
  Material& material = scene.appearance.materials[0];
  Shader shader;
  shader.literals = {Colorf(1)};
  shader.textures = {grey_texels()};
  shader.operands = {-1, 0, 1};
  Instruction lookup, turn;
  lookup.op = Op::kImage;
  lookup.count = 1;
  lookup.item = 0;
  turn.op = Op::kNormalMap;
  turn.first = 1;
  turn.count = 2;
  shader.instructions = {lookup, turn};
  ShaderClosure closure;
  closure.normal = 2;
  if (mixes) closure.weight = 1;
  shader.closures = {closure};
  material.shader = std::make_shared<const Shader>(shader);
  return scene;
}

TEST(Normals, KeepTheirLength) {
  const Fields fields(bumpy_board(false), LinearMaps::wanted({"", {"Bumps.image"}}));
  ASSERT_TRUE(fields.encodes_normals(0));
  const FieldNumbers numbers(fields, kTexelCount);
  const auto any = [](double size) {
    return Vector::NullaryExpr(3 * kTexelCount, [=](Eigen::Index k) {
      return 0.5 + size * std::sin(1.7 * static_cast<double>(k));
    });
  };
  FieldValues values{any(0.3)};
  const Eigen::VectorXd before = 2 * values[0].array() - 1;
  Eigen::VectorXd step = any(0.05).array() - 0.5;
  const Eigen::VectorXd wanted = step;
  numbers.keep_lengths(values[0], step);
  numbers.add(step, values);
  for (Eigen::Index k = 0; k < step.size(); k += 3) {
    const Eigen::Vector3d vector = before.segment<3>(k), moved = step.segment<3>(k);
    EXPECT_NEAR(moved.dot(vector), 0, 1e-12);
    EXPECT_NEAR(moved.cross(vector).norm(), wanted.segment<3>(k).cross(vector).norm(), 1e-12);
    const Eigen::Vector3d after = 2 * values[0].segment<3>(k).array() - 1;
    EXPECT_NEAR(after.norm(), 1, 1e-12);
    EXPECT_NEAR(after.cross(vector + 2 * moved).norm(), 0, 1e-12);
  }
}

TEST(Normals, AreOfImagesThatTurnNormalsAlone) {
  const auto encodes = [](const Scene& scene, const char* image) {
    return Fields(scene, LinearMaps::wanted({"", {image}})).encodes_normals(0);
  };
  EXPECT_FALSE(encodes(mapped_board(), "Bumps.image")) << "no shader takes it";
  EXPECT_FALSE(encodes(bumpy_board(true), "Bumps.image"));
  EXPECT_FALSE(encodes(bumpy_board(false), "roughness_texture"));
}

INSTANTIATE_TEST_SUITE_P(Images, CoupledImages,
                         testing::Values(Case{"numbers", {"roughness_texture"}},
                                         Case{"colours_and_numbers",
                                              {"base_color_texture", "roughness_texture"}},
                                         Case{"colours_of_a_graph", {"Bumps.image"}}),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace selenite
