// SPDX-License-Identifier: Apache-2.0
// What a Detector answers. Plain data: a copy is independent of the detector. Indices are as numbered in the scene;
// times are parts of the step, in [0, 1]; lengths and points are in units of the coordinates.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "hpccd/export.h"

namespace hpccd {
inline namespace v0_1 {

/// Where the rows of each world stand among those of all; each of worlds + 1 numbers, the last that of all rows.
/// Empty for a detector of one world.
struct WorldSlices {
  std::vector<std::uint64_t> vf, ee, ef;
  std::vector<std::uint64_t> hashes;  ///< of each world's rows
};

/// Contacts of one motion step in canonical order, the same on every backend and for any number of threads: vertex-face
/// by (vertex, face), then edge-edge by (a0, a1, b0, b1), with a0 < a1, b0 < b1 and (a0, a1) < (b0, b1).
struct Contacts {
  std::vector<std::array<std::uint32_t, 2>> vf;  ///< vertex, face
  std::vector<double> vf_toc;                    ///< time of contact: the earliest at which the two touch
  std::vector<std::array<std::uint32_t, 4>> ee;  ///< the ends of both edges
  std::vector<double> ee_toc;
  /// vf first, then ee; empty unless asked for. A normal has length 1 and points to the side of the face on which the
  /// vertex is just before toc, or from edge a to the side on which edge b is then; for contact at t = 0, to where the
  /// straight-line motion would have come from. Zero where the motion is coplanar throughout, and where at toc features
  /// are degenerate or parallel.
  /// With a minimum separation a point is the midpoint of the nearest points at toc, and a normal the direction from
  /// face to vertex or from edge a to edge b.
  std::vector<std::array<double, 3>> points, normals;
  std::vector<std::array<std::array<double, 3>, 2>> closest;   ///< the nearest points of both sides at toc
  double first_toc = std::numeric_limits<double>::infinity();  ///< infinite where nothing touches
  /// Of features and times: the same for the same contacts, whatever computed them. Of several worlds the sum of each
  /// one's hash times 2 k + 1, k its number.
  std::uint64_t hash = 0;
  /// Of several worlds, whose rows stand one after the other: first those of the first world.
  WorldSlices slices;
  std::vector<double> first_tocs;  ///< of each world; empty for a detector of one
};

/// Pairs of features within a distance of each other at one time; order as in Contacts.
struct Proximity {
  std::vector<std::array<std::uint32_t, 2>> vf;
  std::vector<double> vf_distance;
  std::vector<std::array<std::uint32_t, 4>> ee;
  std::vector<double> ee_distance;
  std::vector<std::array<std::array<double, 3>, 2>> closest;  ///< vf first; empty unless asked for
  std::uint64_t hash = 0;
  WorldSlices slices;
};

/// Edges that pierce or touch faces at one time, in lexicographic order.
struct Intersections {
  std::vector<std::array<std::uint32_t, 3>> ef;  ///< a0 < a1, face
  std::uint64_t hash = 0;
  WorldSlices slices;
};

/// What two meshes have nearest to each other. none: there is no pair to compare; edge_face: they intersect.
enum class GapKind : std::uint8_t { none, vertex_face, edge_edge, edge_face };
struct Gap {
  std::uint32_t mesh_a, mesh_b;
  double distance = std::numeric_limits<double>::infinity();  ///< 0 for edge_face, infinite for none
  GapKind kind = GapKind::none;
  std::array<std::uint32_t, 4> features{};  ///< as in vf, ee or ef; what they leave is 0
  std::array<std::array<double, 3>, 2> points{};
};

/// Results that stay in a GPU's memory, complete when the call returns; rows and order as in Contacts, Proximity and
/// Intersections. The memory is that of no later call while anybody holds it, and is taken again afterwards. It may
/// outlive the detector.
struct DeviceResults {
  std::shared_ptr<const void> memory;  ///< of all that follows
  int device = -1;                     ///< -1: page-locked memory of the host
  std::uint64_t n_vf = 0, n_ee = 0, n_ef = 0;
  const std::array<std::uint32_t, 2>* vf = nullptr;
  const std::array<std::uint32_t, 4>* ee = nullptr;
  const std::array<std::uint32_t, 3>* ef = nullptr;
  const double* values = nullptr;  ///< times of contact, or distances: n_vf, then n_ee
  // n_vf + n_ee rows; null unless asked for.
  const std::array<double, 3>*points = nullptr, *normals = nullptr;
  const std::array<std::array<double, 3>, 2>* closest = nullptr;
  double first_toc = std::numeric_limits<double>::infinity();
  std::uint64_t hash = 0;
  // Of several worlds, else null: as in WorldSlices and Contacts::first_tocs.
  const std::uint64_t *vf_offsets = nullptr, *ee_offsets = nullptr, *ef_offsets = nullptr, *hashes = nullptr;
  const double* first_tocs = nullptr;
};

/// Contacts where they are already: rows in page-locked memory, as a GPU has written them, or else in vectors.
struct Detected {
  std::optional<DeviceResults> in_place;
  Contacts contacts;  ///< where it is not
};

}  // namespace v0_1
}  // namespace hpccd
