// SPDX-License-Identifier: Apache-2.0
// Answers for one scene in motion.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "hpccd/export.h"
#include "hpccd/options.h"
#include "hpccd/positions.h"
#include "hpccd/prepared.h"
#include "hpccd/results.h"
#include "hpccd/scene.h"

namespace hpccd {
inline namespace v0_1 {

/// Continuous collision detection of a scene whose vertices move on straight lines from `vertices_t0` to `vertices_t1`
/// while t goes from 0 to 1 (Kim et al. 2009, section 3.1). Touching counts; what touches at t = 0 has time 0. Features
/// that share a vertex are no pair.
///
/// All memory that the steps need is kept from call to call, so use one detector for all steps of a scene.
///
/// Threads: one call at a time; of those that several threads make of one detector, each waits until the one before has
/// ended. Threads that are to work side by side need a detector each; the scene may be the same. Only cancel(),
/// options() and last_backend() do not wait. A child made by fork() has none of a detector's threads: its queries throw
/// std::runtime_error there unless it has one thread only and was in no call; it may be destroyed.
///
/// Errors: every query throws InvalidArgument for positions whose number, type or values will not do (see Positions),
/// and Cancelled after cancel(). The detector can be used on after the former, and after std::bad_alloc, when the next
/// call takes as long as a first one.
/// Failures of a GPU are no errors: the step is computed on the CPU, and last_gpu_error() tells why.
class HPCCD_API Detector {
 public:
  /// Throws InvalidArgument for a null scene and an option that will not do here, std::runtime_error where the system
  /// starts fewer threads.
  Detector(std::shared_ptr<const Scene> scene, Options options);
  /// Waits for no call: destroy it when none is under way.
  ~Detector();
  Detector(const Detector&) = delete;
  Detector& operator=(const Detector&) = delete;

  /// All contacts of the motion, or those that Options::report wants.
  Contacts detect(Positions vertices_t0, Positions vertices_t1);
  /// The same, without a copy where there need be none. Both refuse, as proximity and intersections do, a detector
  /// whose results stay on the device.
  Detected detect_in_place(Positions vertices_t0, Positions vertices_t1);

  /// The largest part of the motion, in [0, 1], that is certainly free of contacts, whatever Options::report says: at
  /// the tiers exact and conservative never beyond the earliest one and at most 1e-9 before it, else that of the
  /// earliest one found. 1 where nothing touches. Of several worlds: of all of them.
  double collision_free_step(Positions vertices_t0, Positions vertices_t1);
  /// The same of each world by itself.
  std::vector<double> collision_free_steps(Positions vertices_t0, Positions vertices_t1);

  /// Vertex-face and edge-edge pairs within this distance of each other, Euclidean, between closed features, in units
  /// of the coordinates. Finite, >= 0, else InvalidArgument.
  Proximity proximity(Positions vertices, double distance);
  /// Edges and faces that share a point but no vertex.
  Intersections intersections(Positions vertices);
  /// The smallest distance of each enabled pair of meshes, by (mesh_a, mesh_b), mesh_a <= mesh_b. Of pairs of features
  /// whose distances are the same double the first in order, vertex-face before edge-edge. Of several worlds those of
  /// the first, then those of the second, ...: as many of each.
  std::vector<Gap> distances(Positions vertices);

  /// The same as the ones without _on_device, of a detector whose Options::results_on_device says so, else
  /// InvalidArgument. What the CPU had to compute, after a failure of the device, is brought there. Throws
  /// std::runtime_error where that fails too.
  DeviceResults detect_on_device(Positions vertices_t0, Positions vertices_t1);
  DeviceResults proximity_on_device(Positions vertices, double distance);
  DeviceResults intersections_on_device(Positions vertices);
  /// For detect_on_device() of arrays on the device that stay where they are, without a look from the host: with room
  /// for `room` times, 1 to 1000, what the motion that they hold now takes. Throws InvalidArgument where outputs were
  /// asked for, std::runtime_error where the device fails.
  std::unique_ptr<PreparedDetection> prepare(Positions vertices_t0, Positions vertices_t1, double room);

  /// As Scene::set_separation, from the next call on, which fits its boxes to it as to any motion.
  void set_separation(std::uint32_t mesh_a, std::uint32_t mesh_b, double separation);
  /// Of all pairs of n meshes at once: n * n numbers, row by row; those of a pair are the same in both places.
  void set_separations(std::span<const double> of_pairs);

  /// From any thread, without waiting: a query under way, those that wait for it, and all later ones throw Cancelled,
  /// within 10 ms. What is on a GPU already comes to its end first.
  void cancel();

  // Of the last call; while one is under way, of that one when it has ended. Empty, or less, after one that has thrown.
  std::map<std::string, double> profile() const;       ///< stage -> ms, with "total" and the remainder
  std::map<std::string, std::uint64_t> stats() const;  ///< counts of pairs, tests, contacts, bytes
  std::string last_gpu_error() const;                  ///< why a step meant for the GPU was computed on the CPU, or ""
  // These do not wait.
  bool busy() const;               ///< whether the others would wait now, for a call of another thread
  const Options& options() const;  ///< with the number of threads and the instruction set that were chosen
  Backend last_backend() const;    ///< where the last step was computed

 private:
  struct HPCCD_HIDDEN Impl;
  std::shared_ptr<Impl> impl_;  // also of what it has prepared
};

}  // namespace v0_1
}  // namespace hpccd
