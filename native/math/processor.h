// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdlib>
#include <string_view>

namespace selenite {

/// Whether SELENITE_AVX2=0 is in the environment: this processor then stands in for one without AVX2.
/// Its results differ in rounding, so that a study shows what of a fit depends on the processor.
inline bool avx2_is_forbidden() {
  const char* said = std::getenv("SELENITE_AVX2");
  return said && std::string_view(said) == "0";
}

}  // namespace selenite
