#pragma once

// Code that is compiled a second time for processors with AVX2 and FMA is within TFDUDE_HAS_AVX2,
// and used if kAvx2. clang, used only for checks, needs another pragma for this.
#if defined(__x86_64__) && !defined(__clang__)
#define TFDUDE_HAS_AVX2

namespace tfdude {

/// Whether this processor has both.
inline const bool kAvx2 = __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0;

}  // namespace tfdude
#endif
