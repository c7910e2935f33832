// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "math/box.h"
#include "math/color.h"
#include "model/ray_kind.h"
#include "scene/camera.h"
#include "scene/light_link.h"
#include "scene/packet.h"
#include "scene/transform.h"

namespace selenite {

/// Values at the corners of triangles, three per triangle.
template <class T>
struct CornerData {
  std::string name;
  std::vector<T> values;
  /// Of a colour attribute: the values that it holds, one for each vertex or corner of the mesh, and
  /// the number of the one that each corner of a triangle shows. Empty: nothing tells.
  std::vector<T> held{};
  std::vector<int> elements{};
};

struct Mesh {
  std::string name;
  std::vector<Vec3f> positions;
  std::vector<std::array<int, 3>> triangles;  ///< geometric normal by the right-hand rule
  std::vector<Vec3f> corner_normals;          ///< three per triangle, unit
  std::vector<CornerData<Vec2f>> uvs;         ///< UV maps; the first is the active one
  std::vector<CornerData<Colorf>> colors;     ///< colour attributes, linear; likewise
  std::vector<CornerData<Vec3f>> vectors;     ///< made for shaders, which ask by name
  std::vector<int> material_slots;            ///< one per triangle
};

/// What a shader may ask about an object: Blender's Object Info.
struct ObjectFacts {
  Vec3f location;  ///< world, not relative to the geometry's origin
  Colorf color{1, 1, 1};
  float alpha = 1, index = 0, random = 0;
};

struct Instance {
  std::string name;
  int mesh = 0;
  Transform to_world;
  std::vector<int> materials;  ///< scene material of each slot
  RayKinds visible_to = kAllRays;
  bool holdout = false;             ///< black, and cut out of the picture, where the camera sees it
  int lit_set = 0, shadow_set = 0;  ///< the sets of LinkedSets that it belongs to
  LinkedSets links;                 ///< of the light that it emits
  ObjectFacts facts{};
};

struct Hit {
  int instance;
  int triangle;
  float b1, b2;  ///< barycentric coordinates of the second and third corner
  float t;
};

/// What a hit looks like in world space.
struct Surface {
  Vec3f position;  ///< from the barycentrics: exact to rounding of the corners, not of the ray
  Vec3f ng;        ///< geometric normal, unit, by the winding
  Vec3f n;         ///< interpolated shading normal, unit
  int material;
  float offset;  ///< bound of the position's error: rays start this far off along ng
  /// Origin of a ray that leaves towards `direction` without meeting this surface again.
  Vec3f leave(const Vec3f& direction) const {
    return position + ng * (dot(direction, ng) < 0 ? -offset : offset);
  }
};

class Accelerator;

/// Meshes, instances and their acceleration structure. Immutable once built; shared between scenes
/// that differ in appearance only.
///
/// A mesh used once is transformed to world space in double; a mesh used several times stays in its
/// own space and is instanced. All coordinates are relative to `origin`, the centre of the scene, so
/// that a scene far from the world's origin keeps its digits; or a place between the cameras, where
/// something far away would have moved the centre too far from what they see.
class Geometry {
 public:
  /// Drops triangles with non-finite corners or no area, counts them in `dropped`. `eyes`: where
  /// cameras stand.
  Geometry(std::vector<Mesh> meshes, std::vector<Instance> instances,
           const std::vector<Vec3d>& eyes = {});
  ~Geometry();
  Geometry(const Geometry&) = delete;
  Geometry& operator=(const Geometry&) = delete;

  /// The same with other vertices of one instance, relative to `origin`, and the corner normals that
  /// go with them. Which bodies are closed, and how far the scene reaches, stay as they are.
  /// InvalidArgument: the instance is not in world space, or there is another number of vertices.
  std::shared_ptr<const Geometry> with_vertices(int instance, std::vector<Vec3f> positions,
                                                std::vector<Vec3f> corner_normals) const;
  /// Whether the mesh of an instance is kept in world space: nothing else uses it.
  bool in_world_space(int instance) const { return in_world_space_[instance] != 0; }

  /// Of spheres around `origin`: one that holds everything, and one with what is next to cameras.
  struct Radii {
    float all = 0, near = 0;
  };

  std::optional<Hit> intersect(const Ray& ray, RayKind kind) const;
  /// The same for camera rays that run close together, kTogether at most.
  static constexpr int kTogether = 8;
  void intersect_camera_rays(std::span<const Ray> rays, std::optional<Hit>* hits) const;
  /// By what shadow rays see.
  bool occluded(const Ray& ray) const;
  /// The same of eight rays; only those with a bit in `lanes` count. Camera rays should run close
  /// together; other rays meet what any of them sees.
  void intersect(const RayPacket& rays, unsigned lanes, bool camera_rays, HitPacket& hits) const;
  unsigned occluded(const RayPacket& rays, unsigned lanes) const;
  /// The first hit with one instance, as if it were alone in the scene: for walks inside it. Needs a
  /// hierarchy of its own, which `prepare_inside` makes; that may be called from any thread.
  std::optional<Hit> intersect_inside(int instance, const Ray& ray) const;
  void prepare_inside(int instance) const;
  Surface surface(const Hit& hit) const;
  /// World space, relative to `origin`, to the object's own space.
  const Transform& to_object(int instance) const { return to_object_[instance]; }

  /// A triangle with all that a hit asks for side by side, in exactly two cache lines: three fewer.
  struct alignas(32) Face {
    std::array<Vec3f, 3> corners, normals;
    Vec3f ng;
    int slot;
    float coordinate;  ///< the largest, or that along `ng` where that is far smaller
  };
  /// Of an instance whose mesh is kept in world space; null for others, of which `surface` knows.
  const Face* face(int instance, int triangle) const {
    return in_world_space_[instance] ? &faces_[instances_[instance].mesh][triangle] : nullptr;
  }
  /// Rounding of a barycentric point, in units of its triangle's largest coordinate: 20 ulp.
  /// Source: docs/method/rendering.md, "Precision" (no leak, no self-hit from 1e-4 to 1e5 units).
  static constexpr float kPositionError = 20 * 0x1p-23f;
  /// Of a UV map or colour attribute by name (empty: the first); zero where the mesh has none, as in
  /// Cycles.
  Vec2f uv(const Hit& hit, const std::string& name) const;
  Colorf color(const Hit& hit, const std::string& name) const;
  /// Whether an instance has an inside; see `encloses`.
  bool closed(int instance) const { return closed_[instances_[instance].mesh]; }
  /// Of an instance, in world space.
  const Box& bounds(int instance) const { return bounds_[instance]; }
  /// World-space corners of a triangle.
  std::array<Vec3f, 3> corners(int instance, int triangle) const;

  const std::vector<Mesh>& meshes() const { return meshes_; }
  const std::vector<Instance>& instances() const { return instances_; }
  const Vec3d& origin() const { return origin_; }
  const Radii& radius() const { return radius_; }
  const std::vector<std::pair<std::string, long>>& dropped() const { return dropped_; }
  long triangle_count() const;

 private:
  struct Moved {
    int instance;
    std::vector<Vec3f> positions, corner_normals;
  };
  Geometry(const Geometry& other, Moved moved);
  /// Makes what follows from the meshes and instances as they are now.
  void build();

  std::vector<Mesh> meshes_;
  std::vector<std::vector<Face>> faces_;  ///< of the meshes
  std::vector<Instance> instances_;
  std::vector<char> in_world_space_;  ///< per instance
  std::vector<Box> bounds_;           ///< likewise, relative to the origin
  std::vector<Transform> to_object_;  ///< likewise
  std::vector<char> closed_;          ///< per mesh
  Vec3d origin_;
  Radii radius_;
  std::vector<std::pair<std::string, long>> dropped_;
  std::unique_ptr<Accelerator> accelerator_;
  mutable std::mutex preparing_;
};

}  // namespace selenite
