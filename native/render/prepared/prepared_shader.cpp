// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/prepared/prepared_shader.h"

#include <algorithm>
#include <cmath>

namespace selenite {
namespace {

/// Puts registers into the sockets of a closure; a number is the first channel of its own.
template <class T>
struct Read {
  const Registers<T>& registers;
  const std::vector<int>& inputs;
  std::size_t at = 0;
  void operator()(const Parameter&, T& x) { x = registers[inputs[at++]].r; }
  void operator()(const Parameter&, Color<T>& c) { c = registers[inputs[at++]]; }
};

/// The number of a socket among the inputs of a closure; -1: it has no such socket.
int input_named(ClosureKind kind, std::string_view name) {
  auto closure = default_closure<double>(kind);
  int found = -1, at = 0;
  closure_fields(closure, [&](const Parameter& p, auto&) {
    if (p.name == name) found = at;
    ++at;
  });
  return found;
}

template <class T>
T weight_of(const ShaderClosure& closure, const Registers<T>& registers) {
  return closure.weight < 0 ? T(1) : registers[closure.weight].r;
}

template <class T>
bool is_nothing(const T& weight) {
  return value_of(weight) == 0 && !has_slope(weight);
}

}  // namespace

template <class T>
PreparedShader<T>::PreparedShader(const Material& material, const std::vector<Color<T>>& constants,
                                  std::vector<ImageSlots> images)
    : program_(*material.shader),
      fixed_(static_cast<std::size_t>(material.shader->fixed)),
      images_(std::move(images)) {
  prepare<T>(program_, constants, fixed_);
  for (const ShaderClosure& closure : program_.closures)
    if (has_share(closure)) judge(closure);
}

template <class T>
bool PreparedShader<T>::acts(int index) const {
  if (program_.varies(index)) return true;
  const Color<T>& c = fixed_[static_cast<std::size_t>(index)];
  const auto v = value_of(c);
  return v.r != 0 || v.g != 0 || v.b != 0 || has_slope(c);
}

template <class T>
bool PreparedShader<T>::moves(int index) const {
  if (index < 0 || std::is_same_v<T, scalar_t<T>>) return false;
  // A number that varies may carry the derivative of any constant or image.
  if (program_.varies(index))
    return !images_.empty() ||
           std::any_of(fixed_.begin(), fixed_.end(), [](const auto& c) { return has_slope(c); });
  return has_slope(fixed_[static_cast<std::size_t>(index)]);
}

template <class T>
void PreparedShader<T>::judge(const ShaderClosure& closure) {
  const auto input = [&](std::string_view name) {
    return closure.inputs[static_cast<std::size_t>(input_named(closure.kind, name))];
  };
  const auto judge_emission = [&](std::string_view color, std::string_view strength) {
    if (!acts(input(color)) || !acts(input(strength))) return;
    may_emit_ = true;
    emission_moves_ =
        emission_moves_ || moves(input(color)) || moves(input(strength)) || moves(closure.weight);
  };
  switch (closure.kind) {
    case ClosureKind::kTransparent:
      may_pass_ = may_pass_ || acts(input("color"));
      break;
    case ClosureKind::kEmission:
      judge_emission("color", "strength");
      break;
    case ClosureKind::kSubsurface:
      may_enter_ = true;
      break;
    case ClosureKind::kPrincipled: {
      judge_emission("emission_color", "emission_strength");
      const int alpha = input("alpha");
      may_pass_ = may_pass_ || program_.varies(alpha) || moves(alpha) ||
                  value_of(fixed_[static_cast<std::size_t>(alpha)].r) < 1;
      may_enter_ = may_enter_ || acts(input("subsurface_weight"));
      break;
    }
    case ClosureKind::kDiffuse:
    case ClosureKind::kGlossy:
    case ClosureKind::kGlass:
    case ClosureKind::kRefraction:
    case ClosureKind::kTranslucent:
    case ClosureKind::kSheen:
    case ClosureKind::kMetallic:
    case ClosureKind::kConductor:
      break;
  }
}

template <class T>
std::span<const PlacedClosure<T>> PreparedShader<T>::closures(const ShadingPoint& point,
                                                              ShaderRoom<T>& room) const {
  const Registers<T> registers = run_at(point, room);
  const Vec3f smooth = point.normal();
  std::size_t count = 0;
  for (const ShaderClosure& from : program_.closures) {
    const T weight = weight_of(from, registers);
    if (is_nothing(weight)) continue;
    if (count == room.closures.size()) room.closures.emplace_back();
    PlacedClosure<T>& to = room.closures[count++];
    to.closure = default_closure<T>(from.kind);
    to.flavour = from.flavour;
    to.weight = weight;
    to.n = smooth;
    to.tangent = {};
    to.turning.reset();
    to.rotating.reset();
    if (from.normal >= 0) {
      const Colorf n = value_of(registers[from.normal]);
      const float size = std::sqrt(n.r * n.r + n.g * n.g + n.b * n.b);
      if (size > 0) to.n = Vec3f{n.r, n.g, n.b} / size;
      if constexpr (!std::is_same_v<T, float>) {
        // Its length changes nothing of what is across it.
        if (const Color<T>& c = registers[from.normal]; size > 0 && has_slope(c))
          to.turning = Vec3<T>{c.r, c.g, c.b} / size;
      }
    }
    if (from.tangent >= 0) {
      const Colorf t = value_of(registers[from.tangent]);
      to.tangent = {t.r, t.g, t.b};
      if constexpr (!std::is_same_v<T, float>)
        if (const Color<T>& c = registers[from.tangent]; has_slope(c))
          to.rotating = Vec3<T>{c.r, c.g, c.b};
    }
    closure_fields(to.closure, Read<T>{registers, from.inputs});
  }
  return {room.closures.data(), count};
}

template <class T>
Color<T> PreparedShader<T>::transparency(const ShadingPoint& point, ShaderRoom<T>& room) const {
  const Registers<T> registers = run_at(point, room);
  static const auto alpha =
      static_cast<std::size_t>(input_named(ClosureKind::kPrincipled, "alpha"));
  Color<T> sum{};
  for (const ShaderClosure& from : program_.closures) {
    const T weight = weight_of(from, registers);
    if (is_nothing(weight)) continue;
    if (from.kind == ClosureKind::kTransparent)
      sum += registers[from.inputs[0]] * weight;
    else if (from.kind == ClosureKind::kPrincipled)
      sum += Color<T>((T(1) - clamp01(registers[from.inputs[alpha]].r)) * weight);
  }
  return sum;
}

Color<double> mean_emission(const Scene& scene, int material) {
  constexpr int kPoints = 64;
  const Geometry& geometry = *scene.geometry;
  const Material& source = scene.appearance.materials[material];
  std::vector<Hit> triangles;
  std::vector<double> cumulative;
  double area = 0;
  const auto& instances = geometry.instances();
  for (std::size_t i = 0; i < instances.size(); ++i) {
    const Mesh& mesh = geometry.meshes()[instances[i].mesh];
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      if (instances[i].materials[mesh.material_slots[t]] != material) continue;
      const auto [a, b, c] = geometry.corners(static_cast<int>(i), static_cast<int>(t));
      area += length(cross(b - a, c - a)) / 2;
      triangles.push_back({static_cast<int>(i), static_cast<int>(t), 0, 0, 0});
      cumulative.push_back(area);
    }
  }
  Color<double> sum(0);
  if (!(area > 0)) return sum;
  std::vector<Colorf> constants;
  for (const Color<double>& c : source.constants) constants.emplace_back(c);
  const PreparedShader<float> shader(source, constants);
  ShaderRoom<float> room;
  for (int k = 0; k < kPoints; ++k) {
    // By area, and over each triangle by a lattice.
    const double wanted = (k + 0.5) / kPoints * area;
    const auto at = std::min<std::size_t>(
        std::upper_bound(cumulative.begin(), cumulative.end(), wanted) - cumulative.begin(),
        triangles.size() - 1);
    const auto turn = [k](double step) { return std::fmod(0.5 + step * (k + 1), 1.); };
    const double root = std::sqrt(turn(0.7548776662)), u = turn(0.5698402910);
    Hit hit = triangles[at];
    hit.b1 = static_cast<float>(root * (1 - u)), hit.b2 = static_cast<float>(root * u);
    ShadingPoint point;
    point.geometry = &geometry;
    point.mesh_colors = &scene.appearance.mesh_colors;
    point.hit = hit;
    point.surface = geometry.surface(hit);
    point.wi = point.surface.ng;
    point.path.kinds = 0;
    const Colorf emitted = shader.emission(point, room);
    for (int c = 0; c < 3; ++c)
      if (std::isfinite(emitted[c])) sum[c] += std::max(emitted[c], 0.f) / kPoints;
  }
  return sum;
}

template class PreparedShader<float>;
template class PreparedShader<Dual<float, 1>>;
template class PreparedShader<Dual<float, 2>>;
template class PreparedShader<Dual<float, 4>>;
template class PreparedShader<Dual<float, 6>>;
template class PreparedShader<Dual<float, 8>>;
template class PreparedShader<Dual<float, 16>>;

}  // namespace selenite
