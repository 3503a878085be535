// SPDX-License-Identifier: Apache-2.0
// The rows of a frame's results in the caller's layout, in page-locked memory or on the device.
#pragma once

#include <algorithm>
#include <memory>
#include <type_traits>
#include <vector>

#include "gpu/memory.h"
#include "gpu/ordering.cuh"
#include "gpu/places_task.cuh"

namespace hpccd::gpu {

class ResultRows {
 public:
  virtual ~ResultRows() = default;
  virtual ResultPlaces places() const = 0;
  // Allocates memory for rows; the contents are lost when it grows.
  virtual void reserve(u64 n_vf, u64 n_ee) = 0;
  virtual void reserve_intersections(u64 n_ef) = 0;
  virtual void reserve_worlds(std::size_t n) = 0;
  // Allocates memory for the outputs of as many rows, and returns it.
  virtual PlacesOut reserve_places(u64 n_rows, Outputs outputs) = 0;
  virtual std::size_t device_bytes() const = 0;
};

template <class Memory>
class RowsIn final : public ResultRows {
 public:
  ResultPlaces places() const override {
    // After a failed allocation there may be rows without times.
    const bool whole = toc_.size() >= vf_.size() + ee_.size();
    return {vf_.data(),
            ee_.data(),
            ef_.data(),
            toc_.data(),
            whole ? vf_.size() : 0,
            whole ? ee_.size() : 0,
            ef_.size(),
            offsets_[0].data(),
            offsets_[1].data(),
            hashes_.data(),
            first_tocs_.data()};
  }
  void reserve_worlds(std::size_t n) override {
    for (auto& offsets : offsets_) offsets.reserve(n + 1);
    hashes_.reserve(n);
    first_tocs_.reserve(n);
  }
  void reserve(u64 n_vf, u64 n_ee) override {
    vf_.reserve(n_vf), ee_.reserve(n_ee);
    toc_.reserve(vf_.size() + ee_.size());
  }
  void reserve_intersections(u64 n_ef) override { ef_.reserve(n_ef); }
  PlacesOut reserve_places(u64 n_rows, Outputs outputs) override {
    // Like the rows, with spare capacity.
    const u64 n = std::max<u64>(n_rows, vf_.size() + ee_.size());
    if (outputs.points) points_.reserve(3 * n);
    if (outputs.normals) normals_.reserve(3 * n);
    if (outputs.closest) closest_.reserve(6 * n);
    if (outputs.weights) vertices_.reserve(n), weights_.reserve(4 * n), approach_.reserve(n);
    return {outputs,          points_.data(),  normals_.data(), closest_.data(),
            vertices_.data(), weights_.data(), approach_.data()};
  }
  std::size_t device_bytes() const override {
    return std::is_same_v<Memory, DeviceMemory>
               ? vf_.bytes() + ee_.bytes() + ef_.bytes() + toc_.bytes() + 2 * offsets_[0].bytes() + hashes_.bytes() +
                     first_tocs_.bytes() + points_.bytes() + normals_.bytes() + closest_.bytes() + vertices_.bytes() +
                     weights_.bytes() + approach_.bytes()
               : 0;
  }

 private:
  Buffer<uint2, Memory> vf_;
  Buffer<uint4, Memory> ee_;
  Buffer<uint3, Memory> ef_;
  Buffer<double, Memory> toc_;
  Buffer<u64, Memory> offsets_[2], hashes_;
  Buffer<double, Memory> first_tocs_;
  Buffer<double, Memory> points_, normals_, closest_, weights_, approach_;
  Buffer<uint4, Memory> vertices_;
};

// Rows for the caller: they are reused for another frame once they are no longer held.
class RowsPool {
 public:
  explicit RowsPool(bool on_device) : on_device_(on_device) {}

  // Null if the host rows that are held would make page-locked memory scarce.
  std::shared_ptr<ResultRows> take() {
    for (const auto& rows : rows_)
      if (rows.use_count() == 1) return rows;
    if (on_device_)
      rows_.push_back(std::make_shared<RowsIn<DeviceMemory>>());
    else if (rows_.size() < most_on_host)
      rows_.push_back(std::make_shared<RowsIn<PinnedMemory>>());
    else
      return nullptr;
    return rows_.back();
  }
  std::size_t device_bytes() const {
    std::size_t bytes = 0;
    for (const auto& rows : rows_) bytes += rows->device_bytes();
    return bytes;
  }

 private:
  static constexpr std::size_t most_on_host = 4;
  const bool on_device_;
  std::vector<std::shared_ptr<ResultRows>> rows_;
};

}  // namespace hpccd::gpu
