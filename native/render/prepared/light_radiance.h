// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "render/derivatives/throughput.h"
#include "render/film/slots.h"
#include "scene/scene.h"

namespace selenite {

/// What lamps and the world emit, with its derivatives in the slots of a layout.
template <int L>
class LightRadiance {
 public:
  /// Reads the appearance as long as it lives.
  LightRadiance(const Appearance& appearance, const SlotLayout& layout);

  /// Radiance (delta lamp: irradiance) of a lamp or the world for its shape's factor.
  Factor<L> lamp(int light, float shape) const {
    const LightParameters& p = appearance_.lights[light].values;
    return product(p.color, p.power, Colorf(shape), lamp_slots_[light]);
  }
  /// Of the world for a shape of its own, at a rotation that is known.
  Factor<L> world(const Colorf& shape) const {
    const WorldParameters& p = appearance_.world.values;
    return product(p.color, p.strength, shape, world_slots_);
  }
  /// Of the world in a direction, which stays as it is where the image is rotated.
  Factor<L> world_along(const Vec3f& direction) const {
    const World& world = appearance_.world;
    Factor<L> f = this->world(world.factor(direction));
    if (is_rotation_ticked())
      f.set_slope(world_slots_.rotation, Colorf(world.values.color) *
                                             world.rotation_slope(direction) *
                                             static_cast<float>(world.values.strength));
    return f;
  }
  /// Of a backdrop of the world in a direction.
  Factor<L> backdrop(const Backdrop& seen, const Vec3f& direction) const {
    const Colorf shape = seen.factor(direction);
    return seen.scaled ? world(shape) : Factor<L>{shape};
  }
  bool is_lamp_ticked(int light) const { return lamp_slots_[light].count > 0; }
  bool is_world_ticked() const { return world_slots_.count > 0; }
  bool is_rotation_ticked() const { return world_slots_.rotation >= 0; }

 private:
  struct OwnerSlots {
    int first = 0, count = 0;
    /// Power or strength; the colour; of the world: counted from `first`.
    int intensity = -1, color = -1, rotation = -1;
  };
  static Factor<L> product(const Color<double>& color, double intensity, const Colorf& shape,
                           const OwnerSlots& slots) {
    const Colorf c(color);
    const auto i = static_cast<float>(intensity);
    Factor<L> f{c * shape * i, slots.first, slots.count};
    if (slots.intensity >= 0) f.set_slope(slots.intensity, c * shape);
    if (slots.color >= 0) f.set_slope(slots.color, shape * i);
    return f;
  }
  /// Null: not of a light.
  OwnerSlots* slots_of(const ParameterRef& ref);

  const Appearance& appearance_;
  std::vector<OwnerSlots> lamp_slots_;
  OwnerSlots world_slots_;
};

}  // namespace selenite
