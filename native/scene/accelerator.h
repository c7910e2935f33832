// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// The only file that knows Embree, version 3 or 4.
#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <array>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "math/error.h"
#include "math/processor.h"
#include "model/ray_kind.h"
#include "scene/camera.h"
#include "scene/packet.h"

namespace selenite {

/// Bounding volume hierarchy over triangle meshes and instances of them.
class Accelerator {
 public:
  struct Found {
    int item;  ///< index in the order of `add_*`
    int triangle;
    float b1, b2, t;
  };

  Accelerator() : device_(rtcNewDevice(avx2_is_forbidden() ? "isa=sse4.2" : nullptr)) {
    if (!device_) throw InvalidArgument("Embree: no device could be created");
    if (rtcGetDeviceProperty(device_, RTC_DEVICE_PROPERTY_VERSION) / 10000 != RTC_VERSION_MAJOR)
      throw InvalidArgument("Embree: the library in this process is of another version than " +
                            std::string(RTC_VERSION_STRING) + ", which this module was built for");
    packets_ = rtcGetDeviceProperty(device_, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) != 0;
    scene_ = new_scene();
  }
  ~Accelerator() {
    for (RTCScene child : children_) rtcReleaseScene(child);
    for (RTCScene alone : alone_)
      if (alone) rtcReleaseScene(alone);
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  Accelerator(const Accelerator&) = delete;
  Accelerator& operator=(const Accelerator&) = delete;

  /// Triangles in world space, seen by rays as one item.
  void add_mesh(std::span<const Vec3f> positions, std::span<const std::array<int, 3>> triangles,
                RayKinds visible_to) {
    RTCGeometry geometry = new_triangles(positions, triangles);
    attach(scene_, geometry, visible_to);
    ++count_;
  }
  /// Triangles in their own space, to be placed by `add_instance`.
  int add_prototype(std::span<const Vec3f> positions,
                    std::span<const std::array<int, 3>> triangles) {
    RTCScene child = new_scene();
    attach(child, new_triangles(positions, triangles), kAllRays);
    rtcCommitScene(child);
    children_.push_back(child);
    return static_cast<int>(children_.size()) - 1;
  }
  /// `matrix`: 3x4, column-major.
  void add_instance(int prototype, const std::array<float, 12>& matrix, RayKinds visible_to) {
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(geometry, children_[prototype]);
    rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, matrix.data());
    attach(scene_, geometry, visible_to);
    ++count_;
  }
  void build() {
    rtcCommitScene(scene_);
    alone_.resize(count_);
  }
  /// Lets `intersect_item` see one item; one call at a time, others may trace meanwhile.
  void build_item(int item) {
    if (alone_[item]) return;
    RTCScene scene = new_scene();
    rtcAttachGeometry(scene, rtcGetGeometry(scene_, static_cast<unsigned>(item)));
    rtcCommitScene(scene);
    alone_[item] = scene;
  }

  std::optional<Found> intersect(const Ray& ray, RayKind kind) const {
    return intersect(scene_, ray, kind);
  }
  /// Eight rays, of which those with a bit in `lanes` count. Camera rays that run close together share
  /// their way down the hierarchy, which takes a third of the time.
  void intersect(const RayPacket& rays, unsigned lanes, bool camera_rays, HitPacket& hits) const {
    if (!packets_) {
      for (int i = 0; i < kPacket; ++i) {
        hits.instance[i] = -1;
        if (!(lanes >> i & 1)) continue;
        if (const auto found = intersect(scene_, ray_of(rays, i), kinds_of(camera_rays)))
          hits.instance[i] = found->item, hits.triangle[i] = found->triangle,
          hits.b1[i] = found->b1, hits.b2[i] = found->b2, hits.t[i] = found->t;
      }
      return;
    }
    RTCRayHit8 query;
    alignas(32) std::array<int, kPacket> valid;
    set(query.ray, valid.data(), rays, lanes, kinds_of(camera_rays));
    for (int i = 0; i < kPacket; ++i)
      query.hit.geomID[i] = query.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
#if RTC_VERSION_MAJOR >= 4
    RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    if (camera_rays) arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
    rtcIntersect8(valid.data(), scene_, &query, &arguments);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    if (camera_rays) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    rtcIntersect8(valid.data(), scene_, &context, &query);
#endif
    for (int i = 0; i < kPacket; ++i) {
      hits.instance[i] = item_of(query.hit.geomID[i], query.hit.instID[0][i]);
      hits.triangle[i] = static_cast<int>(query.hit.primID[i]);
      hits.b1[i] = query.hit.u[i], hits.b2[i] = query.hit.v[i], hits.t[i] = query.ray.tfar[i];
    }
  }
  /// The lanes, among those asked for, whose rays meet something.
  unsigned occluded(const RayPacket& rays, unsigned lanes) const {
    unsigned found = 0;
    if (!packets_) {
      for (int i = 0; i < kPacket; ++i)
        if (lanes >> i & 1 && occluded(ray_of(rays, i))) found |= 1u << i;
      return found;
    }
    RTCRay8 query;
    alignas(32) std::array<int, kPacket> valid;
    set(query, valid.data(), rays, lanes, kShadowRay);
#if RTC_VERSION_MAJOR >= 4
    rtcOccluded8(valid.data(), scene_, &query);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded8(valid.data(), scene_, &context, &query);
#endif
    for (int i = 0; i < kPacket; ++i)
      if (query.tfar[i] < 0) found |= 1u << i;
    return found & lanes;
  }
  /// As `intersect`, as if there were no other item; needs `build_item`.
  std::optional<Found> intersect_item(int item, const Ray& ray) const {
    auto found = intersect(alone_[item], ray, kAllRays);
    if (found) found->item = item;
    return found;
  }
  bool occluded(const Ray& ray) const {
    RTCRay query;
    set(query, ray, kShadowRay);
#if RTC_VERSION_MAJOR >= 4
    rtcOccluded1(scene_, &query);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(scene_, &context, &query);
#endif
    return query.tfar < 0;
  }

 private:
  /// Packets of other rays are traced only where objects do not tell these apart.
  static RayKinds kinds_of(bool camera_rays) {
    return camera_rays ? RayKinds{kCameraRay} : kScatteredRays;
  }

  static std::optional<Found> intersect(RTCScene scene, const Ray& ray, RayKinds kinds) {
    RTCRayHit query;
    set(query.ray, ray, kinds);
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
#if RTC_VERSION_MAJOR >= 4
    rtcIntersect1(scene, &query);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene, &context, &query);
#endif
    const RTCHit& hit = query.hit;
    if (hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
    return Found{item_of(hit.geomID, hit.instID[0]), static_cast<int>(hit.primID), hit.u, hit.v,
                 query.ray.tfar};
  }
  /// -1 if there is no geometry.
  static int item_of(unsigned geometry, unsigned instance) {
    return static_cast<int>(instance != RTC_INVALID_GEOMETRY_ID ? instance : geometry);
  }

  static void set(RTCRay8& query, int* valid, const RayPacket& rays, unsigned lanes,
                  RayKinds kinds) {
    for (int i = 0; i < kPacket; ++i) {
      valid[i] = -static_cast<int>(lanes >> i & 1);
      query.org_x[i] = rays.origin[0][i], query.org_y[i] = rays.origin[1][i];
      query.org_z[i] = rays.origin[2][i], query.tnear[i] = rays.t_min[i];
      query.dir_x[i] = rays.direction[0][i], query.dir_y[i] = rays.direction[1][i];
      query.dir_z[i] = rays.direction[2][i], query.time[i] = 0;
      query.tfar[i] = rays.t_max[i];
      query.mask[i] = kinds;
      query.id[i] = query.flags[i] = 0;
    }
  }
  static Ray ray_of(const RayPacket& rays, int i) {
    return {{rays.origin[0][i], rays.origin[1][i], rays.origin[2][i]},
            {rays.direction[0][i], rays.direction[1][i], rays.direction[2][i]},
            rays.t_min[i],
            rays.t_max[i]};
  }

  RTCScene new_scene() {
    RTCScene scene = rtcNewScene(device_);
    // ROBUST: no ray slips between two triangles into a closed object.
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    return scene;
  }
  RTCGeometry new_triangles(std::span<const Vec3f> positions,
                            std::span<const std::array<int, 3>> triangles) {
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                3 * sizeof(float), positions.size()));
    for (const Vec3f& p : positions) {
      *vertices++ = p.x;
      *vertices++ = p.y;
      *vertices++ = p.z;
    }
    auto* indices = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof(unsigned), triangles.size()));
    for (const auto& triangle : triangles)
      for (int corner : triangle) *indices++ = static_cast<unsigned>(corner);
    return geometry;
  }
  static void attach(RTCScene scene, RTCGeometry geometry, RayKinds visible_to) {
    rtcSetGeometryMask(geometry, visible_to);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
  }
  /// By sixteen bytes, as Embree reads them: numbers stored one by one would keep it waiting.
  static void set(RTCRay& query, const Ray& ray, RayKinds kinds) {
    store(&query.org_x, ray.origin.x, ray.origin.y, ray.origin.z, ray.t_min);
    store(&query.dir_x, ray.direction.x, ray.direction.y, ray.direction.z, 0);
    query.tfar = ray.t_max;
    query.mask = kinds;
    query.id = query.flags = 0;
  }
  static void store(float* to, float a, float b, float c, float d) {
#if defined(__GNUC__)
    using Four = float __attribute__((vector_size(16), may_alias));
    *reinterpret_cast<Four*>(to) = Four{a, b, c, d};
#else
    to[0] = a, to[1] = b, to[2] = c, to[3] = d;
#endif
  }

  RTCDevice device_;
  bool packets_ = false;  // an Embree built without them refuses rtcIntersect8
  RTCScene scene_;
  std::vector<RTCScene> children_, alone_;
  std::size_t count_ = 0;
};

}  // namespace selenite
