// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <cstring>

#include "gpu/bounds.cuh"
#include "gpu/device_leaves.cuh"
#include "gpu/device_scene.cuh"
#include "gpu/refit.cuh"
#include "gpu/test_lists.cuh"
#include "hybrid/devices.h"

namespace hpccd::hybrid {
namespace {

using namespace gpu;

static_assert(sizeof(LeafPair) == sizeof(uint2));

// What differs between submissions of one slot; in page-locked memory, where the device reads it.
struct Order {
  u64 leaf_pairs;
  u32 number;
};

__global__ void begin_batch_kernel(Counters* counters, const Order* order) {
  constexpr u32 words = sizeof(Counters) / sizeof(u64);
  static_assert(sizeof(Counters) % sizeof(u64) == 0);
  for (u32 i = threadIdx.x; i < words; i += blockDim.x) reinterpret_cast<u64*>(counters)[i] = 0;
  __syncthreads();
  if (threadIdx.x == 0) counters->leaf_pairs = order->leaf_pairs;
}

// The state variable of an element of the GPU task queue becomes "data ready", after everything that it announces.
__global__ void data_ready_kernel(const Counters* counters, Counters* to_host, u32* state, const Order* order) {
  *to_host = *counters;
  __threadfence_system();
  *reinterpret_cast<volatile u32*>(state) = order->number;
}

// What one element of the GPU task queue needs on the device, and its output buffer in page-locked memory, which the
// kernels write themselves: nothing has to be copied back.
struct Slot {
  Slot() : lists(std::size_t{1} << 17, std::size_t{1} << 15, std::size_t{1} << 12) {
    counters.reserve(1);
    host_counters.reserve(1);
    state.reserve(1);
    order.reserve(1);
    *state.data() = 0;
    *order.data() = {0, 0};
    reserve_found(std::size_t{1} << 13);
  }
  void reserve_found(std::size_t n) {
    keys.reserve(n);
    tocs.reserve(n);
  }
  bool data_ready() const {
    return std::atomic_ref<u32>(*state.data()).load(std::memory_order_acquire) == order.data()->number;
  }

  Stream stream;
  TestLists lists;
  DeviceBuffer<uint2> pairs;
  DeviceBuffer<Counters> counters;
  PinnedBuffer<Counters> host_counters;
  PinnedBuffer<u64> keys;
  PinnedBuffer<double> tocs;
  PinnedBuffer<u32> state;
  PinnedBuffer<Order> order;  // its number is what `state` shows when the submission is ready
  Graph graph;
  std::vector<std::uintptr_t> recorded;  // what the graph depends on, as it was
  std::vector<Piece> sent;
  u32 looks = 0;
  bool busy = false;
};

class CudaTestDevice final : public TestDevice {
 public:
  CudaTestDevice(const Scene& scene, const Features& features, Accuracy accuracy, int device)
      : device_((check(cudaSetDevice(device), "cudaSetDevice"), device)),
        features_(features),
        scene_(scene, features, accuracy),
        timer_(false),
        slots_(n_slots) {
    check(cudaDeviceGetAttribute(&multiprocessors_, cudaDevAttrMultiProcessorCount, device), "cudaDeviceGetAttribute");
    counters_.reserve(1);
    points_.reserve(std::max<std::size_t>(features.n_vertices, 1));
    rows_.reserve(std::max<std::size_t>(features.n_vertices, 1));
  }
  ~CudaTestDevice() override { cancel(); }

  std::shared_ptr<LeafPair[]> pair_memory(std::size_t n) override {
    auto memory = std::make_shared<PinnedBuffer<LeafPair>>();
    memory->reserve(n);
    return {memory, memory->data()};
  }

  void begin_frame(Positions t0, Positions t1) override {
    is_double_ = t0.is_double;
    is_double_ ? upload_positions<double>(t0, t1) : upload_positions<float>(t0, t1);
  }

  void begin_traversal(const LeafTable& leaves) override {
    check(cudaSetDevice(device_), "cudaSetDevice");
    if (leaves.version != leaves_version_) {
      leaves_version_ = 0;  // none, should this fail
      leaves_.set(features_, *leaves.leaves, *leaves.face_of_slot, *leaves.edge_of_slot, *leaves.vertex_of_slot);
      leaves_version_ = leaves.version;
    }
    is_double_ ? refit<double>() : refit<float>();
  }

  std::size_t slots() const override { return n_slots; }
  std::size_t cores() const override { return static_cast<std::size_t>(multiprocessors_); }

  Ticket submit(const std::vector<Piece>& pieces) override {
    Ticket t = 0;
    while (slots_[t].busy) ++t;
    Slot& s = slots_[t];
    s.sent = pieces;
    launch(s);
    s.busy = true;
    return t;
  }

  bool ready(Ticket ticket) override {
    Slot& s = slots_[ticket];
    if (!s.data_ready()) {
      // A kernel that failed never says so: its stream does.
      if (++s.looks % 1024 == 0)
        if (const cudaError_t e = cudaStreamQuery(s.stream); e != cudaErrorNotReady) check(e, "cudaStreamQuery");
      return false;
    }
    const Counters& c = *s.host_counters.data();
    check(cudaSetDevice(device_), "cudaSetDevice");  // lists that grow must not end up on another one
    bool again = s.lists.grow(c);
    if (c.found_all > s.keys.size()) {
      again = true;
      s.reserve_found(c.found_all + c.found_all / 4);
    }
    if (again) {
      ++resubmitted_;
      largest_.include(s.lists.sizes());
      most_found_ = std::max(most_found_, s.keys.size());
      launch(s);
    }
    return !again;
  }

  void collect(Ticket ticket, Output& output) override {
    Slot& s = slots_[ticket];
    const Counters& c = *s.host_counters.data();
    for (u64 i = 0; i < c.found_all; ++i) {
      const Candidate p = scene_.candidate_of(s.keys.data()[i]);
      (p.kind == Kind::vertex_face ? output.vertex_face : output.edge_edge)
          .push_back({p.first, p.second, s.tocs.data()[i]});
    }
    for (u64 i = 0; i < c.to_host; ++i) output.undecided.push_back(scene_.candidate_of(s.lists.to_host()[i]));
    for (int k = 0; k < 2; ++k) {
      BatchCounts& sum = output.counts[k];
      sum.tested += c.candidates[k];
      sum.coplanarity += c.candidates[k] - c.all_survivors[k];
      sum.projection += c.all_survivors[k] - c.all_single[k] - c.all_many[k];
      sum.roots += c.all_single[k] + c.all_many[k] - c.proven[k] - c.undecided_of[k];
      sum.contacts += c.proven[k];
      sum.undecided += c.undecided_of[k];
    }
    s.busy = false;
  }

  void cancel() override {
    const CallersDevice callers;
    cudaSetDevice(device_);
    cudaStreamSynchronize(upload_);
    for (Slot& s : slots_) {
      cudaStreamSynchronize(s.stream);
      s.busy = false;
    }
    cudaGetLastError();
  }

  void count(std::map<std::string, std::uint64_t>& stats) const override {
    std::size_t bytes =
        scene_.bytes() + leaves_.bytes() + points_.bytes() + rows_.bytes() + given_[0].bytes() + given_[1].bytes();
    for (const Slot& s : slots_) bytes += s.lists.bytes() + s.pairs.bytes();
    stats["gpu_bytes"] += bytes;
    stats["hybrid_resubmitted"] += resubmitted_;
    stats["gpus"] += 1;
  }

 private:
  // Enough to keep an H100 busy; where all are under way, segments gather for longer runs (with 2 a frame of 2 to 6 ms
  // takes 5 to 20 % longer, with 16 single segments are sent and it takes half as long again).
  static constexpr std::size_t n_slots = 8;

  template <class T>
  Frame<T> frame() const {
    Frame<T> f{};
    scene_.fill(f);
    leaves_.fill(f);
    f.rows = reinterpret_cast<Row<T>*>(rows_.data()), f.points = points_.data();
    f.counters = counters_.data();
    return f;
  }

  // Through page-locked memory: only from there does a copy go on by itself.
  template <class T>
  void upload_positions(Positions t0, Positions t1) {
    check(cudaSetDevice(device_), "cudaSetDevice");
    check(cudaEventSynchronize(ready_), "cudaEventSynchronize");  // the last frame's copies have left the memory
    Frame<T> f = frame<T>();
    const Positions ends[2] = {t0, t1};
    const std::size_t bytes = 3 * t0.n * sizeof(T), words = std::max<std::size_t>((bytes + 7) / 8, 1);
    for (int i = 0; i < 2; ++i) {
      staging_[i].reserve(words);
      given_[i].reserve(words);
      if (bytes == 0) continue;
      std::memcpy(staging_[i].data(), ends[i].data, bytes);
      check(cudaMemcpyAsync(given_[i].data(), staging_[i].data(), bytes, cudaMemcpyHostToDevice, upload_),
            "cudaMemcpyAsync");
    }
    f.given_t0 = reinterpret_cast<const T*>(given_[0].data());
    f.given_t1 = reinterpret_cast<const T*>(given_[1].data());
    check(cudaMemsetAsync(counters_.data(), 0, sizeof(Counters), upload_), "cudaMemsetAsync");
    extent_kernel<<<std::min(blocks_for(f.n_vertices, 256), 2u * multiprocessors_), 256, 0, upload_>>>(f);
    check_launch("extent_kernel");
    rows_kernel<<<blocks_for(f.n_vertices, 256), 256, 0, upload_>>>(f);
    check_launch("rows_kernel");
    check(cudaEventRecord(ready_, upload_), "cudaEventRecord");
  }

  template <class T>
  void refit() {
    const Frame<T> f = frame<T>();
    refit_leaves_kernel<<<blocks_for(std::size_t{f.n_leaves} * 32, 128), 128, 0, upload_>>>(f);
    check_launch("refit_leaves_kernel");
    check(cudaEventRecord(ready_, upload_), "cudaEventRecord");
  }

  void launch(Slot& s) { is_double_ ? launch<double>(s) : launch<float>(s); }

  template <class T>
  void launch(Slot& s) {
    check(cudaSetDevice(device_), "cudaSetDevice");
    // What was too short in one slot will be in the others.
    s.lists.reserve(largest_);
    s.reserve_found(most_found_);
    std::size_t n = 0;
    for (const Piece& piece : s.sent) n += piece.n;
    if (n > s.pairs.size()) s.pairs.reserve(2 * n);
    *s.order.data() = {n, s.order.data()->number + 1};
    s.looks = 0;
    record<T>(s);
    check(cudaStreamWaitEvent(s.stream, ready_, 0), "cudaStreamWaitEvent");
    std::size_t at = 0;
    for (const Piece& piece : s.sent) {
      check(
          cudaMemcpyAsync(s.pairs.data() + at, piece.pairs, piece.n * sizeof(uint2), cudaMemcpyHostToDevice, s.stream),
          "cudaMemcpyAsync");
      at += piece.n;
    }
    s.graph.launch(s.stream);
  }

  // The kernels between the copy and "data ready", anew where something that they name has changed.
  template <class T>
  void record(Slot& s) {
    // Places as well as sizes: after a failed allocation a buffer may come back as large as it was, elsewhere.
    std::vector<std::uintptr_t> now{sizeof(T), leaves_version_, s.lists.n_segments()};
    const auto depends_on = [&](const auto& buffer) {
      now.push_back(reinterpret_cast<std::uintptr_t>(buffer.data()));
      now.push_back(buffer.size());
    };
    depends_on(s.pairs), depends_on(s.keys), depends_on(s.tocs);
    s.lists.for_buffers(depends_on);
    if (now == s.recorded) return;
    s.recorded.clear();
    Frame<T> f = frame<T>();
    f.counters = s.counters.data();
    f.leaf_pairs = {s.pairs.data(), s.pairs.size()};
    f.found_keys = s.keys.data(), f.found_tocs = s.tocs.data(), f.found_capacity = s.keys.size();
    s.graph.record(s.stream, [&] {
      begin_batch_kernel<<<1, 32, 0, s.stream>>>(f.counters, s.order.data());
      check_launch("begin_batch_kernel");
      s.lists.launch(f, multiprocessors_, s.stream, timer_);
      data_ready_kernel<<<1, 1, 0, s.stream>>>(f.counters, s.host_counters.data(), s.state.data(), s.order.data());
      check_launch("data_ready_kernel");
    });
    s.recorded = now;
  }

  const int device_;
  int multiprocessors_ = 1;
  const Features& features_;
  DeviceScene scene_;
  DeviceLeaves leaves_;
  std::uint64_t leaves_version_ = 0;
  bool is_double_ = true;
  Stream upload_;
  Event ready_;  // rows and boxes of this frame
  StageTimer timer_;
  PinnedBuffer<double> staging_[2];
  DeviceBuffer<double> given_[2];
  DeviceBuffer<Row<double>> rows_;
  DeviceBuffer<DevicePoint> points_;
  DeviceBuffer<Counters> counters_;
  std::vector<Slot> slots_;
  TestLists::Sizes largest_{};
  std::size_t most_found_ = 0;
  std::uint64_t resubmitted_ = 0;
};

}  // namespace

std::vector<std::unique_ptr<TestDevice>> cuda_devices(const Scene& scene, const Features& features, Accuracy accuracy,
                                                      int gpus) {
  const auto& devices = status().devices;
  if (devices.empty()) throw Error(status().reason);
  const std::size_t n = gpus > 0 ? static_cast<std::size_t>(gpus) : devices.size();
  std::vector<std::unique_ptr<TestDevice>> found;
  for (std::size_t i = 0; i < std::min(n, devices.size()); ++i)
    found.push_back(std::make_unique<CudaTestDevice>(scene, features, accuracy, devices[i].number));
  return found;
}

}  // namespace hpccd::hybrid
