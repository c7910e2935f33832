// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/geometry.h"

#include <gtest/gtest.h>

#include <limits>

#include "math/error.h"
#include "math/rng.h"
#include "math/sampling.h"
#include "scene/small_scenes.h"

namespace selenite {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();

Vec3f uniform_direction(float u, float v) { return normalize(square_to_cone(u, v, 2.0f)); }

/// Geometry of meshes placed once or several times; materials are not looked at.
std::unique_ptr<Geometry> geometry_of(const Mesh& mesh, const std::vector<Transform>& places,
                                      bool visible = true) {
  std::vector<Instance> instances;
  for (const Transform& t : places) {
    Instance instance;
    instance.name = "Object";
    instance.to_world = t;
    instance.materials = {0, 1};
    instance.visible_to = visible ? kAllRays : kAllRays & ~kCameraRay;
    instances.push_back(instance);
  }
  return std::make_unique<Geometry>(std::vector<Mesh>{mesh}, instances);
}

Transform rotated(const Vec3d& size, const Vec3d& at) {
  const Transform r = looking_at({0, 0, 0}, {1, 2, -0.5});
  return matrix(r.column(0) * size.x, r.column(1) * size.y, r.column(2) * size.z, at);
}

struct Placement {
  const char* name;
  Vec3d size;
  bool stretched = false;
};
void PrintTo(const Placement& p, std::ostream* out) { *out << p.name; }
class Placed : public testing::TestWithParam<Placement> {};

TEST_P(Placed, OnceOrTwiceIsHitAlike) {
  // Alone the mesh is baked into world space; with a twin far away it is instanced.
  const Transform at = rotated(GetParam().size, {0.3, -0.2, 0.4});
  Transform twin = at;
  twin.translate({50, 0, 0});
  Mesh mesh = sphere_mesh(1, 12);
  mesh.uvs.push_back({"UVMap", {}});
  for (std::size_t i = 0; i < mesh.corner_normals.size(); ++i)
    mesh.uvs[0].values.push_back({mesh.corner_normals[i].x, mesh.corner_normals[i].z});
  for (std::size_t i = 0; i < mesh.material_slots.size(); ++i)
    mesh.material_slots[i] = static_cast<int>(i % 2);
  const auto baked = geometry_of(mesh, {at}), instanced = geometry_of(mesh, {at, twin});
  Random random(3, 0, 0);
  int hits = 0;
  for (std::uint32_t i = 0; i < 4000; ++i) {
    random.start_bounce(i);
    const Vec3d from = Vec3d(uniform_direction(random.uniform(0), random.uniform(1))) * 6.0;
    const Vec3d to = Vec3d(uniform_direction(random.uniform(2), random.uniform(3))) * 0.8;
    const Vec3f direction(normalize(to - from));
    const Vec3d centre{0.3, -0.2, 0.4};
    const Ray a{Vec3f(from + centre - baked->origin()), direction, 0, kFar};
    const Ray b{Vec3f(from + centre - instanced->origin()), direction, 0, kFar};
    const auto ha = baked->intersect(a, kDiffuseRay), hb = instanced->intersect(b, kDiffuseRay);
    ASSERT_EQ(ha.has_value(), hb.has_value());
    EXPECT_EQ(baked->occluded(a), ha.has_value());
    if (!ha || ha->triangle != hb->triangle) continue;  // rays through an edge
    ++hits;
    const Surface sa = baked->surface(*ha), sb = instanced->surface(*hb);
    EXPECT_NEAR(ha->t, hb->t, 1e-4);
    const Vec3d gap =
        Vec3d(sa.position) + baked->origin() - Vec3d(sb.position) - instanced->origin();
    EXPECT_LT(length(gap), 1e-4);
    EXPECT_LT(length(sa.ng - sb.ng), 1e-4);
    // Interpolated before or after the stretch: equal at the corners, 2 degrees apart between.
    EXPECT_LT(length(sa.n - sb.n), GetParam().stretched ? 0.04 : 1e-4);
    EXPECT_EQ(sa.material, sb.material);
    EXPECT_EQ(sa.material, mesh.material_slots[ha->triangle]);
    EXPECT_NEAR(baked->uv(*ha, "").x, instanced->uv(*hb, "UVMap").x, 1e-3);
    // Seen from outside: the outside of a mirrored object stays out, whichever way it is stored.
    EXPECT_LT(dot(sa.ng, direction), 0);
    EXPECT_GT(dot(sa.n, sa.ng), 0.9);
    // The true normal of a stretched sphere; the mesh is coarse.
    const Vec3d offset = Vec3d(sa.position) + baked->origin() - centre;
    Vec3d normal;  // of the ellipsoid sum (offset . axis_j)^2 / |axis_j|^4 = 1
    for (int j = 0; j < 3; ++j) {
      const Vec3d axis = at.column(j);
      normal += axis * (dot(offset, axis) / square(dot(axis, axis)));
    }
    EXPECT_GT(dot(normalize(normal), Vec3d(sa.n)), 0.995);
  }
  EXPECT_GT(hits, 1000);
}
INSTANTIATE_TEST_SUITE_P(Transforms, Placed,
                         testing::Values(Placement{"as it is", {1, 1, 1}},
                                         Placement{"stretched", {2, 0.7, 1.2}, true},
                                         Placement{"mirrored", {-1, 1, 1}},
                                         Placement{"mirrored and stretched", {1.5, 1, -0.6}, true},
                                         Placement{"turned by three mirrors", {-1, -1, -1}}));

TEST(Geometry, FlatUvsAndBarycentricsAreThoseOfTheCorners) {
  const auto geometry = geometry_of(quad_mesh(1), {translation({5, 6, 7})});
  for (const float x : {-0.75f, 0.1f, 0.6f})
    for (const float y : {-0.5f, 0.3f, 0.9f}) {
      const auto hit = geometry->intersect({{x, y, 2}, {0, 0, -1}, 0, kFar}, kCameraRay);
      ASSERT_TRUE(hit);
      EXPECT_FLOAT_EQ(hit->t, 2);
      const Surface s = geometry->surface(*hit);
      EXPECT_LT(length(s.position - Vec3f{x, y, 0}), 1e-6);
      EXPECT_NEAR(geometry->uv(*hit, "").x, (x + 1) / 2, 1e-6);
      EXPECT_NEAR(geometry->uv(*hit, "").y, (y + 1) / 2, 1e-6);
    }
  EXPECT_EQ(geometry->origin().x, 5);
  EXPECT_FALSE(geometry->intersect({{0, 0, 2}, {0, 0, -1}, 0, 1.5f}, kCameraRay));  // ends before
  EXPECT_FALSE(
      geometry->intersect({{0, 0, 2}, {0, 0, -1}, 2.5f, kFar}, kCameraRay));  // starts behind
}

TEST(Geometry, ObjectsHiddenFromTheCameraAreSeenByOtherRays) {
  for (const int copies : {1, 2}) {
    std::vector<Transform> places(copies, Transform{});
    if (copies > 1) places[1].translate({0, 0, -100});
    const auto geometry = geometry_of(quad_mesh(1), places, false);
    const Vec3f above = Vec3f(Vec3d{0.2, 0.1, 1} - geometry->origin());
    EXPECT_FALSE(geometry->intersect({above, {0, 0, -1}, 0, kFar}, kCameraRay));
    EXPECT_TRUE(geometry->intersect({above, {0, 0, -1}, 0, kFar}, kDiffuseRay));
    EXPECT_TRUE(geometry->occluded({above, {0, 0, -1}, 0, kFar}));
  }
}

TEST(Geometry, DropsTrianglesWithoutAreaOrWithBadCornersAndCountsThem) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInf = std::numeric_limits<float>::infinity();
  Mesh mesh = make_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {kNan, 0, 0}, {2, 0, 0}, {0, kInf, 0}},
                        {{0, 1, 4}, {0, 1, 2}, {0, 1, 1}, {0, 3, 2}, {0, 1, 5}});
  mesh.name = "Broken";
  mesh.material_slots = {0, 1, 0, 0, 0};
  const auto geometry = geometry_of(mesh, {Transform{}});
  ASSERT_EQ(geometry->dropped().size(), 1u);
  EXPECT_EQ(geometry->dropped()[0].first, "Broken");
  EXPECT_EQ(geometry->dropped()[0].second, 4);
  EXPECT_EQ(geometry->triangle_count(), 1);
  EXPECT_TRUE(std::isfinite(geometry->radius().all));
  const Vec3f at = Vec3f(Vec3d{0.25, 0.25, 1} - geometry->origin());
  const auto hit = geometry->intersect({at, {0, 0, -1}, 0, kFar}, kCameraRay);
  ASSERT_TRUE(hit);
  EXPECT_EQ(geometry->surface(*hit).material, 1);  // slots moved up with the triangles
}

/// The origin where a ball stands at `place`, seen from 6 units away, and something else far off.
Vec3d origin_beside(const Vec3d& place, const Vec3d& far, const std::vector<Vec3d>& eyes) {
  std::vector<Instance> instances(2);
  instances[0].to_world.translate(place);
  instances[1].to_world.translate(far);
  for (Instance& instance : instances) instance.materials = {0};
  return Geometry({sphere_mesh(1, 8)}, instances, eyes).origin();
}

TEST(Geometry, TheOriginFollowsWhatCamerasSee) {
  const Vec3d eye{0, -6, 1}, other{6, 0, 1}, astray{3e5, 1e6, 0};
  // Without anything far away it is the centre, wherever cameras are.
  EXPECT_LT(length(origin_beside({0, 0, 0}, {20, 0, 0}, {eye}) - Vec3d{10, 0, 0}), 1e-9);
  for (const double distance : {1e4, 1e6, 1e9, 1e18}) {
    const Vec3d far{distance, distance, distance / 2};
    EXPECT_LT(length(origin_beside({0, 0, 0}, far, {eye, other})), 7) << distance;
    EXPECT_LT(length(origin_beside({3e3, 1e4, 0}, far, {Vec3d{3e3, 1e4 - 6, 0}}) -
                     Vec3d{3e3, 1e4 - 6, 0}),
              1e-6)
        << distance;
  }
  // A camera that sees nothing near counts for little.
  EXPECT_LT(length(origin_beside({0, 0, 0}, {1e4, 0, 0}, {eye, astray})), 7);
}

TEST(Geometry, AFloorWithoutEndLetsRaysStartCloseToIt) {
  const auto geometry = geometry_of(quad_mesh(5e5), {Transform{}});
  const auto hit = geometry->intersect({{1, 2, 1}, {0, 0, -1}, 0, kFar}, kCameraRay);
  ASSERT_TRUE(hit);
  EXPECT_LT(geometry->surface(*hit).offset, 1e-6);
}

TEST(Geometry, UnusableNormalsBecomeTheFaces) {
  Mesh mesh = quad_mesh(1);
  mesh.corner_normals.assign(6, Vec3f{});
  mesh.corner_normals[1] = {std::numeric_limits<float>::quiet_NaN(), 0, 1};
  const auto geometry = geometry_of(mesh, {Transform{}});
  for (const float x : {-0.5f, 0.5f}) {
    const auto hit = geometry->intersect({{x, 0.1f, 1}, {0, 0, -1}, 0, kFar}, kCameraRay);
    ASSERT_TRUE(hit);
    EXPECT_LT(length(geometry->surface(*hit).n - Vec3f{0, 0, 1}), 1e-6);
  }
}

TEST(Geometry, EmptyScenesHaveNothingToHit) {
  const Geometry geometry({}, {});
  EXPECT_FALSE(geometry.intersect({{0, 0, 0}, {0, 0, 1}, 0, kFar}, kCameraRay));
  EXPECT_EQ(geometry.radius().all, 0);
}

/// How a closed object is stored and where.
struct Closed {
  double scale, shift;
  int copies;
  double pivot;       ///< distance of the mesh from its own origin, in units of its size
  double apart = 10;  ///< distance of the copies, likewise
};
void PrintTo(const Closed& c, std::ostream* out) {
  *out << "scale " << c.scale << " shift " << c.shift << " copies " << c.copies << " pivot "
       << c.pivot;
}
class Watertight : public testing::TestWithParam<Closed> {};

/// A bumpy closed mesh: creases, slivers and concave parts.
Mesh bumpy(double scale, double pivot) {
  Mesh mesh = sphere_mesh(1, 48);
  std::vector<Vec3f> positions;
  for (const Vec3f& p : mesh.positions) {
    const double r = 1 + 0.3 * std::sin(7 * p.x + 2) * std::sin(6 * p.y) * std::cos(5 * p.z);
    positions.emplace_back(
        Vec3d{p.x * r * scale + pivot * scale, p.y * r * scale, p.z * r * scale});
  }
  return make_mesh(positions, mesh.triangles);
}

TEST_P(Watertight, RaysNeitherMeetTheirOwnSurfaceNorLeaveAClosedObject) {
  const Closed& c = GetParam();
  const Vec3d centre{c.shift - c.pivot * c.scale, -c.shift, c.shift / 3};
  std::vector<Transform> places(c.copies, translation(centre));
  if (c.copies > 1) places[1].translate({c.apart * c.scale, 0, 0});
  const auto geometry = geometry_of(bumpy(c.scale, c.pivot), places);
  const Vec3d middle = Vec3d{c.shift, -c.shift, c.shift / 3} - geometry->origin();
  Random random(17, 0, 0);
  long rays = 0, again = 0, leaks = 0;
  for (std::uint32_t i = 0; i < 60000; ++i) {
    random.start_bounce(i);
    const Vec3f direction = uniform_direction(random.uniform(0), random.uniform(1));
    const auto hit = geometry->intersect({Vec3f(middle), direction, 0, kFar}, kDiffuseRay);
    ASSERT_TRUE(hit);  // from the middle of a closed object
    const Surface s = geometry->surface(*hit);
    for (std::uint32_t k = 0; k < 4; ++k) {
      const Vec3f wo = uniform_direction(random.uniform(2 + 2 * k), random.uniform(3 + 2 * k));
      // Directions within rounding of the surface's plane are on neither side.
      if (std::abs(dot(wo, s.ng)) < 1e-3f) continue;
      const auto next = geometry->intersect({s.leave(wo), wo, 0, kFar}, kDiffuseRay);
      ++rays;
      if (next && next->instance == hit->instance && next->triangle == hit->triangle) ++again;
      if (dot(wo, s.ng) < 0 && !next) ++leaks;
    }
  }
  EXPECT_GT(rays, 200000);
  EXPECT_EQ(again, 0);
  EXPECT_EQ(leaks, 0);
}
INSTANTIATE_TEST_SUITE_P(Sizes, Watertight,
                         testing::Values(Closed{1, 0, 1, 0}, Closed{1e-4, 0, 1, 0},
                                         Closed{1e5, 0, 1, 0}, Closed{1, 1e4, 1, 0},
                                         Closed{1e-2, 1e2, 1, 0}, Closed{1, 0, 2, 0},
                                         Closed{1e-4, 0, 2, 0}, Closed{1e5, 0, 2, 0},
                                         Closed{1, 1e4, 2, 0}, Closed{1, 0, 1, 1e3},
                                         Closed{1, 0, 2, 1e3}, Closed{1, 0, 2, 0, 1e3}));

TEST(SceneBuilder, RefusesPartsThatDoNotFitNamingThem) {
  SceneBuilder builder;
  const int material = builder.add_material(plastic("Clay"));
  EXPECT_THROW(builder.add_material(plastic("Clay")), InvalidArgument);
  Mesh mesh = quad_mesh(1);
  mesh.triangles[0][2] = 9;
  EXPECT_THROW(builder.add_mesh(mesh), InvalidArgument);
  mesh = quad_mesh(1);
  mesh.corner_normals.pop_back();
  EXPECT_THROW(builder.add_mesh(mesh), InvalidArgument);
  mesh = quad_mesh(1);
  mesh.material_slots.clear();
  EXPECT_THROW(builder.add_mesh(mesh), InvalidArgument);
  Instance instance;
  instance.name = "Box";
  instance.mesh = builder.add_mesh(quad_mesh(1));
  EXPECT_THROW(builder.add_object(instance), InvalidArgument);  // no material for slot 0
  instance.materials = {material + 5};
  EXPECT_THROW(builder.add_object(instance), InvalidArgument);
  instance.materials = {material};
  instance.to_world = matrix({1, 0, 0}, {1, 0, 0}, {0, 0, 1}, {0, 0, 0});
  try {
    builder.add_object(instance);
    FAIL() << "a flat object was accepted";
  } catch (const InvalidArgument& error) {
    EXPECT_NE(std::string(error.what()).find("'Box'"), std::string::npos);
  }
  instance.to_world = translation({0, std::numeric_limits<double>::quiet_NaN(), 0});
  EXPECT_THROW(builder.add_object(instance), InvalidArgument);
  Material bad = plastic("Bad");
  bad.values.roughness = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(builder.add_material(bad), InvalidArgument);
}

}  // namespace
}  // namespace selenite
