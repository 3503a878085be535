// SPDX-License-Identifier: Apache-2.0
#include "gpu/device_nearest.cuh"
#include "gpu/device_scene.cuh"
#include "gpu/device_tree.cuh"
#include "gpu/placed_params.cuh"
#include "gpu/placed_search.h"

namespace hpccd::gpu {
namespace {

class PlacedSearchOnDevice : public PlacedSearch {
 public:
  PlacedSearchOnDevice(const Scene& scene, const Features& features, const Options& options,
                       const SeparationTable& separations, const ThicknessTable& thickness, const FeatureFilter& filter,
                       const PlacedMeshes& placed, int device)
      : device_((check(cudaSetDevice(device), "cudaSetDevice"), device)),
        timer_(options.gpu_stages),
        placed_(placed),
        scene_(scene, features, options.accuracy, options.features, separations, thickness, filter, 1) {
    check(cudaDeviceGetAttribute(&multiprocessors_, cudaDevAttrMultiProcessorCount, device), "cudaDeviceGetAttribute");
    tree_.set(features, placed.tree());
    nearest_.set(placed.tree());
    upload_boxes();
    upload_shapes(scene);
    const std::size_t n_meshes = placed.meshes().size();
    meshes_.reserve(std::max<std::size_t>(n_meshes, 1)), host_meshes_.reserve(std::max<std::size_t>(n_meshes, 1));
    counters_.reserve(1);
    check(cudaMemset(counters_.data(), 0, counters_.bytes()), "cudaMemset");  // nothing is bad: place() has checked
  }

  ~PlacedSearchOnDevice() override {
    const CallersDevice callers;
    cudaSetDevice(device_);
    cudaStreamSynchronize(stream_);
  }

  NearestPairsFound find_nearest(const std::vector<PairToSearch>& pairs, std::uint64_t version) override {
    check(cudaSetDevice(device_), "cudaSetDevice");
    // Work of a failed call may still be using these buffers.
    check(cudaStreamSynchronize(stream_), "cudaStreamSynchronize");
    scene_.update_separations();
    timer_.begin(stream_);
    const LaunchParams<AtPoses> params = params_now();
    timer_.mark("upload", stream_);
    for (passes_ = 1;; ++passes_) {
      NearestTask task = nearest_.task(pairs, version, params);
      task.thickness = scene_.thickness();
      launch_nearest(params, task, nearest_.levels(), nearest_.within_meshes(), {multiprocessors_, stream_, timer_});
      nearest_.copy_results(task, stream_);
      check(cudaStreamSynchronize(stream_), "cudaStreamSynchronize");
      NearestPairsFound r;
      const DeviceNearest::Room room = nearest_.grow();
      r.gave_up = room == DeviceNearest::Room::too_little;
      if (r.gave_up) return r;
      if (room == DeviceNearest::Room::enough) return nearest_.found(task, stream_);
    }
  }

  std::map<std::string, std::uint64_t> stats() const override {
    return {{"leaf_pairs", nearest_.counters().leaves},
            {"candidates", nearest_.counters().tests},
            {"gpu_passes", passes_},
            {"bytes", placed_.bytes()},
            {"gpu_bytes",
             scene_.bytes() + tree_.bytes() + nearest_.bytes() + boxes_.bytes() + shapes_.bytes() + meshes_.bytes()}};
  }
  std::map<std::string, double> stages() const override { return timer_.stages(); }

 private:
  void upload_boxes() {
    const std::vector<Node>& nodes = placed_.tree().nodes;
    std::vector<LocalBox> boxes(nodes.size());
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      if (nodes[i].mesh == mixed_meshes) continue;  // above the roots of the meshes, where searches begin
      const Box& b = placed_.local_boxes()[i];
      boxes[i] = {{b.low[0], b.low[1], b.low[2]}, nodes[i].mesh, {b.high[0], b.high[1], b.high[2]}, 0};
    }
    upload(boxes_, boxes.data(), boxes.size());
  }
  void upload_shapes(const Scene& scene) {
    shapes_.reserve(std::max<std::size_t>(3 * std::size_t{scene.n_vertices()}, 1));
    for (const Scene::Mesh& mesh : scene.meshes())
      if (mesh.shape && !mesh.shape->empty())
        check(cudaMemcpy(shapes_.data() + 3 * std::size_t{mesh.first_vertex}, mesh.shape->data(),
                         mesh.shape->size() * sizeof(double), cudaMemcpyHostToDevice),
              "cudaMemcpy");
  }

  LaunchParams<AtPoses> params_now() {
    const std::vector<PlacedMeshes::Placed>& meshes = placed_.meshes();
    for (std::size_t m = 0; m < meshes.size(); ++m) host_meshes_.data()[m] = MeshAtPose::of(meshes[m]);
    check(cudaMemcpyAsync(meshes_.data(), host_meshes_.data(), meshes.size() * sizeof(MeshAtPose),
                          cudaMemcpyHostToDevice, stream_),
          "cudaMemcpyAsync");
    LaunchParams<AtPoses> params{};
    scene_.fill(params);
    tree_.fill(params);
    params.counters = counters_.data();
    params.local_boxes = boxes_.data(), params.meshes = meshes_.data(), params.shapes = shapes_.data();
    params.map = placed_.snapshot().map, params.sums = 2 * placed_.snapshot().rounding;
    return params;
  }

  const int device_;
  int multiprocessors_ = 1;
  Stream stream_;
  StageTimer timer_;
  const PlacedMeshes& placed_;
  DeviceScene scene_;
  DeviceTree tree_{0};  // without boxes in any world
  DeviceNearest nearest_{1};
  DeviceBuffer<LocalBox> boxes_;
  DeviceBuffer<double> shapes_;
  DeviceBuffer<MeshAtPose> meshes_;
  PinnedBuffer<MeshAtPose> host_meshes_;
  DeviceBuffer<Counters> counters_;
  u64 passes_ = 0;
};

}  // namespace

std::unique_ptr<PlacedSearch> PlacedSearch::create(const Scene& scene, const Features& features, const Options& options,
                                                   const SeparationTable& separations, const ThicknessTable& thickness,
                                                   const FeatureFilter& filter, const PlacedMeshes& placed,
                                                   int device) {
  if (status().devices.empty()) throw Error(status().reason);
  return std::make_unique<PlacedSearchOnDevice>(scene, features, options, separations, thickness, filter, placed,
                                                device);
}

}  // namespace hpccd::gpu
