// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "gpu/results_to_device.h"
#include "gpu/stream.h"

namespace hpccd::gpu {
namespace {

class Memory {
 public:
  explicit Memory(int device) : device_(device) { check(cudaSetDevice(device), "cudaSetDevice"); }

  // n consecutive rows.
  template <class Row>
  const Row* keep(const std::vector<Row>& rows, std::size_t room, std::size_t at, const Row* begin) {
    DeviceBuffer<unsigned char>* to = nullptr;
    if (!begin) {
      to = buffers_->emplace_back(std::make_unique<DeviceBuffer<unsigned char>>()).get();
      to->reserve(std::max<std::size_t>(room * sizeof(Row), 1));
      begin = reinterpret_cast<const Row*>(to->data());
    }
    if (!rows.empty())
      check(cudaMemcpy(const_cast<Row*>(begin) + at, rows.data(), rows.size() * sizeof(Row), cudaMemcpyHostToDevice),
            "cudaMemcpy");
    check(cudaStreamSynchronize(nullptr),
          "cudaStreamSynchronize");  // a copy from pageable memory may return before its end
    return begin;
  }
  template <class Row>
  const Row* keep(const std::vector<Row>& rows) {
    return keep<Row>(rows, rows.size(), 0, nullptr);
  }
  template <class Row>
  const Row* keep_if_any(const std::vector<Row>& rows) {
    return rows.empty() ? nullptr : keep(rows);
  }
  DeviceResults begin() const {
    DeviceResults r;
    r.memory = buffers_, r.device = device_;
    return r;
  }

 private:
  const int device_;
  std::shared_ptr<std::vector<std::unique_ptr<DeviceBuffer<unsigned char>>>> buffers_ =
      std::make_shared<std::vector<std::unique_ptr<DeviceBuffer<unsigned char>>>>();
};

// Contacts and proximity pairs differ in the names of their values.
template <class Pairs>
DeviceResults pairs_to_device(const Pairs& p, const std::vector<double>& vf_values,
                              const std::vector<double>& ee_values, int device) {
  const CallersDevice callers;
  Memory memory(device);
  DeviceResults r = memory.begin();
  r.n_vf = p.vf.size(), r.n_ee = p.ee.size();
  r.vf = memory.keep(p.vf), r.ee = memory.keep(p.ee);
  r.values = memory.keep<double>(vf_values, r.n_vf + r.n_ee, 0, nullptr);
  memory.keep<double>(ee_values, 0, r.n_vf, r.values);
  r.closest = memory.keep_if_any(p.closest), r.normals = memory.keep_if_any(p.normals);
  r.vertices = memory.keep_if_any(p.vertices), r.weights = memory.keep_if_any(p.weights);
  r.hash = p.hash;
  r.vf_offsets = memory.keep_if_any(p.slices.vf), r.ee_offsets = memory.keep_if_any(p.slices.ee);
  r.hashes = memory.keep_if_any(p.slices.hashes);
  if constexpr (requires { p.first_tocs; }) {
    r.points = memory.keep_if_any(p.points), r.approach = memory.keep_if_any(p.approach);
    r.first_tocs = memory.keep_if_any(p.first_tocs), r.first_toc = p.first_toc;
  }
  return r;
}

}  // namespace

DeviceResults to_device(const Contacts& c, int device) { return pairs_to_device(c, c.vf_toc, c.ee_toc, device); }
DeviceResults to_device(const Proximity& p, int device) {
  return pairs_to_device(p, p.vf_distance, p.ee_distance, device);
}

DeviceResults to_device(const Intersections& p, int device) {
  const CallersDevice callers;
  Memory memory(device);
  DeviceResults r = memory.begin();
  r.n_ef = p.ef.size(), r.ef = memory.keep(p.ef), r.hash = p.hash;
  r.ef_offsets = memory.keep_if_any(p.slices.ef), r.hashes = memory.keep_if_any(p.slices.hashes);
  return r;
}

void add_places(DeviceResults& r, const Contacts& c) {
  const CallersDevice callers;
  Memory memory(r.device);
  r.points = memory.keep_if_any(c.points), r.normals = memory.keep_if_any(c.normals);
  r.closest = memory.keep_if_any(c.closest);
  r.vertices = memory.keep_if_any(c.vertices), r.weights = memory.keep_if_any(c.weights);
  r.approach = memory.keep_if_any(c.approach);
  // One owner of both.
  r.memory = std::make_shared<std::pair<std::shared_ptr<const void>, std::shared_ptr<const void>>>(
      r.memory, memory.begin().memory);
}

std::shared_ptr<const void> joined_on_device(const void* a, std::size_t a_bytes, const void* b, std::size_t b_bytes,
                                             int device) {
  const CallersDevice callers;
  check(cudaSetDevice(device), "cudaSetDevice");
  auto memory = std::make_shared<DeviceBuffer<unsigned char>>();
  memory->reserve(std::max<std::size_t>(a_bytes + b_bytes, 1));
  if (a_bytes) check(cudaMemcpy(memory->data(), a, a_bytes, cudaMemcpyDefault), "cudaMemcpy");
  if (b_bytes) check(cudaMemcpy(memory->data() + a_bytes, b, b_bytes, cudaMemcpyDefault), "cudaMemcpy");
  // A copy from device to device returns before its end: waits for its stream, the default one, only.
  check(cudaStreamSynchronize(nullptr), "cudaStreamSynchronize");
  return {memory, memory->data()};
}

}  // namespace hpccd::gpu
