// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>

#include "module/arrays.h"
#include "scene/grid.h"

namespace selenite {

/// One grid: {name, values: (nz, ny, nx, 1 or 3), to_unit: (4, 4)}.
inline PlacedGrid placed_grid(const std::string& material, const pybind11::dict& values) {
  const auto name = values["name"].cast<std::string>();
  const std::string who = "Material '" + material + "': grid '" + name + "'";
  const auto numbers = values["values"].cast<Array<float>>();
  require_shape(numbers, who, {-1, -1, -1, numbers.ndim() == 4 && numbers.shape(3) == 3 ? 3 : 1});
  PlacedGrid placed;
  placed.to_unit = transform_of(values["to_unit"].cast<Array<double>>(), who + ": to_unit");
  placed.grid = std::make_shared<Grid>(
      name,
      std::array<int, 3>{static_cast<int>(numbers.shape(2)), static_cast<int>(numbers.shape(1)),
                         static_cast<int>(numbers.shape(0))},
      static_cast<int>(numbers.shape(3)),
      std::vector<float>(numbers.data(), numbers.data() + numbers.size()));
  return placed;
}

}  // namespace selenite
