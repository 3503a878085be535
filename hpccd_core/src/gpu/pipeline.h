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

#include "bvh/tree.h"
#include "contacts/outputs.h"
#include "elementary/pair.h"
#include "gpu/places.h"
#include "gpu/query.h"
#include "hpccd/hpccd.h"
#include "hpccd/prepared.h"
#include "scene/features.h"
#include "scene/separation_table.h"

namespace hpccd::gpu {

// What a frame found, in page-locked memory or on the device: valid as long as somebody holds that memory, or, where
// there is no such, until the next frame.
struct FrameResult {
  std::shared_ptr<const void> memory;
  std::uint64_t n_vf = 0, n_ee = 0;
  const std::array<std::uint32_t, 2>* vf = nullptr;  // in canonical order
  const std::array<std::uint32_t, 4>* ee = nullptr;
  const double* toc = nullptr;  // vertex-face, then edge-edge; of a snapshot the distances
  std::uint64_t n_ef = 0;
  const std::array<std::uint32_t, 3>* ef = nullptr;  // where edges and faces were looked for, alone
  std::uint64_t hash = 0;
  double first_toc = std::numeric_limits<double>::infinity();
  // Of each row of vf, then of ee, as far as they were asked for.
  const double *points = nullptr, *normals = nullptr, *closest = nullptr;
  // Of several worlds (WorldSlices, Contacts::first_tocs).
  const std::uint64_t *vf_offsets = nullptr, *ee_offsets = nullptr, *ef_offsets = nullptr, *hashes = nullptr;
  const double* first_tocs = nullptr;
};

// The earliest time of a frame, undecided pairs aside, and how far its vertices are from the near list's snapshot and
// how far they go, along an axis.
struct EarliestTime {
  double time, away, way;
};

class Pipeline {
 public:
  // Throws Error where the device has not enough memory or the scene has too many features for 31-bit numbers. The
  // separations may change between frames.
  static std::unique_ptr<Pipeline> create(const Scene& scene, const Features& features, const Options& options,
                                          const SeparationTable& separations, int device);
  virtual ~Pipeline() = default;

  // The tree whose boxes are refitted in every frame.
  virtual void set_tree(const Tree& tree) = 0;

  // A time after which contacts do not matter; where it is given, none does that comes after another. Only where all
  // tiers promise their times.
  using Best = std::optional<double>;
  // All work up to the undecided pairs; host arrays may be changed by the caller after finish() only.
  // Returns false where a coordinate is not finite or too large.
  virtual bool run(Positions t0, Positions t1, Best best, ThreadPool& pool) = 0;
  // The same of one snapshot. distance: for proximity.
  virtual bool run_snapshot(Query query, Positions vertices, double distance, ThreadPool& pool) = 0;
  // After run(): the pairs left for the exact fallback on the CPU, the first feature of each numbered through all
  // worlds.
  virtual const std::vector<Candidate>& undecided() const = 0;
  // Adds what the CPU found of these, where results stay on the device.
  virtual void add(const std::vector<Contact>& vertex_face, const std::vector<Contact>& edge_edge) = 0;
  virtual FrameResult finish() = 0;
  // After finish(), of results that stay on the device: writes what else is asked for of each row, but of those that
  // come back, which only integers can tell. Nothing where these are too many to be worth it.
  virtual std::optional<std::vector<OpenRow>> find_places(FrameResult& result, Outputs outputs) = 0;
  // What the host has found of these.
  virtual void put_places(const std::vector<PairPlaces>& places) = 0;

  // After run() of these positions, on this device, and finish(), of results that stay there: from now on enqueue()
  // puts the same frame, of what the positions are then, on any stream. Lists and rows get room for so many times what
  // this one needed.
  virtual PreparedResults prepare(Positions t0, Positions t1, double room) = 0;
  virtual void enqueue(void* stream) = 0;

  // The same for the earliest time alone, which is never late at the tiers that promise it: of all pairs, or of those
  // in the near list. Then undecided() and earliest().
  enum class Pairs : bool { all, near_list };
  virtual bool run_for_earliest(Positions t0, Positions t1, Pairs pairs, Best best, ThreadPool& pool) = 0;
  virtual EarliestTime earliest() const = 0;
  // The same of each world, where there are several: of all pairs, without a best time.
  virtual std::vector<double> earliest_of_worlds() = 0;
  // Lists all pairs that come within a distance in a snapshot, if there are not many more than `most`; else the list
  // stays what it was. Returns false as run().
  virtual bool list_near(Positions vertices, double distance, std::size_t most, ThreadPool& pool) = 0;
  virtual bool gave_up_listing() const = 0;  // by the last list_near()
  // Some of the earliest pairs of the last frame, whose earliest time this is, give those to come their first bound.
  virtual void choose_hints(double earliest) = 0;
  // There is no near list any more: how far vertices are is said of the start of the last frame.
  virtual void forget_near() = 0;

  virtual double relative_area() const = 0;  // of the refitted tree, as in tree.h
  virtual std::map<std::string, std::uint64_t> stats() const = 0;
  virtual std::map<std::string, double> stages() const = 0;  // device ms by stage, where asked for
};

}  // namespace hpccd::gpu
