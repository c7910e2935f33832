// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/geometry.h"

#include <algorithm>
#include <limits>

#include "math/fault.h"
#include "scene/accelerator.h"
#include "scene/enclosure.h"

namespace selenite {
namespace {

bool finite(const Vec3f& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}
float largest(const Vec3f& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

template <class Action>
void for_each_corner_list(Mesh& mesh, Action&& action) {
  action(mesh.corner_normals);
  for (auto& map : mesh.uvs) action(map.values);
  for (auto& attribute : mesh.colors) {
    action(attribute.values);
    if (!attribute.elements.empty()) action(attribute.elements);
  }
  for (auto& attribute : mesh.vectors) action(attribute.values);
}

/// Keeps the triangles that have an area and finite corners; returns how many went.
long drop_degenerate(Mesh& mesh) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    const Vec3d a(mesh.positions[t[0]]), b(mesh.positions[t[1]]), c(mesh.positions[t[2]]);
    const double doubled_area = length(cross(b - a, c - a));
    if (!std::isfinite(doubled_area) || !(doubled_area > 0)) continue;
    if (kept != i) {
      mesh.triangles[kept] = mesh.triangles[i];
      mesh.material_slots[kept] = mesh.material_slots[i];
      for_each_corner_list(mesh, [&](auto& list) {
        for (std::size_t k = 0; k < 3; ++k) list[3 * kept + k] = list[3 * i + k];
      });
    }
    ++kept;
  }
  const long gone = static_cast<long>(mesh.triangles.size() - kept);
  mesh.triangles.resize(kept);
  mesh.material_slots.resize(kept);
  for_each_corner_list(mesh, [&](auto& list) { list.resize(3 * kept); });
  return gone;
}

/// Corner normals that are not usable (zero, not finite) take the face's.
void mend_normals(Mesh& mesh) {
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    const Vec3d a(mesh.positions[t[0]]), b(mesh.positions[t[1]]), c(mesh.positions[t[2]]);
    const Vec3f face(normalize(cross(b - a, c - a)));
    for (int k = 0; k < 3; ++k) {
      Vec3f& n = mesh.corner_normals[3 * i + k];
      const float size = length(n);
      n = std::isfinite(size) && size > 0.5f ? n / size : face;
    }
  }
}

/// Moves a mesh to the middle of its own space, where floats are finest; returns the way it went.
Vec3d center(Mesh& mesh) {
  Vec3f low(1e30f, 1e30f, 1e30f), high = -low;
  for (const auto& triangle : mesh.triangles)
    for (int corner : triangle) {
      const Vec3f& p = mesh.positions[corner];
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
  if (mesh.triangles.empty()) return {};
  const Vec3d middle = (Vec3d(low) + Vec3d(high)) * 0.5;
  for (Vec3f& p : mesh.positions) p = Vec3f(Vec3d(p) - middle);
  return middle;
}

void to_world_space(Mesh& mesh, const Transform& transform) {
  for (Vec3f& p : mesh.positions) p = Vec3f(transform.point(Vec3d(p)));
  const bool mirrored = transform.determinant() < 0;
  for (Vec3f& n : mesh.corner_normals) {
    const Vec3d world = transform.normal(Vec3d(n));
    n = Vec3f(normalize(mirrored ? -world : world));
  }
  if (!mirrored) return;
  // A mirrored object keeps its outside out: the winding turns with the determinant.
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    std::swap(mesh.triangles[i][1], mesh.triangles[i][2]);
    for_each_corner_list(mesh, [&](auto& list) { std::swap(list[3 * i + 1], list[3 * i + 2]); });
  }
}

/// Asks for what `surface` will read, while the path still looks for lamps on the way to the hit.
void prefetch([[maybe_unused]] const Geometry::Face& face) {
#if defined(__GNUC__)
  const char* first = reinterpret_cast<const char*>(&face);
  __builtin_prefetch(first);
  __builtin_prefetch(first + sizeof(Geometry::Face) - 1);
#endif
}

/// By how much the coordinate along the normal has to be smaller to count, and how small it may be: a
/// plane through the origin has one of 0, and a ray that leaves it must not meet it again.
constexpr float kFlat = 64, kFlattest = 4e6f;

std::vector<Geometry::Face> faces_of(const Mesh& mesh) {
  std::vector<Geometry::Face> faces;
  faces.reserve(mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    Geometry::Face& face = faces.emplace_back();
    for (int k = 0; k < 3; ++k) {
      face.corners[k] = mesh.positions[mesh.triangles[i][k]];
      face.normals[k] = mesh.corner_normals[3 * i + k];
      face.coordinate = std::max(face.coordinate, largest(face.corners[k]));
    }
    const auto& [a, b, c] = face.corners;
    face.ng = normalize(cross(b - a, c - a));
    // Of a floor without end only the height rounds its distance from what stands on it.
    float along = 0;
    for (const Vec3f& corner : face.corners)
      along = std::max(along, std::abs(corner.x * face.ng.x) + std::abs(corner.y * face.ng.y) +
                                  std::abs(corner.z * face.ng.z));
    if (along * kFlat < face.coordinate)
      face.coordinate = std::max(along, face.coordinate / kFlattest);
    face.slot = mesh.material_slots[i];
  }
  return faces;
}

/// Bounds of an instance in the world; empty (low > high) without a finite vertex.
struct WorldBox {
  Vec3d low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
  void include(const Vec3d& p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  bool empty() const { return low.x > high.x; }
  double radius() const { return length(high - low) / 2; }
  double distance(const Vec3d& p) const {
    const auto beside = [](double l, double h, double x) { return std::max({l - x, x - h, 0.0}); };
    return length(
        Vec3d{beside(low.x, high.x, p.x), beside(low.y, high.y, p.y), beside(low.z, high.z, p.z)});
  }
};

/// The centre of the scene serves cameras that are at most this many times as far from it as from
/// what they see: positions there are good to 1e-5 of their distance.
constexpr double kFarFromCentre = 64;
/// A camera inside of a box sees something at least this part of its radius away.
constexpr double kInside = 0.05;

/// Where a scene's coordinates begin, and how far it reaches from there.
struct Place {
  Vec3d origin;
  Geometry::Radii radius;
};

Place place_of(const std::vector<Mesh>& meshes, const std::vector<Instance>& instances,
               const std::vector<Vec3d>& eyes) {
  WorldBox all;
  std::vector<WorldBox> boxes;
  for (const Instance& instance : instances) {
    WorldBox box;
    for (const Vec3f& p : meshes[instance.mesh].positions)
      if (finite(p)) box.include(instance.to_world.point(Vec3d(p)));
    if (box.empty()) continue;
    all.include(box.low), all.include(box.high);
    boxes.push_back(box);
  }
  if (all.empty()) return {};
  const Vec3d middle = (all.low + all.high) * 0.5;
  const auto radius = static_cast<float>(all.radius());

  bool far = false;
  Vec3d sum;
  double weights = 0;
  std::vector<double> nearest;
  for (const Vec3d& eye : eyes) {
    double found = std::numeric_limits<double>::infinity();
    for (const WorldBox& box : boxes)
      found = std::min(found, std::max(box.distance(eye), kInside * box.radius()));
    const double weight = 1 / (found * found);
    sum += eye * weight, weights += weight;
    far = far || length(eye - middle) > kFarFromCentre * found;
    nearest.push_back(found);
  }
  if (!far || !std::isfinite(weights)) return {middle, {radius, radius}};
  const Vec3d origin = sum * (1 / weights);
  double near = 0;
  for (std::size_t i = 0; i < eyes.size(); ++i)
    near = std::max(near, length(eyes[i] - origin) + nearest[i]);
  const float farthest = radius + static_cast<float>(length(origin - middle));
  return {origin, {farthest, std::min(farthest, static_cast<float>(near))}};
}

}  // namespace

Geometry::Geometry(std::vector<Mesh> meshes, std::vector<Instance> instances,
                   const std::vector<Vec3d>& eyes)
    : meshes_(std::move(meshes)),
      instances_(std::move(instances)),
      in_world_space_(instances_.size(), 0),
      accelerator_(std::make_unique<Accelerator>()) {
  for (Mesh& mesh : meshes_) {
    if (const long gone = drop_degenerate(mesh)) dropped_.emplace_back(mesh.name, gone);
    mend_normals(mesh);
  }

  for (const Mesh& mesh : meshes_) closed_.push_back(encloses(mesh.positions, mesh.triangles));

  std::vector<int> uses(meshes_.size(), 0);
  for (const Instance& instance : instances_) ++uses[instance.mesh];
  const Place place = place_of(meshes_, instances_, eyes);
  origin_ = place.origin;
  radius_ = place.radius;

  std::vector<std::optional<Vec3d>> middles(meshes_.size());
  for (std::size_t i = 0; i < instances_.size(); ++i) {
    Instance& instance = instances_[i];
    instance.to_world.translate(-origin_);
    to_object_.push_back(instance.to_world.inverse());
    Mesh& mesh = meshes_[instance.mesh];
    if (uses[instance.mesh] == 1) {
      to_world_space(mesh, instance.to_world);
      in_world_space_[i] = 1;
      continue;
    }
    std::optional<Vec3d>& middle = middles[instance.mesh];
    if (!middle) middle = center(mesh);
    instance.to_world.translate(instance.to_world.vector(*middle));
  }
  build();
}

Geometry::Geometry(const Geometry& other, Moved moved)
    : meshes_(other.meshes_),
      instances_(other.instances_),
      in_world_space_(other.in_world_space_),
      to_object_(other.to_object_),
      closed_(other.closed_),
      origin_(other.origin_),
      radius_(other.radius_),
      dropped_(other.dropped_),
      accelerator_(std::make_unique<Accelerator>()) {
  Mesh& mesh = meshes_[instances_[moved.instance].mesh];
  mesh.positions = std::move(moved.positions);
  mesh.corner_normals = std::move(moved.corner_normals);
  build();
}

std::shared_ptr<const Geometry> Geometry::with_vertices(int instance, std::vector<Vec3f> positions,
                                                        std::vector<Vec3f> corner_normals) const {
  const Mesh& mesh = meshes_[instances_[instance].mesh];
  const std::string who = "Object '" + instances_[instance].name + "'";
  if (!in_world_space(instance))
    throw Refused(who, "several objects share mesh '" + mesh.name + "'",
                  "make it a single user to move its vertices");
  if (positions.size() != mesh.positions.size() ||
      corner_normals.size() != mesh.corner_normals.size())
    throw Refused(who,
                  std::to_string(positions.size()) + " positions for " +
                      std::to_string(mesh.positions.size()) + " vertices",
                  "give one for each of them");
  return std::shared_ptr<const Geometry>(
      new Geometry(*this, {instance, std::move(positions), std::move(corner_normals)}));
}

void Geometry::build() {
  std::vector<int> prototypes(meshes_.size(), -1);
  for (std::size_t i = 0; i < instances_.size(); ++i) {
    const Instance& instance = instances_[i];
    const Mesh& mesh = meshes_[instance.mesh];
    if (in_world_space_[i]) {
      accelerator_->add_mesh(mesh.positions, mesh.triangles, instance.visible_to);
      continue;
    }
    int& prototype = prototypes[instance.mesh];
    if (prototype < 0) prototype = accelerator_->add_prototype(mesh.positions, mesh.triangles);
    std::array<float, 12> matrix;
    for (int column = 0; column < 4; ++column)
      for (int row = 0; row < 3; ++row)
        matrix[3 * column + row] = static_cast<float>(instance.to_world.m[row][column]);
    accelerator_->add_instance(prototype, matrix, instance.visible_to);
  }
  accelerator_->build();
  for (const Mesh& mesh : meshes_) faces_.push_back(faces_of(mesh));
  bounds_.resize(instances_.size());
  for (int i = 0; i < static_cast<int>(instances_.size()); ++i) {
    const auto count = static_cast<int>(meshes_[instances_[i].mesh].triangles.size());
    for (int t = 0; t < count; ++t)
      for (const Vec3f& corner : corners(i, t)) bounds_[i].include(corner);
  }
}

Geometry::~Geometry() = default;

long Geometry::triangle_count() const {
  long count = 0;
  for (const Instance& instance : instances_)
    count += static_cast<long>(meshes_[instance.mesh].triangles.size());
  return count;
}

std::optional<Hit> Geometry::intersect(const Ray& ray, RayKind kind) const {
  const auto found = accelerator_->intersect(ray, kind);
  if (!found) return std::nullopt;
  prefetch(faces_[instances_[found->item].mesh][found->triangle]);
  return Hit{found->item, found->triangle, found->b1, found->b2, found->t};
}

void Geometry::intersect_camera_rays(std::span<const Ray> rays, std::optional<Hit>* found) const {
  RayPacket packet{};
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const auto& [origin, direction, t_min, t_max] = rays[i];
    packet.origin[0][i] = origin.x, packet.origin[1][i] = origin.y, packet.origin[2][i] = origin.z;
    packet.direction[0][i] = direction.x, packet.direction[1][i] = direction.y;
    packet.direction[2][i] = direction.z;
    packet.t_min[i] = t_min, packet.t_max[i] = t_max;
  }
  HitPacket hits;
  intersect(packet, (1u << rays.size()) - 1, true, hits);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    found[i].reset();
    if (hits.instance[i] >= 0)
      found[i] = Hit{hits.instance[i], hits.triangle[i], hits.b1[i], hits.b2[i], hits.t[i]};
  }
}

std::optional<Hit> Geometry::intersect_inside(int instance, const Ray& ray) const {
  const auto found = accelerator_->intersect_item(instance, ray);
  if (!found) return std::nullopt;
  return Hit{found->item, found->triangle, found->b1, found->b2, found->t};
}

void Geometry::prepare_inside(int instance) const {
  const std::lock_guard lock(preparing_);
  accelerator_->build_item(instance);
}

bool Geometry::occluded(const Ray& ray) const { return accelerator_->occluded(ray); }

void Geometry::intersect(const RayPacket& rays, unsigned lanes, bool camera_rays,
                         HitPacket& hits) const {
  static_assert(kPacket == kTogether);
  accelerator_->intersect(rays, lanes, camera_rays, hits);
  for (int i = 0; i < kPacket; ++i)
    if (hits.instance[i] >= 0)
      prefetch(faces_[instances_[hits.instance[i]].mesh][hits.triangle[i]]);
}

unsigned Geometry::occluded(const RayPacket& rays, unsigned lanes) const {
  return accelerator_->occluded(rays, lanes);
}

std::array<Vec3f, 3> Geometry::corners(int index, int triangle) const {
  const Instance& instance = instances_[index];
  std::array<Vec3f, 3> p = faces_[instance.mesh][triangle].corners;
  if (!in_world_space_[index])
    for (Vec3f& corner : p) corner = Vec3f(instance.to_world.point(Vec3d(corner)));
  return p;
}

namespace {

template <class T>
T at_hit(const std::vector<CornerData<T>>& lists, const std::string& name, const Hit& hit) {
  for (const CornerData<T>& list : lists) {
    if (!name.empty() && list.name != name) continue;
    const T* corner = &list.values[3 * static_cast<std::size_t>(hit.triangle)];
    return corner[0] * (1 - hit.b1 - hit.b2) + corner[1] * hit.b1 + corner[2] * hit.b2;
  }
  return {};
}

}  // namespace

Vec2f Geometry::uv(const Hit& hit, const std::string& name) const {
  return at_hit(meshes_[instances_[hit.instance].mesh].uvs, name, hit);
}
Colorf Geometry::color(const Hit& hit, const std::string& name) const {
  return at_hit(meshes_[instances_[hit.instance].mesh].colors, name, hit);
}

Surface Geometry::surface(const Hit& hit) const {
  const Instance& instance = instances_[hit.instance];
  const Face& face = faces_[instance.mesh][hit.triangle];
  const float b0 = 1 - hit.b1 - hit.b2;
  const auto at_hit = [&](const std::array<Vec3f, 3>& v) {
    return v[0] * b0 + v[1] * hit.b1 + v[2] * hit.b2;
  };
  Surface s;
  s.material = instance.materials[face.slot];
  Vec3f n = at_hit(face.normals);
  float coordinate = face.coordinate;
  if (in_world_space_[hit.instance]) {
    s.position = at_hit(face.corners);
    s.ng = face.ng;
  } else {
    const auto corners = this->corners(hit.instance, hit.triangle);
    const auto& [a, b, c] = corners;
    s.position = at_hit(corners);
    s.ng = normalize(cross(b - a, c - a));
    const bool mirrored = instance.to_world.determinant() < 0;
    const Vec3d world = instance.to_world.normal(Vec3d(n));
    n = Vec3f(mirrored ? -world : world);
    if (mirrored) s.ng = -s.ng;
    // The ray met it in the mesh's own space: rounding there counts as well as here.
    double scale = 0;
    for (int j = 0; j < 3; ++j) scale = std::max(scale, length(instance.to_world.column(j)));
    coordinate *= static_cast<float>(scale);
    for (const Vec3f& corner : corners) coordinate = std::max(coordinate, largest(corner));
  }
  const float size = length(n);
  s.n = size > 0 ? n / size : s.ng;  // opposite corner normals cancel: fall back on the face
  s.offset = kPositionError * coordinate;
  return s;
}

}  // namespace selenite
