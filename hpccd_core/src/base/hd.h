// SPDX-License-Identifier: Apache-2.0
// Marks arithmetic that is compiled for both CPU lanes and GPU threads.
#pragma once

#if defined(__CUDACC__)
#define HPCCD_HD __host__ __device__ __forceinline__
#else
#define HPCCD_HD inline __attribute__((always_inline))
#endif

// The same for larger code, of which GPUs get one copy, only where marked CALL: the assembler takes minutes and
// gigabytes for integers of hundreds of bits that are inlined into their callers, with loops unrolled.
#if defined(__CUDACC__)
#define HPCCD_HOST_DEVICE __host__ __device__
#define HPCCD_HOST_DEVICE_CALL __host__ __device__ __noinline__
#define HPCCD_ROLLED_ON_DEVICE _Pragma("unroll 1")
#else
#define HPCCD_HOST_DEVICE
#define HPCCD_HOST_DEVICE_CALL
#define HPCCD_ROLLED_ON_DEVICE
#endif
