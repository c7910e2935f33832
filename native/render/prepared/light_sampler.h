// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <map>
#include <vector>

#include "scene/scene.h"

namespace selenite {

/// What a render does with a light.
enum class LightUse {
  kNone,           ///< never samples it
  kSampled,        ///< samples it, unless it is black
  kDifferentiated  ///< samples it even if it is black: its derivative is not
};

/// The lights of a scene among which a LightSampler chooses.
struct LightSet {
  std::vector<LightUse> lamps;      ///< one each of the scene's lamps
  std::vector<LightUse> materials;  ///< one each: of the surfaces that emit
  LightUse world = LightUse::kNone;
  /// Mean radiance of the surfaces of a material with a shader; without entry that of its values.
  std::map<int, Color<double>> shaded;
};

/// Chooses a light of a scene, independently of the point that it lights, and gives the density of what
/// it chooses. A light is a lamp, all emissive surfaces together, or the world; these are numbered in
/// this order. Half of the samples are shared out by flux and half evenly, so that a weak lamp close
/// by is not starved.
class LightSampler {
 public:
  /// Reads the scene as long as it lives. A world is sampled only if it has an image: a direction of
  /// any other is as good as the next.
  LightSampler(const Scene& scene, const LightSet& lights);

  enum class Source { kNone, kLamp, kMesh, kWorld };
  struct Choice {
    Source source = Source::kNone;
    int index = 0;
    float probability = 0;
  };
  /// Picks a light; `u` in [0, 1).
  Choice choose(float u) const;
  /// Of choosing a light. `refracted`: as Cycles chooses, which leaves weak emissive surfaces out; see
  /// `world_density`.
  float probability(int source, bool refracted = false) const {
    return (refracted ? cycles_probability_ : probability_)[source];
  }
  int mesh_source() const { return static_cast<int>(probability_.size()) - 2; }
  int world_source() const { return mesh_source() + 1; }

  struct EmissiveTriangle {
    int instance, triangle, material;
  };
  /// Picks a triangle of the emissive surfaces by area and emission.
  const EmissiveTriangle& choose_triangle(float u) const;
  /// Whether surfaces of a material are among the lights.
  bool samples(int material) const { return emitters_[material].density > 0; }

  // Densities per solid angle by which light sampling would have chosen a direction. They are for the
  // weights of multiple importance sampling, and whatever they are, the weights of both strategies
  // add up to 1. But refraction that only light sampling can reach keeps its own weight
  // (docs/method/rendering.md, "Evaluation of rough refraction"): for a `refracted` direction they are those of Cycles.
  float lamp_density(int lamp, const LightHit& hit, bool refracted) const {
    return hit.density * probability(lamp, refracted);
  }
  float world_density(const Vec3f& direction, bool refracted) const {
    return (refracted ? world_.cycles_density(direction) : world_.density(direction)) *
           probability(world_source(), refracted);
  }
  /// Of the point `s` on an emissive surface, at `d` from where it is seen.
  float mesh_density(const Surface& s, const Vec3f& d, bool refracted) const {
    const Emitter& emitter = emitters_[s.material];
    if (refracted && !emitter.strong) return 0;
    const float distance2 = dot(d, d);
    const float cosine = std::abs(dot(s.ng, d)) / std::sqrt(distance2);
    return cosine > 0 ? probability(mesh_source(), refracted) * emitter.density * distance2 / cosine
                      : 0;
  }

 private:
  /// How the surfaces of a material are sampled.
  struct Emitter {
    float density = 0;  ///< per area; 0: not at all
    /// Cycles samples surfaces as lights from an emission of 0.5 up. Refraction must not be sampled
    /// otherwise: see `world_density`.
    bool strong = false;
  };
  struct Flux {
    double all = 0, strong = 0;
  };
  /// Collects the triangles that emit; their flux to one side, over pi.
  Flux add_triangles(const Scene& scene, const LightSet& set);

  const World& world_;
  std::vector<float> probability_, cycles_probability_;  ///< of each light
  std::vector<float> cdf_;                               ///< of `probability_`
  std::vector<EmissiveTriangle> triangles_;
  std::vector<float> triangle_cdf_;
  std::vector<Emitter> emitters_;  ///< one a material
};

}  // namespace selenite
