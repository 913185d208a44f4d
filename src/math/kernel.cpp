#include "math/kernel.hpp"

#include <cmath>
#include <cstring>

#include "math/processor.hpp"
#include "math/small_angle.hpp"

namespace tfdude::kernel {
namespace {

using V4 = double __attribute__((vector_size(32)));

namespace any {
#include "math/kernel_body.ipp"
}  // namespace any

#if defined(TFDUDE_HAS_AVX2)
#pragma GCC push_options
#pragma GCC target("avx2,fma")
namespace avx2 {
#include "math/kernel_body.ipp"  // NOLINT(readability-duplicate-include): for another processor
}  // namespace avx2
#pragma GCC pop_options

const Functions kForAvx2{
    avx2::climb_poses,   avx2::climb_both,  avx2::join_poses,  avx2::join_both,  avx2::transport,
    avx2::transport_sum, avx2::add_columns, avx2::blend_poses, avx2::blend_both, avx2::add_fourth};
#endif

}  // namespace

const Functions kPortable{any::climb_poses, any::climb_both,    any::join_poses,  any::join_both,
                          any::transport,   any::transport_sum, any::add_columns, any::blend_poses,
                          any::blend_both,  any::add_fourth};

const Functions& functions() {
#if defined(TFDUDE_HAS_AVX2)
  if (kAvx2) return kForAvx2;
#endif
  return kPortable;
}

}  // namespace tfdude::kernel
