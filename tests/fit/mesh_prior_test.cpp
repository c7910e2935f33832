// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/objective/mesh_prior.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace selenite {
namespace {

constexpr int kSide = 41;

/// A square of triangles, with a value for each vertex.
Mesh square() {
  Mesh mesh;
  mesh.positions.resize(kSide * kSide);
  for (int y = 0; y + 1 < kSide; ++y)
    for (int x = 0; x + 1 < kSide; ++x) {
      const int a = y * kSide + x, b = a + 1, c = a + kSide, d = c + 1;
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({b, d, c});
    }
  return mesh;
}

VertexColors colors_of_vertices(const Mesh& mesh) {
  auto elements = std::make_shared<std::vector<int>>();
  for (const auto& triangle : mesh.triangles)
    elements->insert(elements->end(), triangle.begin(), triangle.end());
  return {0, "Col", elements, std::vector<Colorf>(mesh.positions.size(), Colorf(0.5f))};
}

TEST(MeshGraph, HasTheEdgesOfAMesh) {
  const Mesh mesh = square();
  const MeshGraph graph(colors_of_vertices(mesh), mesh);
  const auto n = static_cast<std::size_t>(kSide);
  EXPECT_EQ(graph.edges().size(), 2 * n * (n - 1) + (n - 1) * (n - 1));
}

TEST(MeshGraph, JoinsCornersOfATriangleAndThoseAtAVertex) {
  Mesh mesh;
  mesh.positions.resize(4);
  mesh.triangles = {{0, 1, 2}, {2, 1, 3}};
  const auto elements =
      std::make_shared<const std::vector<int>>(std::vector<int>{0, 1, 2, 3, 4, 5});
  const MeshGraph graph({0, "Col", elements, std::vector<Colorf>(6)}, mesh);
  const std::vector<std::array<int, 2>> wanted = {{0, 1}, {0, 2}, {1, 2}, {1, 4},
                                                  {2, 3}, {3, 4}, {3, 5}, {4, 5}};
  EXPECT_EQ(graph.edges(), wanted);
}

/// One value spreads over as many as asked for: the variance along an axis is n / (4 pi), 11 % off on
/// squares that are halved, as their diagonals are longer.
TEST(MeshGraph, SmoothsOverAsManyValuesAsAskedFor) {
  const Mesh mesh = square();
  const MeshGraph graph(colors_of_vertices(mesh), mesh);
  Eigen::VectorXd one = Eigen::VectorXd::Zero(3 * graph.size());
  const int middle = kSide / 2;
  one[3 * (middle * kSide + middle)] = 1;
  const Eigen::VectorXd found = graph.smoothed(one, 40);
  double sum = 0, variance = 0;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const double w = found[3 * (y * kSide + x)];
      sum += w;
      variance += w * ((x - middle) * (x - middle) + (y - middle) * (y - middle)) / 2.0;
    }
  EXPECT_NEAR(sum, 1, 1e-2);
  EXPECT_NEAR(variance / sum, 40 / (4 * 3.14159265), 0.25 * 40 / (4 * 3.14159265));
  EXPECT_EQ(found[1], 0) << "another channel";
}

/// By hand: d/da of L / N (a - b)^2 / (0.2 m)^2, m = 0.5.
TEST(MeshPrior, PullsNeighboursTogetherAsStronglyAsTheMisfitSays) {
  Mesh mesh;
  mesh.positions.resize(3);
  mesh.triangles = {{0, 1, 2}};
  const MeshGraph graph(colors_of_vertices(mesh), mesh);
  Vector values = Vector::Constant(9, 0.5), moving = Vector::Ones(9);
  values[0] = 0.6;
  values[3] = 0.4;
  const auto gradient = [&](double loss) {
    Vector found = Vector::Zero(9);
    add_mesh_prior(graph, values, moving, {loss, 900}, found);
    return found;
  };
  const double strength = 2 * 0.09 / 900 / (0.1 * 0.1);
  EXPECT_NEAR(gradient(0.09)[0], strength * (0.2 + 0.1), 1e-12);
  EXPECT_NEAR(gradient(0.09)[3], -strength * (0.2 + 0.1), 1e-12);
  EXPECT_NEAR(gradient(0.09)[6], 0, 1e-12) << "between both";
  EXPECT_EQ(gradient(0)[0], 0) << "where photos are explained";
  moving[3] = 0;
  EXPECT_EQ(gradient(0.09)[3], 0) << "what no photo shows stays";
}

/// Where a value is one number, it is treated as one of the three of a colour.
TEST(MeshPrior, OfOneChannelIsThatOfAColours) {
  const Mesh mesh = square();
  const MeshGraph graph(colors_of_vertices(mesh), mesh);
  const Eigen::Index n = graph.size();
  const auto green = Eigen::seqN(1, n, 3);
  Vector colours = Vector::Constant(3 * n, 0.5);
  for (Eigen::Index i = 0; i < n; ++i)
    colours[3 * i + 1] = 0.5 + 0.3 * std::sin(static_cast<double>(i));
  const Vector numbers = colours(green);
  Vector of_colours = Vector::Zero(3 * n), of_numbers = Vector::Zero(n);
  add_mesh_prior(graph, colours, Vector::Ones(3 * n), {0.09, 900}, of_colours);
  add_mesh_prior(graph, numbers, Vector::Ones(n), {0.09, 900}, of_numbers);
  EXPECT_GT(of_numbers.cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_EQ(of_numbers, Vector(of_colours(green)));
  EXPECT_EQ(graph.smoothed(numbers, 40), Vector(graph.smoothed(colours, 40)(green)));
}

}  // namespace
}  // namespace selenite
