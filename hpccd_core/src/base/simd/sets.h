// SPDX-License-Identifier: Apache-2.0
// Functions that are compiled once for each instruction set: their declarations and the dispatch among them.
#pragma once

#include "hpccd/options.h"

// HPCCD_IN_EACH_SET(declarations): in the namespace of each set that this build has.
// HPCCD_OF_SET(simd, function): that of one of them, of a set that this machine has (resolve in base/simd.h).
#if defined(HPCCD_X86)
#define HPCCD_IN_EACH_SET(...) \
  namespace scalar {           \
  __VA_ARGS__                  \
  }                            \
  namespace avx2 {             \
  __VA_ARGS__                  \
  }                            \
  namespace avx512 {           \
  __VA_ARGS__                  \
  }
#define HPCCD_OF_SET(simd, function)                  \
  ((simd) == ::hpccd::Simd::avx512 ? avx512::function \
   : (simd) == ::hpccd::Simd::avx2 ? avx2::function   \
                                   : scalar::function)
#elif defined(HPCCD_ARM64)
#define HPCCD_IN_EACH_SET(...) \
  namespace scalar {           \
  __VA_ARGS__                  \
  }                            \
  namespace neon {             \
  __VA_ARGS__                  \
  }
#define HPCCD_OF_SET(simd, function) ((simd) == ::hpccd::Simd::neon ? neon::function : scalar::function)
#else
#define HPCCD_IN_EACH_SET(...) \
  namespace scalar {           \
  __VA_ARGS__                  \
  }
#define HPCCD_OF_SET(simd, function) ((void)(simd), scalar::function)
#endif
