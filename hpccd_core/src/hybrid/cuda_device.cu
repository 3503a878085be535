// SPDX-License-Identifier: Apache-2.0
#include <cstring>

#include "gpu/device_leaves.cuh"
#include "gpu/device_motion.cuh"
#include "gpu/leaf_kdops.cuh"
#include "gpu/refit.cuh"
#include "hybrid/cuda_slot.cuh"
#include "hybrid/devices.h"

namespace hpccd::hybrid {
namespace {

class CudaTestDevice final : public TestDevice {
 public:
  CudaTestDevice(const Scene& scene, const Features& features, Accuracy accuracy, TestedFeatures tested,
                 const SeparationTable& separations, const ThicknessTable& thickness, const FeatureFilter& filter,
                 int device)
      : device_((check(cudaSetDevice(device), "cudaSetDevice"), device)),
        features_(features),
        scene_(scene, features, accuracy, tested, separations, thickness, filter, 1),
        leaves_(1),
        slots_(n_slots) {
    check(cudaDeviceGetAttribute(&multiprocessors_, cudaDevAttrMultiProcessorCount, device), "cudaDeviceGetAttribute");
    counters_.reserve(1);
    motion_.reserve(features.n_vertices, 1);
  }
  ~CudaTestDevice() override { cancel(); }

  std::shared_ptr<LeafPair[]> pair_memory(std::size_t n) override {
    auto memory = std::make_shared<PinnedBuffer<LeafPair>>();
    memory->reserve(n);
    return {memory, memory->data()};
  }

  void begin_frame(Positions t0, Positions t1) override {
    check(cudaSetDevice(device_), "cudaSetDevice");
    scene_.update_separations();
    is_double_ = t0.is_double;
    is_double_ ? upload_positions<double>(t0, t1) : upload_positions<float>(t0, t1);
  }

  void begin_traversal(const LeafTable& leaves) override {
    check(cudaSetDevice(device_), "cudaSetDevice");
    if (leaves.version != leaves_version_) {
      leaves_version_ = 0;  // none, if this fails
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
    slots_[t].assign(pieces);
    launch(slots_[t]);
    slots_[t].busy = true;
    return t;
  }

  bool ready(Ticket ticket) override {
    Slot& s = slots_[ticket];
    if (!s.data_ready()) return false;
    check(cudaSetDevice(device_), "cudaSetDevice");  // lists that grow must stay on this device
    if (!s.grow(largest_)) return true;
    ++resubmitted_;
    launch(s);
    return false;
  }

  void collect(Ticket ticket, Output& output) override {
    slots_[ticket].append_to(output, scene_);
    slots_[ticket].busy = false;
  }

  void cancel() override {
    const CallersDevice callers;
    cudaSetDevice(device_);
    cudaStreamSynchronize(upload_);
    for (Slot& s : slots_) s.drain();
    cudaGetLastError();
  }

  void count(std::map<std::string, std::uint64_t>& stats) const override {
    std::size_t bytes = scene_.bytes() + leaves_.bytes() + motion_.bytes() + given_[0].bytes() + given_[1].bytes();
    for (const Slot& s : slots_) bytes += s.bytes();
    stats["gpu_bytes"] += bytes;
    stats["hybrid_resubmitted"] += resubmitted_;
    stats["gpus"] += 1;
  }

 private:
  // Enough to keep an H100 busy; while all are in use, segments accumulate to longer runs (with 2, frames of 2 to 6 ms
  // take 5 to 20 % longer; with 16, single segments are sent and frames take half as long again).
  static constexpr std::size_t n_slots = 8;

  template <class T>
  LaunchParams<T> launch_params() const {
    LaunchParams<T> params{};
    scene_.fill(params);
    scene_.fill_separations(params);
    params.largest = largest_coordinate;
    leaves_.fill(params);
    motion_.fill(params);
    motion_.fill_counters(params, counters_.data());
    params.in_doubles = true;
    return params;
  }

  // Through page-locked memory: only copies from there are asynchronous.
  template <class T>
  void upload_positions(Positions t0, Positions t1) {
    check(cudaSetDevice(device_), "cudaSetDevice");
    check(cudaEventSynchronize(ready_), "cudaEventSynchronize");  // the copies of the last frame have left the memory
    LaunchParams<T> params = launch_params<T>();
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
    params.given_t0 = reinterpret_cast<const T*>(given_[0].data());
    params.given_t1 = reinterpret_cast<const T*>(given_[1].data());
    motion_.begin(params, multiprocessors_, upload_);
    motion_.launch(scene_.query_now(), params, upload_);
    check(cudaEventRecord(ready_, upload_), "cudaEventRecord");
  }

  template <class T>
  void refit() {
    const LaunchParams<T> params = launch_params<T>();
    refit_leaves_kernel<<<blocks_for(std::size_t{params.n_leaves} * refit_lanes, 128), 128, 0, upload_>>>(params);
    check_launch("refit_leaves_kernel");
    if (scene_.query_now() == gpu::Query::contacts) launch_leaf_kdops(params, upload_);
    check(cudaEventRecord(ready_, upload_), "cudaEventRecord");
  }

  void launch(Slot& s) {
    check(cudaSetDevice(device_), "cudaSetDevice");
    if (is_double_)
      s.launch(scene_, launch_params<double>(), leaves_version_, largest_, ready_, multiprocessors_);
    else
      s.launch(scene_, launch_params<float>(), leaves_version_, largest_, ready_, multiprocessors_);
  }

  const int device_;
  int multiprocessors_ = 1;
  const Features& features_;
  DeviceScene scene_;
  DeviceLeaves leaves_;
  std::uint64_t leaves_version_ = 0;
  bool is_double_ = true;
  Stream upload_;
  Event ready_;  // vertices and boxes of this frame
  PinnedBuffer<double> staging_[2];
  DeviceBuffer<double> given_[2];
  DeviceMotion motion_;
  DeviceBuffer<Counters> counters_;  // counters of the extent; each slot has its own for the tests
  std::vector<Slot> slots_;
  LargestLists largest_;
  std::uint64_t resubmitted_ = 0;
};

}  // namespace

std::vector<std::unique_ptr<TestDevice>> cuda_devices(const Scene& scene, const Features& features, Accuracy accuracy,
                                                      TestedFeatures tested, const SeparationTable& separations,
                                                      const ThicknessTable& thickness, const FeatureFilter& filter,
                                                      int gpus) {
  const auto& devices = status().devices;
  if (devices.empty()) throw Error(status().reason);
  const std::size_t n = gpus > 0 ? static_cast<std::size_t>(gpus) : devices.size();
  std::vector<std::unique_ptr<TestDevice>> found;
  for (std::size_t i = 0; i < std::min(n, devices.size()); ++i)
    found.push_back(std::make_unique<CudaTestDevice>(scene, features, accuracy, tested, separations, thickness, filter,
                                                     devices[i].number));
  return found;
}

}  // namespace hpccd::hybrid
