// SPDX-License-Identifier: Apache-2.0
#include "gpu/pipeline.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <vector>

#include "gpu/bounds.cuh"
#include "gpu/candidates.cuh"
#include "gpu/elementary.cuh"
#include "gpu/memory.h"
#include "gpu/refit.cuh"
#include "gpu/results.cuh"
#include "gpu/sort.h"
#include "gpu/traverse.cuh"

namespace hpccd::gpu {
namespace {

template <class T>
void upload(DeviceBuffer<T>& to, const void* from, std::size_t n) {
  to.reserve(std::max<std::size_t>(n, 1));
  if (n) check(cudaMemcpy(to.data(), from, n * sizeof(T), cudaMemcpyHostToDevice), "cudaMemcpy");
}

class Stream {
 public:
  Stream() { check(cudaStreamCreate(&stream_), "cudaStreamCreate"); }
  ~Stream() { cudaStreamDestroy(stream_); }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
  operator cudaStream_t() const { return stream_; }

 private:
  cudaStream_t stream_ = nullptr;
};

class Event {
 public:
  Event() { check(cudaEventCreate(&event_), "cudaEventCreate"); }
  ~Event() { cudaEventDestroy(event_); }
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;
  operator cudaEvent_t() const { return event_; }

 private:
  cudaEvent_t event_ = nullptr;
};

// Device time between marks on the stream; recorded only where asked for, since each mark costs a microsecond.
class StageTimer {
 public:
  explicit StageTimer(bool on) : on_(on) {}
  void begin(cudaStream_t s) {
    names_.clear();
    mark("", s);
  }
  void mark(const char* name, cudaStream_t s) {
    if (!on_) return;
    if (names_.size() == events_.size()) events_.push_back(std::make_unique<Event>());
    check(cudaEventRecord(*events_[names_.size()], s), "cudaEventRecord");
    names_.push_back(name);
  }
  std::map<std::string, double> stages() const {
    std::map<std::string, double> ms;
    for (std::size_t i = 1; i < names_.size(); ++i) {
      float t = 0;
      if (cudaEventElapsedTime(&t, *events_[i - 1], *events_[i]) == cudaSuccess) ms[names_[i]] += t;
    }
    return ms;
  }

 private:
  bool on_;
  std::vector<std::unique_ptr<Event>> events_;
  std::vector<const char*> names_;
};

unsigned blocks_for(std::size_t n, unsigned threads) {
  return static_cast<unsigned>(std::max<std::size_t>(1, (n + threads - 1) / threads));
}

class DevicePipeline : public Pipeline {
 public:
  DevicePipeline(const Scene& scene, const Features& features, Accuracy accuracy, int device, bool time_stages)
      : device_((check(cudaSetDevice(device), "cudaSetDevice"), device)), timer_(time_stages), features_(features) {
    const auto n_edges = features.edges.size();
    if (features.n_vertices >= kind_bit || n_edges >= kind_bit || features.n_faces() >= kind_bit)
      throw Error("the scene has 2^31 or more features of one kind; use backend=\"cpu\"");
    check(cudaDeviceGetAttribute(&multiprocessors_, cudaDevAttrMultiProcessorCount, device), "cudaDeviceGetAttribute");
    upload(edges_, features.edges.data(), n_edges);
    upload(faces_, features.faces.data(), 3 * features.faces.size());
    upload_rules(scene, accuracy);
    const auto bits = [](std::size_t n) { return static_cast<u32>(std::bit_width(std::max<std::size_t>(n, 1) - 1)); };
    const u32 first = std::max(bits(features.n_vertices), bits(n_edges));
    key_shift_ = std::max<u32>(1, std::max(bits(features.n_faces()), bits(n_edges)));
    kind_shift_ = std::max<u32>(1, first) + key_shift_;
    counters_.reserve(1);
    host_counters_.reserve(1);
    *host_counters_.data() = {};
    // A start that most scenes outgrow once or never; lists grow where they overflow.
    const std::size_t carriers = std::max<std::size_t>(features.n_carriers(), 1024);
    leaf_pairs_.reserve(4 * carriers);
    for (int k = 0; k < 2; ++k) {
      survivors_[k].reserve(16 * carriers);
      single_[k].reserve(4 * carriers);
      many_[k].reserve(4 * carriers);
    }
    reserve_found(carriers);
    undecided_keys_.reserve(carriers / 2);
    to_host_.reserve(carriers / 2);
  }

  ~DevicePipeline() override {
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
  const std::vector<Undecided>& undecided() const override { return undecided_; }

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
    check(cudaSetDevice(device_), "cudaSetDevice");
    check(cudaDeviceSynchronize(), "cudaDeviceSynchronize");
    if (bytes) check(cudaMemcpy(downloaded_[which].data(), p.data, bytes, cudaMemcpyDeviceToHost), "cudaMemcpy");
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
    s["gpu_segments"] = n_segments_;
    s["gpu_bytes"] = device_bytes();
    return s;
  }

  std::map<std::string, double> stages() const override { return timer_.stages(); }

 private:
  void upload_rules(const Scene& scene, Accuracy accuracy);
  std::size_t device_bytes() const;
  void reserve_found(std::size_t n);
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
  template <class Kernel, class T>
  void persistent(Kernel kernel, unsigned threads, const Frame<T>& f, const char* name) {
    int& blocks = occupancy_[reinterpret_cast<const void*>(kernel)];
    if (blocks == 0)
      check(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, kernel, static_cast<int>(threads), 0), name);
    kernel<<<static_cast<unsigned>(std::max(blocks, 1) * multiprocessors_), threads, 0, stream_>>>(f);
    check_launch(name);
  }

  int device_, multiprocessors_ = 1;
  Stream stream_;
  Event counted_;
  StageTimer timer_;
  const Features& features_;

  DeviceBuffer<uint2> edges_;
  DeviceBuffer<u32> faces_, mesh_of_vertex_;
  DeviceBuffer<unsigned char> enabled_, accuracy_;
  bool all_enabled_ = true, one_accuracy_ = true;
  u32 n_meshes_ = 0, key_shift_ = 0, kind_shift_ = 0;
  Accuracy default_accuracy_ = Accuracy::exact;

  u32 n_nodes_ = 0, n_leaves_ = 0;
  DeviceBuffer<DeviceBox> node_boxes_, leaf_boxes_, edge_boxes_, face_boxes_, vertex_boxes_;
  DeviceBuffer<u32> node_mesh_, node_parent_, node_arrivals_, leaf_nodes_;
  DeviceBuffer<DeviceLeaf> leaves_;
  DeviceBuffer<u32> vertex_of_slot_, edge_of_slot_, face_of_slot_, face_corner2_;

  PinnedBuffer<double> staging_[2];
  DeviceBuffer<double> given_[2];
  DeviceBuffer<Row<double>> rows_;

  DeviceBuffer<uint2> leaf_pairs_, survivors_[2], single_[2], many_[2];
  DeviceBuffer<u64> found_keys_, sorted_keys_, undecided_keys_;
  DeviceBuffer<double> found_tocs_;
  DeviceBuffer<u32> numbers_, order_;
  DeviceBuffer<unsigned char> workspace_;
  PinnedBuffer<u64> to_host_;
  PinnedBuffer<uint2> out_vf_;
  PinnedBuffer<uint4> out_ee_;
  PinnedBuffer<double> out_toc_;
  DeviceBuffer<Counters> counters_;
  PinnedBuffer<Counters> host_counters_;

  // Lists of one pass stay below this; larger frames take several segments.
  static constexpr std::size_t most_listed = std::size_t{1} << 26;
  u32 n_segments_ = 1;
  u64 passes_ = 0;
  std::map<const void*, int> occupancy_;  // blocks of a kernel on one multiprocessor
  std::vector<Undecided> undecided_;
  std::vector<unsigned char> downloaded_[2];
};

void DevicePipeline::upload_rules(const Scene& scene, Accuracy accuracy) {
  default_accuracy_ = accuracy;
  n_meshes_ = static_cast<u32>(scene.meshes().size());
  std::vector<unsigned char> enabled(std::size_t{n_meshes_} * n_meshes_), tiers(enabled.size());
  for (u32 a = 0; a < n_meshes_; ++a)
    for (u32 b = 0; b < n_meshes_; ++b) {
      const std::size_t i = std::size_t{a} * n_meshes_ + b;
      enabled[i] = scene.pair_enabled(a, b);
      tiers[i] = static_cast<unsigned char>(scene.pair_accuracy(a, b, accuracy));
      all_enabled_ = all_enabled_ && enabled[i];
      one_accuracy_ = one_accuracy_ && tiers[i] == static_cast<unsigned char>(accuracy);
    }
  std::vector<u32> mesh(scene.n_vertices());
  for (u32 m = 0; m < n_meshes_; ++m)
    std::fill_n(mesh.begin() + scene.meshes()[m].first_vertex, scene.meshes()[m].n_vertices, m);
  upload(enabled_, enabled.data(), enabled.size());
  upload(accuracy_, tiers.data(), tiers.size());
  upload(mesh_of_vertex_, mesh.data(), mesh.size());
}

void DevicePipeline::set_tree(const Tree& tree) {
  check(cudaSetDevice(device_), "cudaSetDevice");
  check(cudaStreamSynchronize(stream_), "cudaStreamSynchronize");
  n_nodes_ = n_leaves_ = 0;  // no tree, should anything below fail
  const std::size_t n = tree.nodes.size(), n_leaves = tree.leaves.size();
  std::vector<u32> parent(n, 0), mesh(n), last_leaf(n, 0);
  std::vector<DeviceBox> boxes(n);
  std::vector<u32> depth(n, 0);
  u32 deepest = 0;
  for (std::size_t i = n; i-- > 0;) {
    const Node& node = tree.nodes[i];
    mesh[i] = node.mesh == mixed_meshes ? no_mesh : node.mesh;
    if (node.children) parent[node.children] = parent[node.children + 1] = static_cast<u32>(i);
    last_leaf[i] = node.children ? std::max(last_leaf[node.children], last_leaf[node.children + 1]) : node.leaf;
    boxes[i] = {{0, 0, 0}, node.children, {0, 0, 0}, last_leaf[i]};
  }
  for (std::size_t i = 1; i < n; ++i) deepest = std::max(deepest, depth[i] = depth[parent[i]] + 1);
  if (deepest > traverse_depth) throw Error("the tree is too deep for the device; use backend=\"cpu\"");
  std::vector<DeviceLeaf> leaves(n_leaves);
  for (std::size_t i = 0; i < n_leaves; ++i) {
    const LeafRange& l = tree.leaves[i];
    leaves[i] = {l.first_face, l.first_edge, l.first_vertex,
                 (l.end_face - l.first_face) | (l.end_edge - l.first_edge) << 8 | (l.end_vertex - l.first_vertex) << 16};
  }
  const std::size_t n_edges = features_.edges.size(), n_faces = features_.faces.size(), n_vertices = features_.n_vertices;
  std::vector<DeviceBox> edge(n_edges), face(n_faces);
  for (std::size_t s = 0; s < n_edges; ++s) edge[s].tag_low = tree.edge_ends[0][s], edge[s].tag_high = tree.edge_ends[1][s];
  for (std::size_t s = 0; s < n_faces; ++s)
    face[s].tag_low = tree.face_corners[0][s], face[s].tag_high = tree.face_corners[1][s];
  upload(node_boxes_, boxes.data(), n);
  upload(node_mesh_, mesh.data(), n);
  upload(node_parent_, parent.data(), n);
  node_arrivals_.reserve(std::max<std::size_t>(n, 1));
  check(cudaMemset(node_arrivals_.data(), 0, node_arrivals_.bytes()), "cudaMemset");
  leaf_boxes_.reserve(std::max<std::size_t>(n_leaves, 1));
  upload(leaf_nodes_, tree.leaf_nodes.data(), n_leaves);
  upload(leaves_, leaves.data(), n_leaves);
  upload(vertex_of_slot_, tree.vertex_of_slot.data(), n_vertices);
  upload(edge_of_slot_, tree.edge_of_slot.data(), n_edges);
  upload(face_of_slot_, tree.face_of_slot.data(), n_faces);
  upload(face_corner2_, tree.face_corners[2].data(), n_faces);
  upload(edge_boxes_, edge.data(), n_edges);
  upload(face_boxes_, face.data(), n_faces);
  vertex_boxes_.reserve(std::max<std::size_t>(n_vertices, 1));
  rows_.reserve(std::max<std::size_t>(n_vertices, 1));
  n_nodes_ = static_cast<u32>(n), n_leaves_ = static_cast<u32>(n_leaves);
}

std::size_t DevicePipeline::device_bytes() const {
  std::size_t b = edges_.bytes() + faces_.bytes() + mesh_of_vertex_.bytes() + node_boxes_.bytes() + leaf_boxes_.bytes() +
                  edge_boxes_.bytes() + face_boxes_.bytes() + vertex_boxes_.bytes() + rows_.bytes() + leaf_pairs_.bytes() +
                  found_keys_.bytes() + sorted_keys_.bytes() + undecided_keys_.bytes() + found_tocs_.bytes() +
                  numbers_.bytes() + order_.bytes() + workspace_.bytes() + given_[0].bytes() + given_[1].bytes() +
                  leaves_.bytes() + vertex_of_slot_.bytes() + edge_of_slot_.bytes() + 2 * face_of_slot_.bytes();
  for (int k = 0; k < 2; ++k) b += survivors_[k].bytes() + single_[k].bytes() + many_[k].bytes();
  return b;
}

void DevicePipeline::reserve_found(std::size_t n) {
  if (n <= order_.size()) return;
  if (n > 0x7FFFFFFF) throw Error("more than 2^31 contacts; use backend=\"cpu\"");
  found_keys_.reserve(n);
  found_tocs_.reserve(n);
  sorted_keys_.reserve(n);
  numbers_.reserve(n);
  workspace_.reserve(sort_workspace(static_cast<int>(n), static_cast<int>(kind_shift_ + 1)));
  number_kernel<<<blocks_for(n, 256), 256, 0, stream_>>>(numbers_.data(), static_cast<u32>(n));
  check_launch("number_kernel");
  order_.reserve(n);  // last: its size says that all of these are there
}

// The caller's positions on the device, by way of page-locked memory: the driver's own way from pageable memory takes one
// thread 100 us a megabyte. Waking the pool costs as much as copying half a megabyte.
template <class T>
void DevicePipeline::bring(Positions t0, Positions t1, const T* given[2], ThreadPool& pool) {
  const Positions ends[2] = {t0, t1};
  const std::size_t bytes = 3 * t0.n * sizeof(T), words = std::max<std::size_t>((bytes + 7) / 8, 1);
  char* to[2] = {nullptr, nullptr};
  for (int i = 0; i < 2; ++i) {
    given[i] = static_cast<const T*>(ends[i].data);
    if (ends[i].on_device) continue;
    staging_[i].reserve(words);
    given_[i].reserve(words);
    to[i] = reinterpret_cast<char*>(staging_[i].data());
    given[i] = reinterpret_cast<const T*>(given_[i].data());
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
  f.n_vertices = features_.n_vertices;
  f.n_edges = static_cast<u32>(features_.edges.size());
  f.n_faces = features_.n_faces();
  f.edges = edges_.data(), f.faces = faces_.data(), f.mesh_of_vertex = mesh_of_vertex_.data();
  f.n_meshes = n_meshes_;
  f.enabled = all_enabled_ ? nullptr : enabled_.data();
  f.accuracy = one_accuracy_ ? nullptr : accuracy_.data();
  f.default_accuracy = default_accuracy_;
  f.key_shift = key_shift_, f.kind_shift = kind_shift_;
  f.n_nodes = n_nodes_, f.n_leaves = n_leaves_;
  f.node_boxes = node_boxes_.data(), f.node_mesh = node_mesh_.data(), f.node_parent = node_parent_.data();
  f.node_arrivals = node_arrivals_.data(), f.leaf_boxes = leaf_boxes_.data(), f.leaf_nodes = leaf_nodes_.data();
  f.leaves = leaves_.data(), f.vertex_of_slot = vertex_of_slot_.data(), f.edge_of_slot = edge_of_slot_.data();
  f.face_of_slot = face_of_slot_.data(), f.edge_boxes = edge_boxes_.data(), f.face_boxes = face_boxes_.data();
  f.face_corner2 = face_corner2_.data();
  const T* given[2];
  bring(t0, t1, given, pool);
  f.given_t0 = given[0], f.given_t1 = given[1];
  f.rows = reinterpret_cast<Row<T>*>(rows_.data()), f.vertex_boxes = vertex_boxes_.data();
  f.counters = counters_.data();
  return f;
}

template <class T>
void DevicePipeline::launch(Frame<T>& f) {
  const auto list = [](const DeviceBuffer<uint2>& b) { return PairList{b.data(), b.size()}; };
  f.leaf_pairs = list(leaf_pairs_);
  for (int k = 0; k < 2; ++k)
    f.survivors[k] = list(survivors_[k]), f.single[k] = list(single_[k]), f.many[k] = list(many_[k]);
  f.found_keys = found_keys_.data(), f.found_tocs = found_tocs_.data(), f.found_capacity = order_.size();
  f.undecided = undecided_keys_.data(), f.undecided_capacity = undecided_keys_.size();
  f.to_host = to_host_.data(), f.to_host_capacity = to_host_.size();
  f.n_segments = n_segments_;
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
  for (f.segment = 0; f.segment < n_segments_; ++f.segment) {
    persistent(candidates_kernel<T>, 32 * candidate_warps, f, "candidates_kernel");
    timer_.mark("candidates", stream_);
    persistent(projection_kernel<Kind::vertex_face, T>, 128, f, "projection_kernel");
    persistent(projection_kernel<Kind::edge_edge, T>, 128, f, "projection_kernel");
    timer_.mark("projection", stream_);
    persistent(roots_kernel<Kind::vertex_face, true, T>, 128, f, "roots_kernel");
    persistent(roots_kernel<Kind::edge_edge, true, T>, 128, f, "roots_kernel");
    timer_.mark("single_root", stream_);
    persistent(roots_kernel<Kind::vertex_face, false, T>, 128, f, "roots_kernel");
    persistent(roots_kernel<Kind::edge_edge, false, T>, 128, f, "roots_kernel");
    timer_.mark("many_roots", stream_);
    end_segment_kernel<<<1, 1, 0, stream_>>>(f);
    check_launch("end_segment_kernel");
  }
  last_resort_kernel<<<static_cast<unsigned>(2 * multiprocessors_), 32, 0, stream_>>>(f);
  check_launch("last_resort_kernel");
  timer_.mark("last_resort", stream_);
}

// Makes room where a list was too short. True where the frame must run again.
bool DevicePipeline::grow_overflowed() {
  const Counters& c = *host_counters_.data();
  bool again = false;
  const auto grow = [&](auto& buffer, u64 needed) {
    if (needed <= buffer.size()) return;
    again = true;
    if (needed <= most_listed)
      buffer.reserve(needed + needed / 4);
    else {
      buffer.reserve(most_listed);
      n_segments_ *= 2;  // one list may want this for several; the next pass shows
    }
  };
  if (c.leaf_pairs > leaf_pairs_.size()) {
    again = true;
    leaf_pairs_.reserve(c.leaf_pairs + c.leaf_pairs / 4);
  }
  for (int k = 0; k < 2; ++k) grow(survivors_[k], c.most_survivors), grow(single_[k], c.most_single), grow(many_[k], c.most_many);
  if (c.undecided > undecided_keys_.size()) {
    again = true;
    undecided_keys_.reserve(c.undecided + c.undecided / 4);
  }
  if (c.to_host > to_host_.size()) {
    again = true;
    to_host_.reserve(c.to_host + c.to_host / 4);
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
               order_.data(), static_cast<int>(n), static_cast<int>(kind_shift_ + 1), stream_);
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
  if (n_leaves_ == 0) {
    *host_counters_.data() = {};
    return true;
  }
  // The producer of device arrays may still be at work on a stream of its own.
  if (t0.on_device || t1.on_device) check(cudaDeviceSynchronize(), "cudaDeviceSynchronize");
  Frame<T> f = frame<T>(t0, t1, pool);
  timer_.mark("upload", stream_);
  for (bool again = true; again;) {
    ++passes_;
    launch(f);
    check(cudaMemcpyAsync(host_counters_.data(), counters_.data(), sizeof(Counters), cudaMemcpyDeviceToHost, stream_),
          "cudaMemcpyAsync");
    check(cudaEventRecord(counted_, stream_), "cudaEventRecord");
    check(cudaEventSynchronize(counted_), "cudaEventSynchronize");
    if (host_counters_.data()->bad) return false;
    again = grow_overflowed();
  }
  const Counters& c = *host_counters_.data();
  undecided_.reserve(c.to_host);
  const u64* keys = to_host_.data();
  const u64 n_to_host = c.to_host;
  launch_results(f);
  for (u64 i = 0; i < n_to_host; ++i) {
    const u64 features = keys[i] & ((u64{1} << kind_shift_) - 1);
    undecided_.push_back({static_cast<u32>(features >> key_shift_),
                          static_cast<u32>(features & ((u64{1} << key_shift_) - 1)),
                          keys[i] >> kind_shift_ ? Kind::edge_edge : Kind::vertex_face});
  }
  return true;
}

}  // namespace

std::unique_ptr<Pipeline> Pipeline::create(const Scene& scene, const Features& features, Accuracy accuracy, int device,
                                           bool time_stages) {
  if (status().devices.empty()) throw Error(status().reason);
  return std::make_unique<DevicePipeline>(scene, features, accuracy, device, time_stages);
}

}  // namespace hpccd::gpu
