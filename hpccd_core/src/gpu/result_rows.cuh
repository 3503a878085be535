// SPDX-License-Identifier: Apache-2.0
// The rows of a frame's results as the caller sees them, in page-locked memory or on the device.
#pragma once

#include <memory>

#include "gpu/memory.h"
#include "gpu/ordering.cuh"

namespace hpccd::gpu {

class ResultRows {
 public:
  virtual ~ResultRows() = default;
  virtual ResultPlaces places() const = 0;
  // Room for so many; where it grows what was there is lost.
  virtual void reserve(u64 n_vf, u64 n_ee) = 0;
  virtual void reserve_intersections(u64 n_ef) = 0;
  virtual std::size_t device_bytes() const = 0;
};

template <class Memory>
class RowsIn final : public ResultRows {
 public:
  ResultPlaces places() const override {
    return {vf_.data(), ee_.data(), ef_.data(), toc_.data(), vf_.size(), ee_.size(), ef_.size()};
  }
  void reserve(u64 n_vf, u64 n_ee) override {
    vf_.reserve(n_vf), ee_.reserve(n_ee);
    toc_.reserve(vf_.size() + ee_.size());
  }
  void reserve_intersections(u64 n_ef) override { ef_.reserve(n_ef); }
  std::size_t device_bytes() const override {
    return std::is_same_v<Memory, DeviceMemory> ? vf_.bytes() + ee_.bytes() + ef_.bytes() + toc_.bytes() : 0;
  }

 private:
  Buffer<uint2, Memory> vf_;
  Buffer<uint4, Memory> ee_;
  Buffer<uint3, Memory> ef_;
  Buffer<double, Memory> toc_;
};

}  // namespace hpccd::gpu
