// SPDX-License-Identifier: Apache-2.0
// In a source of its own: CUB's headers take longer to compile than all other kernels.
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>

#include "gpu/cuda_call.h"
#include "gpu/sort.h"

namespace hpccd::gpu {

std::size_t sort_workspace(int n, int key_bits) {
  std::size_t bytes = 0;
  const unsigned long long* keys = nullptr;
  const std::uint32_t* values = nullptr;
  check(cub::DeviceRadixSort::SortPairs(nullptr, bytes, keys, const_cast<unsigned long long*>(keys), values,
                                        const_cast<std::uint32_t*>(values), n, 0, key_bits),
        "cub::DeviceRadixSort (size)");
  return bytes;
}

void sort_pairs(void* workspace, std::size_t workspace_bytes, const unsigned long long* keys,
                unsigned long long* sorted_keys, const std::uint32_t* values, std::uint32_t* sorted_values, int n,
                int key_bits, cudaStream_t stream) {
  check(cub::DeviceRadixSort::SortPairs(workspace, workspace_bytes, keys, sorted_keys, values, sorted_values, n, 0,
                                        key_bits, stream),
        "cub::DeviceRadixSort");
}

std::size_t sum_workspace(int n) {
  std::size_t bytes = 0;
  const std::uint32_t* numbers = nullptr;
  check(cub::DeviceScan::ExclusiveSum(nullptr, bytes, numbers, const_cast<std::uint32_t*>(numbers), n),
        "cub::DeviceScan (size)");
  return bytes;
}

void sum_before(void* workspace, std::size_t workspace_bytes, const std::uint32_t* numbers, std::uint32_t* sums, int n,
                cudaStream_t stream) {
  check(cub::DeviceScan::ExclusiveSum(workspace, workspace_bytes, numbers, sums, n, stream), "cub::DeviceScan");
}

}  // namespace hpccd::gpu
