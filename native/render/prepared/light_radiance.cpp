// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/prepared/light_radiance.h"

namespace selenite {
namespace {

Scale scale_of(const ParameterRef& ref) {
  return parameter_table(ref.kind).at(static_cast<std::size_t>(ref.field)).scale;
}

}  // namespace

template <int L>
LightRadiance<L>::LightRadiance(const Appearance& appearance, const SlotLayout& layout)
    : appearance_(appearance), lamp_slots_(appearance.lights.size()) {
  for (int i = 0; i < static_cast<int>(layout.slots.size()); ++i) {
    const Slot& slot = layout.slots[i];
    OwnerSlots* owner = slots_of(slot.parameter);
    if (!owner) continue;
    owner->first = layout.first_of_owner(i);
    const bool rotates = scale_of(slot.parameter) == Scale::kAngle;
    (slot.component < 0 ? owner->color
     : rotates          ? owner->rotation
                        : owner->intensity) = owner->count++;
  }
  // A lamp that stands at several places goes by the first of them.
  for (std::size_t i = 0; i < lamp_slots_.size(); ++i)
    for (std::size_t first = 0; first < i && lamp_slots_[i].count == 0; ++first)
      if (appearance.lights[first].name == appearance.lights[i].name)
        lamp_slots_[i] = lamp_slots_[first];
}

template <int L>
typename LightRadiance<L>::OwnerSlots* LightRadiance<L>::slots_of(const ParameterRef& ref) {
  switch (ref.kind) {
    case OwnerKind::kMaterial:
      return nullptr;
    case OwnerKind::kLight:
      return &lamp_slots_[ref.owner];
    case OwnerKind::kWorld:
      return &world_slots_;
  }
  return nullptr;
}

template class LightRadiance<0>;
template class LightRadiance<1>;
template class LightRadiance<2>;
template class LightRadiance<4>;
template class LightRadiance<6>;
template class LightRadiance<8>;
template class LightRadiance<16>;

}  // namespace selenite
