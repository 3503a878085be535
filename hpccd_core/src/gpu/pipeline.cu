// SPDX-License-Identifier: Apache-2.0
#include <cstring>

#include "gpu/bounds.cuh"
#include "gpu/device_leaves.cuh"
#include "gpu/device_scene.cuh"
#include "gpu/pipeline.h"
#include "gpu/refit.cuh"
#include "gpu/results.cuh"
#include "gpu/sort.h"
#include "gpu/test_lists.cuh"
#include "gpu/traverse.cuh"

namespace hpccd::gpu {
namespace {

class DevicePipeline : public Pipeline {
 public:
  DevicePipeline(const Scene& scene, const Features& features, Accuracy accuracy, int device, bool time_stages)
      : device_((check(cudaSetDevice(device), "cudaSetDevice"), device)),
        timer_(time_stages),
        features_(features),
        scene_(scene, features, accuracy),
        lists_(16 * typical_size(), 4 * typical_size(), typical_size() / 2) {
    check(cudaDeviceGetAttribute(&multiprocessors_, cudaDevAttrMultiProcessorCount, device), "cudaDeviceGetAttribute");
    counters_.reserve(1);
    host_counters_.reserve(1);
    *host_counters_.data() = {};
    leaf_pairs_.reserve(4 * typical_size());
    reserve_found(typical_size());
  }

  ~DevicePipeline() override {
    const CallersDevice callers;
    cudaSetDevice(device_);
    cudaStreamSynchronize(stream_);
  }

  void set_tree(const Tree& tree) override;
  bool run(Positions t0, Positions t1, ThreadPool& pool) override {
    check(cudaSetDevice(device_), "cudaSetDevice");
    // Work of a frame that failed may still be under way on these buffers.
    check(cudaStreamSynchronize(stream_), "cudaStreamSynchronize");
    return t0.is_double ? run_frame<double>(t0, t1, pool) : run_frame<float>(t0, t1, pool);
  }
  const std::vector<Candidate>& undecided() const override { return undecided_; }

  FrameResult finish() override {
    check(cudaStreamSynchronize(stream_), "cudaStreamSynchronize");
    FrameResult r;
    r.n_vf = host_counters_.data()->found[0];
    r.n_ee = host_counters_.data()->found[1];
    r.vf = reinterpret_cast<const std::array<u32, 2>*>(out_vf_.data());
    r.ee = reinterpret_cast<const std::array<u32, 4>*>(out_ee_.data());
    r.toc = out_toc_.data();
    r.hash = host_counters_.data()->hash;
    return r;
  }

  Positions download(Positions p, int which) override {
    const std::size_t bytes = 3 * p.n * (p.is_double ? 8 : 4);
    downloaded_[which].resize(bytes);
    if (!bytes) return {downloaded_[which].data(), p.n, p.is_double};
    settled_device(p.data);
    check(cudaMemcpy(downloaded_[which].data(), p.data, bytes, cudaMemcpyDefault), "cudaMemcpy");
    return {downloaded_[which].data(), p.n, p.is_double};
  }

  double relative_area() const override { return host_counters_.data()->area; }

  std::map<std::string, std::uint64_t> stats() const override {
    const Counters& c = *host_counters_.data();
    std::map<std::string, std::uint64_t> s;
    const char* kinds[2] = {"vf", "ee"};
    for (int k = 0; k < 2; ++k) {
      const std::string kind = kinds[k];
      s[kind + "_candidates"] = c.candidates[k];
      s[kind + "_rejected_coplanarity"] = c.candidates[k] - c.all_survivors[k];
      s[kind + "_rejected_projection"] = c.all_survivors[k] - c.all_single[k] - c.all_many[k];
      s[kind + "_rejected_roots"] = c.all_single[k] + c.all_many[k] - c.proven[k] - c.undecided_of[k];
      s[kind + "_proven_contacts"] = c.proven[k];
      s[kind + "_undecided"] = c.undecided_of[k];
      s[kind + "_single_root"] = c.all_single[k];
      s[kind + "_many_roots"] = c.all_many[k];
    }
    s["node_pairs"] = c.node_tests;
    s["leaf_pairs"] = c.leaf_pairs;
    s["gpu_passes"] = passes_;
    s["gpu_segments"] = lists_.n_segments();
    s["gpu_bytes"] = device_bytes();
    return s;
  }

  std::map<std::string, double> stages() const override { return timer_.stages(); }

 private:
  std::size_t typical_size() const { return std::max<std::size_t>(features_.n_primitives(), 1024); }
  std::size_t device_bytes() const;
  void reserve_found(std::size_t n);
  int settled_device(const void* array);
  template <class T>
  void bring(Positions t0, Positions t1, const T* given[2], ThreadPool& pool);
  template <class T>
  Frame<T> frame(Positions t0, Positions t1, ThreadPool& pool);
  template <class T>
  bool run_frame(Positions t0, Positions t1, ThreadPool& pool);
  template <class T>
  void launch(Frame<T>& f);
  template <class T>
  void launch_results(const Frame<T>& f);
  bool grow_overflowed();
  int device_, multiprocessors_ = 1;
  Stream stream_;
  Event counted_;
  StageTimer timer_;
  const Features& features_;

  DeviceScene scene_;
  TestLists lists_;

  u32 n_nodes_ = 0;
  DeviceLeaves leaves_;
  DeviceBuffer<DeviceBox> node_boxes_;
  DeviceBuffer<DevicePoint> points_;
  DeviceBuffer<u32> node_mesh_, node_parent_, node_arrivals_, leaf_nodes_;

  PinnedBuffer<double> staging_[2];
  DeviceBuffer<double> given_[2];
  DeviceBuffer<Row<double>> rows_;

  DeviceBuffer<uint2> leaf_pairs_;
  DeviceBuffer<u64> found_keys_, sorted_keys_;
  DeviceBuffer<double> found_tocs_;
  DeviceBuffer<u32> numbers_, order_;
  DeviceBuffer<unsigned char> workspace_;
  PinnedBuffer<uint2> out_vf_;
  PinnedBuffer<uint4> out_ee_;
  PinnedBuffer<double> out_toc_;
  DeviceBuffer<Counters> counters_;
  PinnedBuffer<Counters> host_counters_;

  u64 passes_ = 0, exact_last_time_ = 0;
  std::vector<Candidate> undecided_;
  std::vector<unsigned char> downloaded_[2];
};

void DevicePipeline::set_tree(const Tree& tree) {
  check(cudaSetDevice(device_), "cudaSetDevice");
  check(cudaStreamSynchronize(stream_), "cudaStreamSynchronize");
  n_nodes_ = 0;  // no tree, should anything below fail
  const std::size_t n = tree.nodes.size(), n_leaves = tree.leaves.size(), n_vertices = features_.n_vertices;
  std::vector<u32> parent(n, 0), mesh(n), last_leaf(n, 0);
  std::vector<DeviceBox> boxes(n);
  std::vector<u32> depth(n, 0);
  u32 deepest = 0;
  for (std::size_t i = n; i-- > 0;) {
    const Node& node = tree.nodes[i];
    mesh[i] = node.mesh == mixed_meshes ? no_mesh : node.mesh;
    if (node.children) parent[node.children] = parent[node.children + 1] = static_cast<u32>(i);
    last_leaf[i] = node.children ? std::max(last_leaf[node.children], last_leaf[node.children + 1]) : node.leaf;
    boxes[i].tag_low() = node.children, boxes[i].tag_high() = last_leaf[i];
  }
  for (std::size_t i = 1; i < n; ++i) deepest = std::max(deepest, depth[i] = depth[parent[i]] + 1);
  if (deepest > traverse_depth) throw Error("the tree is too deep for the device; use backend=\"cpu\"");
  upload(node_boxes_, boxes.data(), n);
  upload(node_mesh_, mesh.data(), n);
  upload(node_parent_, parent.data(), n);
  node_arrivals_.reserve(std::max<std::size_t>(n, 1));
  check(cudaMemset(node_arrivals_.data(), 0, node_arrivals_.bytes()), "cudaMemset");
  upload(leaf_nodes_, tree.leaf_nodes.data(), n_leaves);
  leaves_.set(features_, tree.leaves, tree.face_of_slot, tree.edge_of_slot, tree.vertex_of_slot);
  points_.reserve(std::max<std::size_t>(n_vertices, 1));
  rows_.reserve(std::max<std::size_t>(n_vertices, 1));
  n_nodes_ = static_cast<u32>(n);
}

std::size_t DevicePipeline::device_bytes() const {
  return scene_.bytes() + leaves_.bytes() + lists_.bytes() + node_boxes_.bytes() + points_.bytes() + rows_.bytes() +
         leaf_pairs_.bytes() + found_keys_.bytes() + sorted_keys_.bytes() + found_tocs_.bytes() + numbers_.bytes() +
         order_.bytes() + workspace_.bytes() + given_[0].bytes() + given_[1].bytes();
}

void DevicePipeline::reserve_found(std::size_t n) {
  if (n <= order_.size()) return;
  if (n > 0x7FFFFFFF) throw Error("more than 2^31 contacts; use backend=\"cpu\"");
  found_keys_.reserve(n);
  found_tocs_.reserve(n);
  sorted_keys_.reserve(n);
  numbers_.reserve(n);
  workspace_.reserve(sort_workspace(static_cast<int>(n), static_cast<int>(scene_.key_bits())));
  number_kernel<<<blocks_for(n, 256), 256, 0, stream_>>>(numbers_.data(), static_cast<u32>(n));
  check_launch("number_kernel");
  order_.reserve(n);  // last: its size says that all of these are there
}

// The device on which an array of the caller lies. Its producer may still be at work on a stream of its own: it is not
// when this returns.
int DevicePipeline::settled_device(const void* array) {
  cudaPointerAttributes a;
  check(cudaPointerGetAttributes(&a, array), "cudaPointerGetAttributes");
  const int where = a.type == cudaMemoryTypeDevice ? a.device : device_;
  check(cudaSetDevice(where), "cudaSetDevice");
  check(cudaDeviceSynchronize(), "cudaDeviceSynchronize");
  check(cudaSetDevice(device_), "cudaSetDevice");
  return where;
}

// The caller's positions on the device, by way of page-locked memory: the driver's own way from pageable memory takes
// one thread 100 us a megabyte. Waking the pool costs as much as copying half a megabyte. Those on another device are
// copied from there.
template <class T>
void DevicePipeline::bring(Positions t0, Positions t1, const T* given[2], ThreadPool& pool) {
  const Positions ends[2] = {t0, t1};
  const std::size_t bytes = 3 * t0.n * sizeof(T), words = std::max<std::size_t>((bytes + 7) / 8, 1);
  char* to[2] = {nullptr, nullptr};
  for (int i = 0; i < 2; ++i) {
    given[i] = static_cast<const T*>(ends[i].data);
    const bool on_device = ends[i].on_device;
    if (on_device && (bytes == 0 || settled_device(given[i]) == device_)) continue;
    given_[i].reserve(words);
    given[i] = reinterpret_cast<const T*>(given_[i].data());
    if (on_device) {
      check(cudaMemcpyAsync(given_[i].data(), ends[i].data, bytes, cudaMemcpyDefault, stream_), "cudaMemcpyAsync");
      continue;
    }
    staging_[i].reserve(words);
    to[i] = reinterpret_cast<char*>(staging_[i].data());
  }
  const auto copy = [&](std::size_t begin, std::size_t end, int) {
    for (int i = 0; i < 2; ++i)
      if (to[i]) std::memcpy(to[i] + begin, static_cast<const char*>(ends[i].data) + begin, end - begin);
  };
  if (bytes < (std::size_t{1} << 19))
    copy(0, bytes, 0);
  else
    parallel_for(pool, bytes, std::size_t{1} << 16, copy);
  for (int i = 0; i < 2; ++i)
    if (to[i] && bytes)
      check(cudaMemcpyAsync(given_[i].data(), to[i], bytes, cudaMemcpyHostToDevice, stream_), "cudaMemcpyAsync");
}

template <class T>
Frame<T> DevicePipeline::frame(Positions t0, Positions t1, ThreadPool& pool) {
  Frame<T> f{};
  scene_.fill(f);
  leaves_.fill(f);
  f.n_nodes = n_nodes_;
  f.node_boxes = node_boxes_.data(), f.node_mesh = node_mesh_.data(), f.node_parent = node_parent_.data();
  f.node_arrivals = node_arrivals_.data(), f.leaf_nodes = leaf_nodes_.data();
  const T* given[2];
  bring(t0, t1, given, pool);
  f.given_t0 = given[0], f.given_t1 = given[1];
  f.rows = reinterpret_cast<Row<T>*>(rows_.data()), f.points = points_.data();
  f.counters = counters_.data();
  return f;
}

template <class T>
void DevicePipeline::launch(Frame<T>& f) {
  f.leaf_pairs = {leaf_pairs_.data(), leaf_pairs_.size()};
  f.found_keys = found_keys_.data(), f.found_tocs = found_tocs_.data(), f.found_capacity = order_.size();
  check(cudaMemsetAsync(counters_.data(), 0, sizeof(Counters), stream_), "cudaMemsetAsync");
  extent_kernel<<<std::min(blocks_for(f.n_vertices, 256), 2u * multiprocessors_), 256, 0, stream_>>>(f);
  check_launch("extent_kernel");
  rows_kernel<<<blocks_for(f.n_vertices, 256), 256, 0, stream_>>>(f);
  check_launch("rows_kernel");
  timer_.mark("bounds", stream_);
  refit_kernel<<<blocks_for(std::size_t{f.n_leaves} * 32, 128), 128, 0, stream_>>>(f);
  check_launch("refit_kernel");
  timer_.mark("refit", stream_);
  traverse_kernel<<<blocks_for(f.n_leaves, traverse_warps), 32 * traverse_warps, 0, stream_>>>(f);
  check_launch("traverse_kernel");
  timer_.mark("traverse", stream_);
  lists_.launch(f, multiprocessors_, stream_, timer_);
}

// Makes room where a list was too short. True where the frame must run again.
bool DevicePipeline::grow_overflowed() {
  const Counters& c = *host_counters_.data();
  bool again = lists_.grow(c);
  if (c.leaf_pairs > leaf_pairs_.size()) {
    again = true;
    leaf_pairs_.reserve(c.leaf_pairs + c.leaf_pairs / 4);
  }
  if (c.found_all > order_.size()) {
    again = true;
    reserve_found(c.found_all + c.found_all / 4);
  }
  return again;
}

template <class T>
void DevicePipeline::launch_results(const Frame<T>& f) {
  const Counters& c = *host_counters_.data();
  const auto n = static_cast<u32>(c.found_all);
  const auto roomy = [](u64 x) { return static_cast<std::size_t>(x + x / 4 + 1024); };
  if (c.found[0] > out_vf_.size()) out_vf_.reserve(roomy(c.found[0]));
  if (c.found[1] > out_ee_.size()) out_ee_.reserve(roomy(c.found[1]));
  if (n > out_toc_.size()) out_toc_.reserve(roomy(n));
  if (n > 0) {
    sort_pairs(workspace_.data(), workspace_.bytes(), found_keys_.data(), sorted_keys_.data(), numbers_.data(),
               order_.data(), static_cast<int>(n), static_cast<int>(scene_.key_bits()), stream_);
    timer_.mark("sort", stream_);
    results_kernel<<<std::min(blocks_for(n, 128), 8u * multiprocessors_), 128, 0, stream_>>>(
        f, sorted_keys_.data(), order_.data(), n, static_cast<u32>(c.found[0]), out_vf_.data(), out_ee_.data(),
        out_toc_.data());
    check_launch("results_kernel");
    timer_.mark("results", stream_);
  }
  area_kernel<<<std::min(blocks_for(f.n_nodes, 256), static_cast<unsigned>(multiprocessors_)), 256, 0, stream_>>>(f);
  check_launch("area_kernel");
  check(cudaMemcpyAsync(host_counters_.data(), counters_.data(), sizeof(Counters), cudaMemcpyDeviceToHost, stream_),
        "cudaMemcpyAsync");
  timer_.mark("area", stream_);
}

template <class T>
bool DevicePipeline::run_frame(Positions t0, Positions t1, ThreadPool& pool) {
  undecided_.clear();
  passes_ = 0;
  timer_.begin(stream_);
  if (leaves_.size() == 0) {
    *host_counters_.data() = {};
    return true;
  }
  Frame<T> f = frame<T>(t0, t1, pool);
  timer_.mark("upload", stream_);
  for (bool again = true; again;) {
    ++passes_;
    launch(f);
    check(cudaMemcpyAsync(host_counters_.data(), counters_.data(), sizeof(Counters), cudaMemcpyDeviceToHost, stream_),
          "cudaMemcpyAsync");
    check(cudaEventRecord(counted_, stream_), "cudaEventRecord");
    // Pairs for exact arithmetic came last time too: threads that sleep take longer to wake than these take.
    if (exact_last_time_ > 1) pool.share([](int) {});
    check(cudaEventSynchronize(counted_), "cudaEventSynchronize");
    if (host_counters_.data()->bad) return false;
    again = grow_overflowed();
  }
  const Counters& c = *host_counters_.data();
  undecided_.reserve(c.to_host);
  const u64 n_to_host = exact_last_time_ = c.to_host;
  launch_results(f);
  for (u64 i = 0; i < n_to_host; ++i) undecided_.push_back(scene_.candidate_of(lists_.to_host()[i]));
  return true;
}

}  // namespace

std::unique_ptr<Pipeline> Pipeline::create(const Scene& scene, const Features& features, Accuracy accuracy, int device,
                                           bool time_stages) {
  if (status().devices.empty()) throw Error(status().reason);
  return std::make_unique<DevicePipeline>(scene, features, accuracy, device, time_stages);
}

}  // namespace hpccd::gpu
