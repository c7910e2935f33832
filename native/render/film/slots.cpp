// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/film/slots.h"

#include <algorithm>

#include "math/fault.h"

namespace selenite {

SlotLayout::SlotLayout(const Scene& scene, std::vector<ParameterRef> ticked)
    : parameters(std::move(ticked)) {
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const ParameterRef& ref = parameters[i];
    scene.require_constant(ref);
    const std::string name = scene.owner_name(ref) + ":" + std::string(scene.description(ref).name);
    if (std::find(parameters.begin(), parameters.begin() + static_cast<long>(i), ref) !=
        parameters.begin() + static_cast<long>(i))
      throw Refused("", name + " is listed twice", "list it once");
  }
  std::vector<int> first_slot(parameters.size(), -1);
  for (std::size_t i = 0; i < parameters.size(); ++i)
    for (std::size_t k = i; k < parameters.size(); ++k)
      if (first_slot[k] < 0 && parameters[k].same_owner(parameters[i])) {
        first_slot[k] = static_cast<int>(slots.size());
        add_slots(scene, parameters[k]);
      }
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const ParameterRef& ref = parameters[i];
    const bool diagonal = slots[first_slot[i]].component < 0;
    for (int c = 0; c < scene.width(ref); ++c)
      rows.push_back({first_slot[i] + (diagonal ? 0 : c), diagonal ? c : -1, c});
  }
}

int SlotLayout::first_of_owner(int slot) const {
  int first = slot;
  while (first > 0 && slots[first - 1].parameter.same_owner(slots[slot].parameter)) --first;
  return first;
}

void SlotLayout::add_slots(const Scene& scene, const ParameterRef& ref) {
  const int width = scene.width(ref);
  if (width == 3 && scene.description(ref).diagonal)
    slots.push_back({ref, -1});
  else
    for (int c = 0; c < width; ++c) slots.push_back({ref, c});
}

}  // namespace selenite
