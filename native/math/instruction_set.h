// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#if defined(__GNUC__) && defined(__x86_64__)
#include <cpuid.h>
#endif

namespace selenite {

#if defined(__GNUC__) && defined(__x86_64__)

// The processor itself is asked: on Windows the compiler's __builtin_cpu_supports may know nothing.

/// Whether this processor has SSE4.2.
inline bool has_sse42() {
  unsigned a = 0, b = 0, c = 0, d = 0;
  return __get_cpuid(1, &a, &b, &c, &d) && (c & bit_SSE4_2);
}

/// Whether this processor has AVX2, FMA and BMI2, and the operating system keeps their registers.
inline bool has_avx2() {
  unsigned a = 0, b = 0, c = 0, d = 0;
  if (!__get_cpuid(1, &a, &b, &c, &d) || !(c & bit_FMA) || !(c & bit_OSXSAVE)) return false;
  unsigned kept = 0, high = 0;
  asm("xgetbv" : "=a"(kept), "=d"(high) : "c"(0));
  constexpr unsigned kSseAndAvx = 6;
  if ((kept & kSseAndAvx) != kSseAndAvx) return false;
  return __get_cpuid_count(7, 0, &a, &b, &c, &d) && (b & bit_AVX2) && (b & bit_BMI2);
}

#endif

}  // namespace selenite
