// SPDX-License-Identifier: Apache-2.0
// Computes a step on CPU threads. Its parts are shared with the hybrid backend, whose devices take over the tests.
#pragma once

#include <memory>
#include <vector>

#include "backends/backend.h"
#include "backends/changed_pairs.h"
#include "backends/near_list.h"
#include "backends/resources.h"
#include "backends/shortening.h"
#include "backends/work_counts.h"
#include "backends/world_memory.h"
#include "bvh/placed_meshes.h"
#include "contacts/canonical.h"
#include "paper/method.h"
#include "solid/containment.h"
#include "solid/moved_pair.h"
#include "traverse/worker.h"

namespace hpccd {

class CpuBackend final : public DetectionBackend {
 public:
  explicit CpuBackend(Resources& shared);

  std::optional<Detection> detect(Positions t0, Positions t1) override;
  void count(std::map<std::string, std::uint64_t>& stats) const override;

  // By the default traversal, whatever the method is.
  std::optional<std::vector<double>> earliest(Positions t0, Positions t1) override;
  std::optional<CollisionFreeMotion> free_motion(Positions t0, Positions t1,
                                                 std::span<const std::int64_t> groups) override;
  std::optional<Contacts> proximity(Positions vertices, double distance) override;
  std::optional<Intersections> intersections(Positions vertices) override;
  std::optional<std::vector<Gap>> distances(Positions vertices) override;
  // Meshes at poses, all of which have a shape: by number of mesh. False where place() gives up (bvh/placed_meshes.h).
  // Then the queries without positions are those of these poses.
  bool place(std::span<const rigid::Pose> poses);
  Contacts proximity_at_poses(double distance);
  Intersections intersections_at_poses();
  std::vector<Gap> distances_at_poses();
  Vec3<double> position_at_poses(std::uint32_t vertex) const { return placed_->position(vertex); }
  const PlacedMeshes& placed_meshes() const { return *placed_; }
  std::optional<WindingNumbers> winding_numbers(Positions vertices, Positions points, std::uint32_t mesh) override;
  std::optional<SignedDistances> signed_distances(Positions vertices, Positions points, std::uint32_t mesh) override;
  std::optional<double> separating_translation(Positions vertices, std::array<std::uint32_t, 2> meshes,
                                               const Vec3<double>& direction) override;
  std::optional<Penetration> penetration(Positions vertices, std::array<std::uint32_t, 2> meshes,
                                         const std::optional<Vec3<double>>& start) override;

  // For several worlds: at the beginning of a call, and before and after each world. count() covers all worlds since
  // then.
  void begin_worlds();
  void begin_world(WorldMemory& memory, TreeBudget& trees);
  void end_world(WorldMemory& memory);

  // Called in this order in each step; the workers hold the contacts until they are collected. Devices find all
  // contacts, and test "fast" as "balanced": beside devices the CPU does the same.
  enum class Tests : bool { all_here, beside_devices };
  void update(Positions t0, Positions t1, Tests tests);
  void traverse();
  Contacts collect();

  // Runs the elementary tests of pairs of leaves from a traversal, of the tree or of a published method's hierarchy.
  void test(const std::vector<LeafPair>& pairs);
  void test_leaves_of_tree(const std::vector<LeafPair>& pairs);
  bool walks_tree() const { return method_ == nullptr; }
  std::vector<Worker>& workers() { return workers_; }

 private:
  // What a query of one snapshot searches.
  struct Snapshot {
    const Tree& tree;
    const MotionBounds& motion;
    PlacedMeshes* placed = nullptr;  // of meshes at poses
  };
  Snapshot fitted() const { return {shared_.tree.tree(), shared_.tree.motion()}; }
  Snapshot at_poses() { return {placed_->tree(), placed_->snapshot(), placed_.get()}; }
  Contacts proximity(const Snapshot& snapshot, double distance);
  Intersections intersections(const Snapshot& snapshot);
  std::vector<Gap> distances(const Snapshot& snapshot);
  void begin(SnapshotSearch& search, const Snapshot& snapshot) const;
  void test_last_nearest(DistanceSearch& search, PlacedMeshes& placed);
  void begin(Search& search) const;
  void begin(Search& search, const MotionBounds& motion) const;
  void find_earliest(Positions t0, Positions t1, bool time_only);
  void begin_earliest(Positions t0, Positions t1, bool time_only);
  bool answer_from_near_pairs();
  bool list_near_pairs(Positions t0);
  void test_groups(const std::vector<NearList::Group>& groups);
  void limit_boxes();
  bool answer_from_unlisted_pairs(bool time_only);
  std::optional<double> wide_radius();
  void update_drift();
  std::optional<std::vector<LeafPair>> open_pairs();
  void remember_earliest();
  bool shorten_to_rest(Positions t0, Shortening& motion);
  void search_whole_ways(Positions t0, Positions t1);
  std::span<const Shortening::Touching> touching(Positions t0, Positions t1);
  void begin_motion(Positions t0, Positions t1, Tests tests);
  void begin_motion(Positions t0, Positions t1, Tests tests, MovingTree& tree);
  void begin_proximity(Positions vertices, double distance, ProximitySearch& search);
  void fit_snapshot(Positions vertices, double distance = 0);
  MovedPair moved_pair(Positions vertices, std::array<std::uint32_t, 2> meshes);
  void walk_tree(Search& search);
  template <class Test>
  void test_each(const std::vector<LeafPair>& pairs, Test&& test);
  void mark_traversal();
  WorkCounts last_counts() const;
  Contacts collect(const Search& search, Outputs outputs);

  Resources& shared_;
  ThreadPool one_thread_{1};
  std::unique_ptr<paper::MethodEngine> method_;  // published method; null for the default traversal
  const std::vector<Box>* swept_ = nullptr;      // for a published method
  std::vector<Worker> workers_;
  std::optional<ContactSearch> search_;  // of the last motion
  WorkCounts counts_;                    // counts of the last query, without its numbers
  ContactOrder order_;
  NearList near_;  // for the earliest contacts of motions that begin alike
  Drift drift_;    // of the snapshot of the list
  Travel travel_;  // of the motion, relative to the list
  // For motions that are shortened; created by the first.
  struct WholeWays {
    WholeWays(const Scene& scene, const Features& features, ThreadPool& pool)
        : tree(scene, features, pool, true), pairs(features) {}
    MovingTree tree;  // by bounds of whole ways
    ChangedPairs pairs;
  };
  std::unique_ptr<WholeWays> whole_;
  std::vector<Shortening::Touching> touching_;
  std::vector<std::optional<MeshTopology>> topologies_;  // by mesh, each created by the first query that needs it
  // Created by the first search for smallest distances.
  std::optional<MeshPairs> mesh_pairs_;
  std::optional<Containment> containment_;
  ContainmentMemory contained_;
  std::unique_ptr<PlacedMeshes> placed_;   // created by the first query with poses
  std::vector<NearestPair> last_nearest_;  // of that query, by number of the pair of meshes
  // The start of the drift: the numbers of that snapshot and of the tree.
  std::optional<std::pair<std::uint64_t, std::uint64_t>> drift_of_;
  // Kept after a cancelled call: returning the memory of 10 million contacts to the system takes longer than ending the
  // call.
  Contacts contacts_;
  std::optional<WorkCounts> counts_of_worlds_;  // null for a detector of one world
};

}  // namespace hpccd
