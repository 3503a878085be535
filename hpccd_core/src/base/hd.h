// SPDX-License-Identifier: Apache-2.0
// Marks the arithmetic that the CPU's lanes and the GPU's threads share.
#pragma once

#if defined(__CUDACC__)
#define HPCCD_HD __host__ __device__ __forceinline__
#else
#define HPCCD_HD inline __attribute__((always_inline))
#endif
