// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <type_traits>
#include <vector>

#include "model/closures/surface_bsdf.h"
#include "scene/scene.h"
#include "scene/shader/evaluate.h"

namespace selenite {

/// Places for what a shader gives at one hit, used again for the next.
template <class T>
struct ShaderRoom {
  std::vector<Color<T>> own;
  std::vector<PlacedClosure<T>> closures;
};

/// A material's shader with its ticked constants seeded, T: a path scalar. What it says of the surface
/// as a whole is cautious: what varies over it counts as there.
template <class T>
class PreparedShader {
 public:
  /// `constants`: of `material.shader`, which has to stay. `images`: see Registers.
  PreparedShader(const Material& material, const std::vector<Color<T>>& constants,
                 std::vector<ImageSlots> images = {});

  /// The closures at a hit. They stay in the room until it is used again.
  std::span<const PlacedClosure<T>> closures(const ShadingPoint& point, ShaderRoom<T>& room) const;
  /// The sum of them at the point; `after_diffuse`: see SurfacePoint.
  SurfaceBsdf<T> bsdf(const ShadingPoint& point, bool after_diffuse, ShaderRoom<T>& room) const {
    return {closures(point, room), surface_point(point, after_diffuse)};
  }
  /// Factor of the light that passes straight through.
  Color<T> transparency(const ShadingPoint& point, ShaderRoom<T>& room) const;
  /// Radiance emitted towards the viewer of a light sample.
  Color<T> emission(const ShadingPoint& point, ShaderRoom<T>& room) const {
    return bsdf(point, false, room).emission();
  }

  bool may_pass() const { return may_pass_; }  ///< rays may go straight through
  bool may_emit() const { return may_emit_; }
  bool may_enter() const { return may_enter_; }  ///< light may scatter under the surface
  /// Whether what is emitted has a derivative.
  bool emission_moves() const { return emission_moves_; }
  bool has_bump() const { return program_.uses(Op::kBump); }

 private:
  static SurfacePoint<float> surface_point(const ShadingPoint& p, bool after_diffuse) {
    return {p.true_normal(), p.normal(), p.wi, p.backfacing(), after_diffuse};
  }
  Registers<T> run_at(const ShadingPoint& point, ShaderRoom<T>& room) const {
    room.own.resize(static_cast<std::size_t>(program_.varying()));
    const Registers<T> registers{fixed_, room.own, images_};
    run<T>(program_, point, registers);
    return registers;
  }
  /// Whether a number or colour may be other than 0, or has a derivative.
  bool acts(int index) const;
  bool has_share(const ShaderClosure& closure) const {
    return closure.weight < 0 || acts(closure.weight);
  }
  bool moves(int index) const;
  void judge(const ShaderClosure& closure);

  const Shader& program_;
  std::vector<Color<T>> fixed_;
  std::vector<ImageSlots> images_;
  bool may_pass_ = false, may_emit_ = false, may_enter_ = false, emission_moves_ = false;
};

/// Mean radiance that the surfaces of a material emit, by some of their points; 0 if it is on none.
Color<double> mean_emission(const Scene& scene, int material);

}  // namespace selenite
