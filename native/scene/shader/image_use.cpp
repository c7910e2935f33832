// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/shader/image_use.h"

#include <algorithm>
#include <cstddef>

#include "scene/shader/shader.h"

namespace selenite {

bool encodes_normals(const Shader& shader, int texture) {
  const std::size_t before = shader.constants.size() + shader.literals.size();
  const auto is_lookup = [&](int index) {
    if (index < static_cast<int>(before)) return false;
    const Instruction& code = shader.instructions[static_cast<std::size_t>(index) - before];
    return code.op == Op::kImage && code.item == texture;
  };
  bool found = false;
  for (const Instruction& code : shader.instructions)
    for (std::size_t k = 0; k < code.count; ++k) {
      if (!is_lookup(shader.operands[code.first + k])) continue;
      if (code.op != Op::kNormalMap || k != 1) return false;
      found = true;
    }
  return found && std::ranges::none_of(shader.closures, [&](const ShaderClosure& closure) {
           return is_lookup(closure.weight) || is_lookup(closure.normal) ||
                  is_lookup(closure.tangent) || std::ranges::any_of(closure.inputs, is_lookup);
         });
}

}  // namespace selenite
