// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/enclosure.h"

#include <gtest/gtest.h>

#include "scene/small_scenes.h"

namespace selenite {
namespace {

Mesh turned_inside_out(Mesh mesh) {
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}
Mesh moved(Mesh mesh, const Vec3f& by) {
  for (Vec3f& p : mesh.positions) p += by;
  return mesh;
}
/// Both as one mesh.
Mesh joined(Mesh mesh, const Mesh& other) {
  const int first = static_cast<int>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
  for (const auto& t : other.triangles)
    mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  return mesh;
}
bool encloses(const Mesh& mesh) { return selenite::encloses(mesh.positions, mesh.triangles); }

TEST(Enclosure, ClosedBodiesHaveAnInside) {
  EXPECT_TRUE(encloses(box_mesh(1, 2, 3)));
  EXPECT_TRUE(encloses(sphere_mesh(1e-4, 8)));
  EXPECT_TRUE(encloses(moved(sphere_mesh(1, 8), {1e3f, 0, 0})));
  EXPECT_TRUE(encloses(joined(sphere_mesh(1, 8), moved(sphere_mesh(1, 8), {1.5f, 0, 0}))));
}

TEST(Enclosure, OpenBodiesHaveNone) {
  EXPECT_FALSE(encloses(Mesh{}));
  EXPECT_FALSE(encloses(quad_mesh(1)));
  Mesh box = box_mesh(1, 1, 1);
  box.triangles.pop_back();
  EXPECT_FALSE(encloses(box));
}

TEST(Enclosure, EveryEdgeHasOneFaceOnEachSide) {
  Mesh turned = box_mesh(1, 1, 1);
  std::swap(turned.triangles[0][1], turned.triangles[0][2]);
  EXPECT_FALSE(encloses(turned));
  Mesh doubled = box_mesh(1, 1, 1);
  doubled.triangles.insert(doubled.triangles.end(), doubled.triangles.begin(),
                           doubled.triangles.end());
  EXPECT_FALSE(encloses(doubled));
}

TEST(Enclosure, BehindAnInvertedBodyIsOutside) {
  const Mesh inverted = turned_inside_out(sphere_mesh(0.5, 8));
  EXPECT_FALSE(encloses(inverted));
  EXPECT_FALSE(encloses(joined(sphere_mesh(1, 8), moved(inverted, {2, 0, 0}))));
  // In the corner of the box around the other one, not inside of it.
  EXPECT_FALSE(encloses(joined(
      sphere_mesh(1, 8), moved(turned_inside_out(sphere_mesh(0.1, 8)), {0.85f, 0.85f, 0.85f}))));
}

TEST(Enclosure, AHollowBelongsToItsBody) {
  const Mesh hollow = turned_inside_out(sphere_mesh(0.2, 8));
  EXPECT_TRUE(encloses(joined(sphere_mesh(1, 8), hollow)));
  EXPECT_TRUE(encloses(joined(hollow, moved(sphere_mesh(1, 8), {0.5f, 0.5f, 0}))));
}

}  // namespace
}  // namespace selenite
