// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene/shader/program.h"

namespace selenite {

#define SELENITE_SHADER_TYPE(...)                                                        \
  template void prepare<__VA_ARGS__>(const Shader&, std::span<const Color<__VA_ARGS__>>, \
                                     std::span<Color<__VA_ARGS__>>);                     \
  template void run<__VA_ARGS__>(const Shader&, const ShadingPoint&, Registers<__VA_ARGS__>)
SELENITE_SHADER_TYPE(Dual<float, 1>);
SELENITE_SHADER_TYPE(Dual<float, 2>);
SELENITE_SHADER_TYPE(Dual<float, 4>);
SELENITE_SHADER_TYPE(Dual<float, 6>);
SELENITE_SHADER_TYPE(Dual<float, 8>);
SELENITE_SHADER_TYPE(Dual<float, 16>);
SELENITE_SHADER_TYPE(Dual<double, 1>);

}  // namespace selenite
