// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/slots.h"

#include <algorithm>

#include "math/error.h"

namespace selenite {

SlotLayout::SlotLayout(const Scene& scene, std::vector<ParameterRef> ticked)
    : parameters(std::move(ticked)) {
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const ParameterRef& ref = parameters[i];
    scene.require_constant(ref);
    const std::string name = scene.owner_name(ref) + ":" + std::string(scene.description(ref).name);
    if (std::find(parameters.begin(), parameters.begin() + static_cast<long>(i), ref) !=
        parameters.begin() + static_cast<long>(i))
      throw InvalidArgument(name + " is listed twice; list it once");
    const int width = parameter_widths(ref.kind).at(ref.field);
    const bool diagonal = width == 3 && scene.description(ref).diagonal;
    if (diagonal) {
      const int slot = static_cast<int>(slots.size());
      slots.push_back({ref, -1});
      for (int c = 0; c < 3; ++c) rows.push_back({slot, c, c});
    } else {
      for (int c = 0; c < width; ++c) {
        rows.push_back({static_cast<int>(slots.size()), -1, c});
        slots.push_back({ref, c});
      }
    }
  }
}

}  // namespace selenite
