// SPDX-License-Identifier: Apache-2.0
// A whole frame on one GPU: bounds, refit, traversal, filters, elementary tests, sorted contacts. Only positions are
// transferred to the device and only contacts back, with the pairs that neither the device nor the tier's error bounds
// can decide.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/vec3.h"
#include "bvh/tree.h"
#include "contacts/outputs.h"
#include "elementary/pair.h"
#include "gpu/nearest.h"
#include "gpu/places.h"
#include "gpu/query.h"
#include "hpccd/hpccd.h"
#include "hpccd/prepared.h"
#include "scene/feature_filter.h"
#include "scene/features.h"
#include "scene/separation_table.h"
#include "scene/thickness.h"

namespace hpccd::gpu {

// The results of a frame, in page-locked memory or on the device: valid while that memory is held, or, if there is
// none, until the next frame.
struct FrameResult {
  std::shared_ptr<const void> memory;
  std::uint64_t n_vf = 0, n_ee = 0;
  const std::array<std::uint32_t, 2>* vf = nullptr;  // in canonical order
  const std::array<std::uint32_t, 4>* ee = nullptr;
  const double* toc = nullptr;  // vertex-face, then edge-edge; distances for a snapshot
  std::uint64_t n_ef = 0;
  const std::array<std::uint32_t, 3>* ef = nullptr;  // for edge-face queries only
  std::uint64_t hash = 0;
  double first_toc = std::numeric_limits<double>::infinity();
  // For each row of vf, then of ee, as far as requested.
  const double *points = nullptr, *normals = nullptr, *closest = nullptr, *weights = nullptr, *approach = nullptr;
  const std::array<std::uint32_t, 4>* vertices = nullptr;
  // For several worlds (WorldSlices, Contacts::first_tocs).
  const std::uint64_t *vf_offsets = nullptr, *ee_offsets = nullptr, *ef_offsets = nullptr, *hashes = nullptr;
  const double* first_tocs = nullptr;
};

// The earliest time of a frame without undecided pairs, and how far its vertices are from the near list's snapshot and
// how far they move, along an axis.
struct EarliestTime {
  double time, away, way;
};

// A point and a closed mesh. Where only integers can decide, or the surface contains the point, a value is undecided.
inline constexpr std::int32_t undecided_winding = std::numeric_limits<std::int32_t>::min();
inline constexpr double undecided_distance = -1;
struct PointOnFace {
  double distance;  // not signed
  Vec3<double> closest;
  std::uint32_t face;
  std::int32_t winding;
};

class Pipeline {
 public:
  // Throws Error if the device has not enough memory, or if the scene has too many features for 31-bit numbers.
  // Separations may change between frames.
  static std::unique_ptr<Pipeline> create(const Scene& scene, const Features& features, const Options& options,
                                          const SeparationTable& separations, const ThicknessTable& thickness,
                                          const FeatureFilter& filter, int device);
  virtual ~Pipeline() = default;

  // Sets the tree whose boxes are refitted in every frame.
  virtual void set_tree(const Tree& tree) = 0;

  // A time after which contacts do not matter. If it is given, contacts after the earliest one do not matter either.
  // Only if all tiers promise times.
  using Best = std::optional<double>;
  // Runs all stages up to the undecided pairs; the caller may change host arrays only after finish(). Returns false if
  // a coordinate is not finite or too large.
  virtual bool run(Positions t0, Positions t1, Best best, ThreadPool& pool) = 0;
  // The same for one snapshot. distance: for proximity.
  virtual bool run_snapshot(Query query, Positions vertices, double distance, ThreadPool& pool) = 0;
  // Winding numbers of points on the host around a closed mesh of a snapshot, for one world, and with_distances where
  // the mesh is nearest. Nothing if a coordinate of a vertex is not finite or too large.
  virtual std::optional<std::vector<PointOnFace>> locate_points(Positions vertices, Positions points,
                                                                std::uint32_t mesh, bool with_distances,
                                                                ThreadPool& pool) = 0;
  // The nearest features of each of these pairs of meshes, in each world. `version` changes with the pairs.
  virtual NearestPairsFound find_nearest(Positions vertices, const std::vector<PairToSearch>& pairs,
                                         std::uint64_t version, ThreadPool& pool) = 0;
  // Then: the winding numbers of vertices, or undecided_winding.
  virtual std::vector<std::int32_t> windings_of(const std::vector<VertexInMesh>& vertices) = 0;
  // After run(): the pairs left to the exact fallback on the CPU, the first feature of each numbered through all
  // worlds.
  virtual const std::vector<Candidate>& undecided() const = 0;
  // Adds the CPU's results for these pairs, if results stay on the device.
  virtual void add(const std::vector<Contact>& vertex_face, const std::vector<Contact>& edge_edge) = 0;
  virtual FrameResult finish() = 0;
  // After finish(), for results that stay on the device: computes the requested outputs of each row, except for the
  // returned rows, which only integers can decide. Nothing if these are too many.
  virtual std::optional<std::vector<OpenRow>> find_places(FrameResult& result, Outputs outputs) = 0;
  // Writes the host's results for these rows.
  virtual void put_places(const std::vector<PairPlaces>& places) = 0;

  // After run() of these positions, on this device, and finish(), for results that stay there: from now on enqueue()
  // puts the same frame, with the positions at that time, on any stream. Lists and rows have `room` times the size that
  // this frame needed.
  virtual PreparedResults prepare(Positions t0, Positions t1, double room) = 0;
  virtual void enqueue(void* stream) = 0;

  // The same for the earliest time only, never late at tiers that promise that: of all pairs, or of those in the near
  // list. Then call undecided() and earliest().
  enum class Pairs : bool { all, near_list };
  virtual bool run_for_earliest(Positions t0, Positions t1, Pairs pairs, Best best, ThreadPool& pool) = 0;
  virtual EarliestTime earliest() const = 0;
  // The same for each of several worlds: of all pairs, without a best time.
  virtual std::vector<double> earliest_of_worlds() = 0;
  // Lists all pairs that come within a distance in a snapshot, if they are not many more than `most`; otherwise the
  // list is unchanged. Returns false like run().
  virtual bool list_near(Positions vertices, double distance, std::size_t most, ThreadPool& pool) = 0;
  virtual bool gave_up_listing() const = 0;  // by the last list_near()
  // Selects some of the earliest pairs of the last frame, whose earliest time is given, as hints for later frames.
  virtual void choose_hints(double earliest) = 0;
  // Discards the near list: distances of vertices now refer to the start of the last frame.
  virtual void forget_near() = 0;

  virtual Wear wear() const = 0;  // of the refitted tree; no area if the frame was rejected
  virtual std::map<std::string, std::uint64_t> stats() const = 0;
  virtual std::map<std::string, double> stages() const = 0;  // device ms by stage, if requested
};

}  // namespace hpccd::gpu
