// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cuda_runtime.h>

#include <cstddef>
#include <cstdint>

namespace hpccd::gpu {

// Device memory needed to sort n keys.
std::size_t sort_workspace(int n, int key_bits);

// Sorts keys ascending by their lowest key_bits bits, and their values with them.
void sort_pairs(void* workspace, std::size_t workspace_bytes, const unsigned long long* keys,
                unsigned long long* sorted_keys, const std::uint32_t* values, std::uint32_t* sorted_values, int n,
                int key_bits, cudaStream_t stream);

// Device memory needed for prefix sums of n numbers.
std::size_t sum_workspace(int n);

// sums[i] = numbers[0] + ... + numbers[i - 1].
void sum_before(void* workspace, std::size_t workspace_bytes, const std::uint32_t* numbers, std::uint32_t* sums, int n,
                cudaStream_t stream);

}  // namespace hpccd::gpu
