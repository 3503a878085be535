// SPDX-License-Identifier: Apache-2.0
// Computes a whole step on one GPU, with the CPU's exact fallback for undecided pairs.
#pragma once

#include <compare>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "backends/backend.h"
#include "backends/gpu_contacts.h"
#include "backends/near_list.h"
#include "backends/resources.h"
#include "backends/world_positions.h"
#include "gpu/device.h"
#include "gpu/pipeline.h"
#include "gpu/placed_search.h"
#include "solid/containment.h"
#include "traverse/mesh_pairs.h"
#include "traverse/nearest_pairs.h"

namespace hpccd {

class GpuBackend final : public DetectionBackend {
 public:
  explicit GpuBackend(Resources& shared) : shared_(shared) {}

  std::optional<Detection> detect(Positions t0, Positions t1) override;
  void count(std::map<std::string, std::uint64_t>& stats) const override;
  std::optional<std::vector<double>> earliest(Positions t0, Positions t1) override;
  std::optional<Contacts> proximity(Positions vertices, double distance) override;
  std::optional<Intersections> intersections(Positions vertices) override;
  // For one world.
  std::optional<WindingNumbers> winding_numbers(Positions vertices, Positions points, std::uint32_t mesh) override;
  std::optional<std::vector<Gap>> distances(Positions vertices) override;
  // The same for meshes where they are placed now: the same object in every call.
  std::optional<std::vector<Gap>> distances_at_poses(const PlacedMeshes& placed);
  std::optional<SignedDistances> signed_distances(Positions vertices, Positions points, std::uint32_t mesh) override;
  // As detect, for one world, without points and normals: rows in the memory that the device has written. If there are
  // none after all, they are in `contacts`. Nothing if the device failed.
  std::optional<Detected> detect_in_place(Positions t0, Positions t1);
  // The same for results that stay on the device.
  std::optional<DeviceResults> detect_on_device(Positions t0, Positions t1);
  std::optional<DeviceResults> proximity_on_device(Positions vertices, double distance);
  std::optional<DeviceResults> intersections_on_device(Positions vertices);
  // The same as a prepared detection, for positions on the device: a pipeline of its own, which refers to the data of
  // the backend. Throws gpu::Error.
  struct Prepared {
    std::unique_ptr<gpu::Pipeline> pipeline;
    PreparedResults results;
  };
  Prepared prepare(Positions t0, Positions t1, double room);
  void add_stages(std::map<std::string, double>& stages) const override;

  // Host arrays with the same positions. which: 0 or 1, the buffer for the copy.
  Positions on_host(Positions p, int which);

  // Why the backend does not support these options; empty if it does.
  static std::string unsupported(const Options& options);

 private:
  // The kind of boxes to which a tree is refitted: boxes of a query, the distance by which they are grown (growth_of),
  // and whether they reach up to the best time so far.
  struct Boxes {
    gpu::Query query;
    int growth;
    bool until_best;
    auto operator<=>(const Boxes&) const = default;
  };

  template <class Compute>
  auto attempt(Compute&& compute) -> std::optional<decltype(compute())>;
  std::size_t n_worlds() const { return shared_.options.worlds; }
  Positions of_world(Positions all, std::size_t world) const {
    return hpccd::of_world(all, shared_.features.n_vertices, world);
  }
  template <class Function>
  void in_world(std::size_t world, Function&& f) const;
  template <class Function>
  void each_world(Function&& f) const;
  std::size_t world_of(const Candidate& pair) const;
  Candidate in_its_world(Candidate pair) const;
  Separations within(double distance) const;
  UndecidedPair undecided(const Separations& separations, const Candidate& pair, Positions t0, Positions t1) const;
  void require_rest(Positions t0, Positions t1) const;
  void run_contacts(Positions t0, Positions t1);
  Contacts contacts(Positions t0, Positions t1);
  double earliest_time(Positions t0, Positions t1);
  std::vector<double> earliest_times(Positions t0, Positions t1);
  double run_for_earliest(Positions t0, Positions t1, gpu::Pipeline::Pairs pairs, gpu::Pipeline::Best best);
  bool list_near_pairs(Positions t0, double time, const Travel& travel);
  Travel travel_of_frame() const;
  void prepare_motion(Positions t0, Positions t1, bool until_best);
  void require_good(bool good, Positions t0, Positions t1);
  void decide_motion(Positions t0, Positions t1, std::optional<double> until);
  void run_near_pairs(Positions vertices, double distance);
  Contacts near_pairs(Positions vertices, double distance);
  void run_pierced_faces(Positions vertices);
  Intersections pierced_faces(Positions vertices);
  std::vector<gpu::PointOnFace> locate(Positions vertices, Positions points, std::uint32_t mesh, bool with_distances);
  template <class Decide>
  void on_cpu(Positions vertices, Positions points, std::uint32_t mesh, const std::vector<std::size_t>& open,
              Decide&& decide);
  [[noreturn]] void throw_bad_snapshot(Positions vertices);
  void prepare_snapshot(gpu::Query query, Positions vertices, double distance);
  void run_snapshot(gpu::Query query, Positions vertices, double distance);
  template <class Bound>
  void prepare(Boxes boxes, Bound&& bound);
  bool worn_out_on_device();
  template <class Decide>
  void decide(Decide&& decide);
  gpu::FrameResult finish();
  gpu::FrameResult finish_on_device();
  Contacts finish_on_host(Report report);
  DeviceResults on_device(const gpu::FrameResult& found);
  DeviceResults with_places(gpu::FrameResult found, Outputs outputs, const Separations& separations, Positions t0,
                            Positions t1);
  void add_places(DeviceResults& found, Outputs outputs, const Separations& separations, Positions t0, Positions t1);
  void add_places(Contacts& found, Outputs outputs, const Separations& separations, Positions t0, Positions t1);
  Accuracy accuracy_of(const Candidate& pair) const;

  Resources& shared_;
  std::unique_ptr<gpu::Pipeline> pipeline_;
  bool has_tree_ = false;
  // The device's measure of the tree when it first refitted it to such boxes.
  std::map<Boxes, double> area_when_built_;
  double looseness_when_built_ = 0;
  Boxes last_boxes_;
  DecidedContacts decided_;
  NearRadius near_;                  // of the pipeline's near list; its edge length when the tree was built
  std::uint64_t places_on_cpu_ = 0;  // rows with points or normals computed by the CPU, for results on the device
  std::vector<unsigned char> downloaded_[2];

  // For distances; created by the first query.
  void prepare_distances();
  // False if the search is left to the CPU: there is nothing to search, or too much.
  bool find_gaps(Positions vertices, std::vector<Gap>& gaps);
  bool find_gaps(const PlacedMeshes& placed, std::vector<Gap>& gaps);
  bool can_search() const;
  std::vector<NearestPair> collect_gaps(const gpu::NearestPairsFound& found, std::vector<Gap>& gaps);
  void subtract_thickness(std::vector<Gap>& gaps, const std::vector<NearestPair>& nearest) const;
  NearestPair decide_nearest(const gpu::UndecidedNearest& pair, double limit) const;
  void decide_containment(std::vector<Gap>& gaps, const std::vector<gpu::NearestOfMeshes>& nearest, Positions vertices);
  std::optional<MeshPairs> mesh_pairs_;
  std::optional<Containment> containment_;
  std::vector<ContainmentMemory> contained_;  // by world
  std::vector<gpu::PairToSearch> pairs_to_search_;
  std::uint64_t version_of_pairs_ = 0;  // that of the thickness
  std::uint64_t nearest_decided_ = 0;   // pairs that the CPU decided
  std::unique_ptr<gpu::PlacedSearch> placed_search_;
  bool at_poses_ = false;  // the last query
};

}  // namespace hpccd
