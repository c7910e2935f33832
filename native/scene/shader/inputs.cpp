// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/shader/inputs.h"

#include <cmath>

namespace selenite {

CameraPlace CameraPlace::of(const Camera& camera) {
  const Transform& m = camera.to_world;
  return {Vec3f(m.column(0)), Vec3f(m.column(1)), Vec3f(-m.column(2)), Vec3f(m.translation())};
}

namespace shading {
namespace {

Colorf color_of(const Vec3f& v) { return {v.x, v.y, v.z}; }

Vec3f unit(const Vec3d& v) {
  const double size = length(v);
  return size > 0 ? Vec3f(v / size) : Vec3f{};
}

/// Transpose of a linear map times a vector.
Vec3d transposed(const Transform& m, const Vec3d& v) {
  return {dot(m.column(0), v), dot(m.column(1), v), dot(m.column(2), v)};
}

Vec3f in_camera(const CameraPlace& camera, const Vec3f& d) {
  return {dot(d, camera.right), dot(d, camera.up), dot(d, camera.forward)};
}

const CameraPlace& camera_of(const ShadingPoint& point) {
  static const CameraPlace kNone;
  return point.camera ? *point.camera : kNone;
}

}  // namespace

Footprint Footprint::of(const ShadingPoint& point) {
  // The frame that Cycles makes of a normal, so that slopes are taken along the same directions.
  const Vec3f n = point.true_normal();
  const bool even = n.x == n.y && n.x == n.z;
  const Vec3f across =
      even ? Vec3f{n.z - n.y, n.x + n.z, -n.y - n.x} : Vec3f{n.z - n.y, n.x - n.z, n.y - n.x};
  const Vec3f x = normalize(across);
  return {x * point.footprint, cross(n, x) * point.footprint};
}

InputPoint::InputPoint(const ShadingPoint& point, int shift, float width)
    : point_(point), hit_(point.hit), position_(point.surface.position), shift_(shift) {
  if (shift == 0 || point.footprint == 0) return;
  const Footprint footprint = Footprint::of(point);
  const Vec3f way = (shift == 1 ? footprint.x : footprint.y) * width;
  position_ += way;
  const auto [a, b, c] = point.geometry->corners(hit_.instance, hit_.triangle);
  const Vec3f e1 = b - a, e2 = c - a, n = cross(e1, e2);
  const float square = dot(n, n);
  if (!(square > 0)) return;
  hit_.b1 += dot(cross(way, e2), n) / square;
  hit_.b2 += dot(cross(e1, way), n) / square;
}

Vec3f InputPoint::position() const { return Vec3f(Vec3d(position_) + point_.geometry->origin()); }

Vec3f InputPoint::object_position() const {
  return Vec3f(point_.geometry->to_object(hit_.instance).point(Vec3d(position_)));
}

Colorf InputPoint::geometry(GeometryMode mode) const {
  switch (mode) {
    case GeometryMode::kPosition:
      return color_of(position());
    case GeometryMode::kNormal:
      return color_of(point_.normal());
    case GeometryMode::kTrueNormal:
      return color_of(point_.true_normal());
    case GeometryMode::kIncoming:
      return color_of(point_.wi);
    case GeometryMode::kParametric:
      return {1 - hit_.b1 - hit_.b2, hit_.b1, 0};
    case GeometryMode::kBackfacing:
      return Colorf(point_.backfacing() ? 1.0f : 0.0f);
    case GeometryMode::kObjectPosition:
      return color_of(object_position());
    case GeometryMode::kObjectNormal: {
      Vec3f n = point_.normal();
      if (shift_ != 0) {
        Surface moved = point_.geometry->surface(hit_);
        n = point_.backfacing() ? -moved.n : moved.n;
      }
      return color_of(normal_to_object(point_, n));
    }
    case GeometryMode::kReflection: {
      const Vec3f n = point_.normal();
      return color_of(n * (2 * dot(n, point_.wi)) - point_.wi);
    }
  }
  return {};
}

Vec3f corner_vector(const Geometry& geometry, const Hit& hit, const std::string& name) {
  for (const CornerData<Vec3f>& list :
       geometry.meshes()[geometry.instances()[hit.instance].mesh].vectors) {
    if (list.name != name) continue;
    const Vec3f* corner = &list.values[3 * static_cast<std::size_t>(hit.triangle)];
    return corner[0] * (1 - hit.b1 - hit.b2) + corner[1] * hit.b1 + corner[2] * hit.b2;
  }
  return Vec3f(geometry.to_object(hit.instance).point(Vec3d(geometry.surface(hit).position)));
}

Colorf InputPoint::attribute(AttributeMode mode, const std::string& name) const {
  switch (mode) {
    case AttributeMode::kUv: {
      const Vec2f uv = point_.geometry->uv(hit_, name);
      return {uv.x, uv.y, 0};
    }
    case AttributeMode::kColor:
      return point_.mesh_colors ? color_at(*point_.geometry, *point_.mesh_colors, hit_, name)
                                : point_.geometry->color(hit_, name);
    case AttributeMode::kVector:
      return color_of(corner_vector(*point_.geometry, hit_, name));
  }
  return {};
}

Colorf InputPoint::camera(CameraMode mode) const {
  const CameraPlace& camera = camera_of(point_);
  const Vec3f d = in_camera(camera, position_ - camera.position);
  const float distance = length(d);
  switch (mode) {
    case CameraMode::kViewVector:
      return distance > 0 ? color_of(d / distance) : Colorf{};
    case CameraMode::kDepth:
      return Colorf(d.z);
    case CameraMode::kDistance:
      return Colorf(distance);
    case CameraMode::kPosition:
      return color_of(d);
  }
  return {};
}

Colorf object_fact(const ShadingPoint& point, ObjectMode mode) {
  const ObjectFacts& facts = point.geometry->instances()[point.hit.instance].facts;
  switch (mode) {
    case ObjectMode::kLocation:
      return color_of(facts.location);
    case ObjectMode::kColor:
      return facts.color;
    case ObjectMode::kAlpha:
      return Colorf(facts.alpha);
    case ObjectMode::kIndex:
      return Colorf(facts.index);
    case ObjectMode::kRandom:
      return Colorf(facts.random);
  }
  return {};
}

float path_fact(const PathFacts& path, PathMode mode) {
  const auto is = [&](RayKinds kinds) { return (path.kinds & kinds) != 0 ? 1.0f : 0.0f; };
  const bool reflected = (path.kinds & (kDiffuseRay | kGlossyRay)) != 0;
  switch (mode) {
    case PathMode::kCameraRay:
      return is(kCameraRay);
    case PathMode::kShadowRay:
      return is(kShadowRay);
    case PathMode::kDiffuseRay:
      return is(kDiffuseRay);
    case PathMode::kGlossyRay:  // rough glass is glossy too
      return path.singular || (path.kinds & (kGlossyRay | kTransmissionRay)) != 0 ? 1.0f : 0.0f;
    case PathMode::kSingularRay:
      return path.singular ? 1.0f : 0.0f;
    case PathMode::kReflectionRay:
      return reflected ? 1.0f : 0.0f;
    case PathMode::kTransmissionRay:
      return is(kTransmissionRay);
    case PathMode::kVolumeRay:
      return is(kScatterRay);
    case PathMode::kRayLength:
      return path.length;
    case PathMode::kRayDepth:
      return static_cast<float>(path.depth);
    case PathMode::kDiffuseDepth:
      return static_cast<float>(path.diffuse_depth);
    case PathMode::kGlossyDepth:
      return static_cast<float>(path.glossy_depth);
    case PathMode::kTransparentDepth:
      return static_cast<float>(path.transparent_depth);
    case PathMode::kTransmissionDepth:
      return static_cast<float>(path.transmission_depth);
  }
  return 0;
}

Vec3d transformed(const ShadingPoint& point, TransformMode mode, int item, const Vec3d& v) {
  const auto from = static_cast<Space>(item / 3), to = static_cast<Space>(item % 3);
  const Transform& to_object = point.geometry->to_object(point.hit.instance);
  const Vec3d& origin = point.geometry->origin();
  const CameraPlace& camera = camera_of(point);
  const bool is_point = mode == TransformMode::kPoint, is_normal = mode == TransformMode::kNormal;
  // Through the world, relative to its origin where it is a point.
  Vec3d world = v;
  if (from == Space::kWorld && is_point) world = v - origin;
  if (from == Space::kObject) {
    const Transform to_world = to_object.inverse();
    world =
        is_normal ? transposed(to_object, v) : (is_point ? to_world.point(v) : to_world.vector(v));
  }
  if (from == Space::kCamera)
    world = Vec3d(camera.right) * v.x + Vec3d(camera.up) * v.y + Vec3d(camera.forward) * v.z +
            (is_point ? Vec3d(camera.position) : Vec3d{});
  if (to == Space::kWorld) return is_point ? world + origin : world;
  if (to == Space::kObject)
    return is_normal ? transposed(to_object.inverse(), world)
                     : (is_point ? to_object.point(world) : to_object.vector(world));
  const Vec3d d = is_point ? world - Vec3d(camera.position) : world;
  return {dot(d, Vec3d(camera.right)), dot(d, Vec3d(camera.up)), dot(d, Vec3d(camera.forward))};
}

Vec3f normal_to_world(const ShadingPoint& point, const Vec3f& n) {
  return unit(transposed(point.geometry->to_object(point.hit.instance), Vec3d(n)));
}
Vec3f normal_to_object(const ShadingPoint& point, const Vec3f& n) {
  return unit(transposed(point.geometry->to_object(point.hit.instance).inverse(), Vec3d(n)));
}

}  // namespace shading
}  // namespace selenite
