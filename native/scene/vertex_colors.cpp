// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/vertex_colors.h"

#include "math/error.h"

namespace selenite {

VertexColors::VertexColors(int mesh, std::string attribute, Elements elements,
                           std::vector<Colorf> values)
    : mesh_(mesh),
      attribute_(std::move(attribute)),
      elements_(std::move(elements)),
      values_(std::move(values)) {
  const std::string who = "Colour attribute '" + attribute_ + "': ";
  const auto count = static_cast<int>(values_.size());
  for (const int element : *elements_)
    if (element < 0 || element >= count)
      throw InvalidArgument(who + "a corner shows value " + std::to_string(element) +
                            ", outside [0, " + std::to_string(count) + "); give one it has");
  for (std::size_t i = 0; i < values_.size(); ++i)
    for (int c = 0; c < 3; ++c)
      if (!std::isfinite(values_[i][c]))
        throw InvalidArgument(who + "value " + std::to_string(i) + " holds " +
                              std::to_string(values_[i][c]) + "; give finite numbers");
}

}  // namespace selenite
