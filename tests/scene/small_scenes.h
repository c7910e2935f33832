// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "scene/scene_builder.h"

// Meshes, placements and materials from which the tests put their scenes together.
namespace selenite {

/// Mesh from polygons' triangles with the given normals per vertex, or flat ones if there are none.
inline Mesh make_mesh(std::vector<Vec3f> positions, std::vector<std::array<int, 3>> triangles,
                      const std::vector<Vec3f>& normals = {}) {
  Mesh mesh;
  mesh.name = "Mesh";
  for (const auto& t : triangles) {
    const Vec3f a = positions[t[0]], b = positions[t[1]], c = positions[t[2]];
    const Vec3d face = normalize(cross(Vec3d(b) - Vec3d(a), Vec3d(c) - Vec3d(a)));
    for (int corner : t)
      mesh.corner_normals.push_back(normals.empty() ? Vec3f(face) : normals[corner]);
  }
  mesh.material_slots.assign(triangles.size(), 0);
  mesh.positions = std::move(positions);
  mesh.triangles = std::move(triangles);
  return mesh;
}

/// Closed sphere, outside out. `smooth` gives the normals of the true sphere.
inline Mesh sphere_mesh(double radius, int rings = 16, bool smooth = true) {
  const int segments = 2 * rings;
  std::vector<Vec3f> positions, normals;
  std::vector<std::array<int, 3>> triangles;
  const auto add = [&](double theta, double phi) {
    const Vec3d n{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                  std::cos(theta)};
    normals.emplace_back(n);
    positions.emplace_back(n * radius);
  };
  add(0, 0);
  for (int i = 1; i < rings; ++i)
    for (int j = 0; j < segments; ++j) add(kPi<double> * i / rings, 2 * kPi<double> * j / segments);
  add(kPi<double>, 0);
  const auto vertex = [&](int i, int j) { return 1 + (i - 1) * segments + j % segments; };
  const int last = static_cast<int>(positions.size()) - 1;
  for (int j = 0; j < segments; ++j) {
    triangles.push_back({0, vertex(1, j), vertex(1, j + 1)});
    for (int i = 1; i + 1 < rings; ++i) {
      triangles.push_back({vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1)});
      triangles.push_back({vertex(i, j), vertex(i + 1, j + 1), vertex(i, j + 1)});
    }
    triangles.push_back({vertex(rings - 1, j), last, vertex(rings - 1, j + 1)});
  }
  return make_mesh(std::move(positions), std::move(triangles),
                   smooth ? normals : std::vector<Vec3f>{});
}

/// Closed box with flat faces, outside out.
inline Mesh box_mesh(double hx, double hy, double hz) {
  std::vector<Vec3f> p;
  for (int i = 0; i < 8; ++i)
    p.emplace_back(Vec3d{i & 1 ? hx : -hx, i & 2 ? hy : -hy, i & 4 ? hz : -hz});
  std::vector<std::array<int, 3>> t;
  const int faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                           {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& f : faces) {
    t.push_back({f[0], f[1], f[2]});
    t.push_back({f[0], f[2], f[3]});
  }
  return make_mesh(p, t);
}

/// Square in z = 0, facing +z, with UVs from (0, 0) to (1, 1).
inline Mesh quad_mesh(double half) {
  const auto h = static_cast<float>(half);
  Mesh mesh = make_mesh({{-h, -h, 0}, {h, -h, 0}, {h, h, 0}, {-h, h, 0}}, {{0, 1, 2}, {0, 2, 3}});
  mesh.uvs.push_back({"UVMap", {{0, 0}, {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}}});
  return mesh;
}

inline Transform matrix(const Vec3d& x, const Vec3d& y, const Vec3d& z, const Vec3d& at) {
  Transform t;
  const Vec3d columns[4] = {x, y, z, at};
  for (int j = 0; j < 4; ++j) {
    t.m[0][j] = columns[j].x;
    t.m[1][j] = columns[j].y;
    t.m[2][j] = columns[j].z;
  }
  return t;
}
inline Transform translation(const Vec3d& at) {
  return matrix({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, at);
}
/// Local -Z towards `target`, +Y as near to `up` as can be: how cameras and lamps are placed.
inline Transform looking_at(const Vec3d& from, const Vec3d& target, const Vec3d& up = {0, 0, 1}) {
  const Vec3d z = normalize(from - target);
  Vec3d x = cross(up, z);
  x = length(x) > 1e-6 ? normalize(x) : Vec3d{1, 0, 0};
  return matrix(x, cross(z, x), z, from);
}

/// Blender's default material.
inline Material plastic(const std::string& name) {
  Material m;
  m.name = name;
  return m;
}
/// Lambert's law and nothing else.
inline Material matte(const std::string& name, double grey) {
  Material m = plastic(name);
  m.values.base_color = Color<double>(grey);
  m.values.specular_level = 0;
  m.values.ior = 1;
  return m;
}
/// Smooth clear glass; roughness and colour are the caller's.
inline Material glass(const std::string& name, double ior = 1.5, double roughness = 0) {
  Material m = plastic(name);
  m.values.base_color = Color<double>(1);
  m.values.transmission = 1;
  m.values.ior = ior;
  m.values.roughness = roughness;
  return m;
}
/// Metal; reflects everything where `grey` is 1.
inline Material mirror(const std::string& name, double grey, double roughness) {
  Material m = plastic(name);
  m.values.base_color = Color<double>(grey);
  m.values.metallic = 1;
  m.values.roughness = roughness;
  return m;
}
inline Material emitter(const std::string& name, double radiance) {
  Material m = matte(name, 0);
  m.values.emission_strength = radiance;
  return m;
}

/// Adds a mesh of one material as one object; returns the object's number.
inline int place(SceneBuilder& builder, Mesh mesh, int material, const Transform& at = {}) {
  Instance instance;
  instance.name = "Object " + std::to_string(builder.instances.size());
  mesh.name = "Mesh " + std::to_string(builder.meshes.size());
  instance.mesh = builder.add_mesh(std::move(mesh));
  instance.materials = {material};
  instance.to_world = at;
  return builder.add_object(instance);
}

inline int add_view(SceneBuilder& builder, const Vec3d& from, const Vec3d& target,
                    double lens_mm = 50) {
  Camera camera;
  camera.name = "Camera " + std::to_string(builder.cameras.size());
  camera.lens_mm = lens_mm;
  camera.clip_start = 1e-3;
  camera.to_world = looking_at(from, target);
  return builder.add_camera(camera);
}

inline void set_sky(SceneBuilder& builder, double radiance) {
  builder.appearance.world.values.color = Color<double>(1);
  builder.appearance.world.values.strength = radiance;
}

}  // namespace selenite
