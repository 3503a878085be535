// SPDX-License-Identifier: Apache-2.0
// The detector: queries of one scene.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
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
/// while t goes from 0 to 1 (Kim et al. 2009, section 3.1). Touching counts; a contact at t = 0 has time 0. Features
/// that share a vertex are never paired.
///
/// A detector keeps its memory from call to call, so use one detector for all steps of a scene.
///
/// Threads: a detector runs one call at a time; concurrent calls wait for each other. For parallel calls use one
/// detector per thread; they may share a scene. Only cancel(), busy(), scene(), options() and last_backend() never
/// wait. A child process created by fork() has none of a detector's threads: queries throw std::runtime_error there,
/// unless the detector has one thread and was in no call. It may be destroyed.
///
/// Errors: every query throws InvalidArgument if the number, type or values of positions are invalid (see Positions),
/// and Cancelled after cancel(). The detector remains usable after InvalidArgument and after std::bad_alloc; after the
/// latter the next call takes as long as a first one. A failure of a GPU is not an error: the CPU computes the step,
/// and last_gpu_error() returns the cause.
class HPCCD_API Detector {
 public:
  /// Throws InvalidArgument if the scene is null or an option is invalid, and std::runtime_error if the system cannot
  /// start the threads.
  Detector(std::shared_ptr<const Scene> scene, Options options);
  /// Must not be called while a query is running.
  ~Detector();
  Detector(const Detector&) = delete;
  Detector& operator=(const Detector&) = delete;

  /// Contacts of the motion, as selected by Options::report.
  Contacts detect(Positions vertices_t0, Positions vertices_t1);
  /// The same, without a copy of rows that a GPU has written. Like detect, proximity and intersections, throws
  /// InvalidArgument if results stay on the device.
  Detected detect_in_place(Positions vertices_t0, Positions vertices_t1);

  /// The largest part of the motion, in [0, 1], that is certainly free of contacts, whatever Options::report is. At the
  /// tiers exact and conservative it never exceeds the true time of impact and is at most 1e-9 smaller; at the others
  /// it is the earliest time found. 1 only without contacts: less if one comes at the end. For several worlds, the
  /// minimum of all.
  double collision_free_step(Positions vertices_t0, Positions vertices_t1);
  /// The same for each world.
  std::vector<double> collision_free_steps(Positions vertices_t0, Positions vertices_t1);

  /// A motion without contacts, in which each vertex keeps its own part of the given motion; whatever Options::report
  /// is. No part is less than 0.9 times collision_free_step, unless no such position exists after rounding. groups: by
  /// vertex of one world, -1 or a number >= 0; vertices with the same number share a factor. Empty: none do. Throws
  /// InvalidArgument for groups of another length or below -1.
  CollisionFreeMotion collision_free_motion(Positions vertices_t0, Positions vertices_t1,
                                            std::span<const std::int64_t> groups = {});

  /// Vertex-face and edge-edge pairs within a Euclidean distance, in units of the coordinates. Throws InvalidArgument
  /// unless distance is finite and >= 0.
  Proximity proximity(Positions vertices, double distance);
  /// Edges and faces that share a point but no vertex, coplanar pairs included.
  Intersections intersections(Positions vertices);
  /// The smallest distance of each enabled pair of meshes, sorted by (mesh_a, mesh_b), with mesh_a <= mesh_b, and
  /// whether one lies inside the other. Of several pairs of features with the same distance (as a double), the first in
  /// canonical order is returned. For several worlds, all pairs of the first world, then all of the second, and so on.
  std::vector<Gap> distances(Positions vertices);

  /// The same queries for meshes with a shape (Scene::set_shape), at poses: bit-identical to those of positions_at. If
  /// all meshes have a shape, a call costs nothing per vertex: nothing is refitted, and only what the search reaches is
  /// computed, on the CPU, or by distances_at with Backend::gpu on the GPU. Not so with planes, with several worlds, or
  /// where features are below a 100,000th of the scene: then the call computes all positions. poses: of the meshes with
  /// a shape that are not static, in the order added; those of the first world first; none: the identity. others:
  /// positions of the meshes without a shape, in their order, on the host. Also throws InvalidArgument if the number of
  /// poses is another one, if a pose is not finite, or if a quaternion is not of length 1 within 1e-3.
  Proximity proximity_at(std::span<const Pose> poses, double distance, Positions others = {});
  Intersections intersections_at(std::span<const Pose> poses, Positions others = {});
  std::vector<Gap> distances_at(std::span<const Pose> poses, Positions others = {});
  /// The positions of all vertices at these poses, x y z, for all other queries: those of a shape in double precision,
  /// by the matrix of the quaternion. An identity returns the shape itself.
  std::vector<double> positions_at(std::span<const Pose> poses, Positions others = {});

  /// Winding numbers of points with respect to a mesh, exact at every accuracy. `points`: the same number for each
  /// world, those of the first world first. Throws InvalidArgument if the mesh is unknown, has no faces or is not
  /// closed: each edge of its faces must be in exactly two of them, in opposite directions.
  WindingNumbers winding_numbers(Positions vertices, Positions points, std::uint32_t mesh);
  /// Signed distances of points to a mesh. Signs are exact; distances have errors of at most 1e-12 of the largest
  /// distance of the point from the mesh. Arguments and errors as winding_numbers.
  SignedDistances signed_distances(Positions vertices, Positions points, std::uint32_t mesh);
  /// The least s >= 0 such that mesh_a, moved by s along direction, is free of mesh_b: neither meets it nor
  /// is inside it, if it is closed, nor contains it, if itself is closed. They may touch at s. Counts all faces of the
  /// two meshes, whether or not the scene enables the pair, and no separations. On the CPU. Throws InvalidArgument if a
  /// number is unknown or given twice, a mesh has no faces, the direction is zero or not finite, or for several worlds.
  double separating_translation(Positions vertices, std::uint32_t mesh_a, std::uint32_t mesh_b,
                                const std::array<double, 3>& direction);
  /// A short translation of mesh_a that frees it of mesh_b, in the sense of separating_translation: certainly free if
  /// the positions of mesh_a plus the translation are rounded to doubles. Not always the shortest; lower_bound is the
  /// depth of the deepest vertex of either mesh inside the other one, if that is closed. start: a translation near
  /// which to search, as that of the frame before, instead of in all directions. The result depends on the arguments
  /// only. Meshes and errors as separating_translation; also throws InvalidArgument if start is not finite.
  Penetration penetration(Positions vertices, std::uint32_t mesh_a, std::uint32_t mesh_b,
                          const std::optional<std::array<double, 3>>& start = {});

  /// As detect, proximity and intersections, with results on the device. Throws InvalidArgument unless
  /// Options::results_on_device is set. If the device fails, the CPU computes the results and they are copied to the
  /// device; throws std::runtime_error if that fails too.
  DeviceResults detect_on_device(Positions vertices_t0, Positions vertices_t1);
  DeviceResults proximity_on_device(Positions vertices, double distance);
  DeviceResults intersections_on_device(Positions vertices);
  /// A detection on fixed device arrays that a CUDA graph can contain. Its lists and rows have `room` times, 1 to 1000,
  /// the size that the present motion in the arrays needs. Throws std::runtime_error if the device fails.
  std::unique_ptr<PreparedDetection> prepare(Positions vertices_t0, Positions vertices_t1, double room);

  /// As Scene::set_separation, from the next call on. Nothing is rebuilt.
  void set_separation(std::uint32_t mesh_a, std::uint32_t mesh_b, double separation);
  /// Sets the separations of all pairs of n meshes: a symmetric n x n matrix, row by row.
  void set_separations(std::span<const double> of_pairs);
  /// As Scene::set_thickness, from the next call on. Nothing is rebuilt.
  void set_thickness(std::uint32_t mesh, std::span<const double> thickness);
  /// Changes a plane from the next call on, by its number from Scene::add_plane.
  void set_plane(std::uint32_t plane, const Plane& value);

  /// Cancels the detector: a running query, waiting ones and all later ones throw Cancelled, within 10 ms. Work that is
  /// already on a GPU runs to its end first. Thread-safe; does not wait.
  void cancel();

  // Data of the last call; these wait for a running one. They may be empty or incomplete after a call that has thrown.
  std::map<std::string, double> profile() const;       ///< stage -> ms, with "total" and the remainder "other"
  std::map<std::string, std::uint64_t> stats() const;  ///< counts of pairs, tests, contacts, bytes
  std::string last_gpu_error() const;                  ///< why the CPU computed a step for the GPU, or ""
  // These never wait.
  bool busy() const;               ///< whether a call of another thread is running
  const Scene& scene() const;      ///< the scene that was given
  const Options& options() const;  ///< with the threads and instruction set in use
  Backend last_backend() const;    ///< backend of the last step

 private:
  struct HPCCD_HIDDEN Impl;
  std::shared_ptr<Impl> impl_;  // shared with prepared detections
};

}  // namespace v0_1
}  // namespace hpccd
