// SPDX-License-Identifier: Apache-2.0
// The public C++ interface: Scene, Options, Detector, Contacts. Nothing here prints or aborts: errors are thrown.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "hpccd/prepared.h"

namespace hpccd {

// A mistake of the caller: the text names the argument and the remedy.
class InvalidArgument : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

// Thrown by a call that Detector::cancel has ended.
class Cancelled : public std::runtime_error {
 public:
  Cancelled() : std::runtime_error("the detection was cancelled") {}
};

enum class Accuracy : std::uint8_t { fast, balanced, conservative, exact };
enum class Backend : std::uint8_t { automatic, cpu, hybrid, gpu };
enum class Report : std::uint8_t { all, first, any };
// How CPUs find the candidates: by the default traversal, or as published (Kim et al. 2009; Tang et al. 2009).
enum class Method : std::uint8_t { standard, published, naive, front };
enum class Simd : std::uint8_t { automatic, scalar, avx2, avx512 };

// Which pairs of features are tested at all. To test neither is refused: Scene::ignore_pair says that of two meshes.
struct TestedFeatures {
  bool vertex_face = true;
  bool edge_edge = true;
  bool operator==(const TestedFeatures&) const = default;
};

struct MeshOptions {
  bool self_collision = true;
  bool is_static = false;  // promised not to move; pairs of two static meshes are never tested
};

// Meshes with their topology, and which pairs of them matter. Vertices of all meshes are concatenated in the order
// added.
class Scene {
 public:
  // faces: 3 indices a triangle into this mesh's own vertices [0, n_vertices). Returns the mesh's number.
  std::uint32_t add_mesh(std::string name, std::span<const std::uint32_t> faces, std::uint32_t n_vertices,
                         MeshOptions options);
  void ignore_pair(std::uint32_t mesh_a, std::uint32_t mesh_b);
  void set_accuracy(std::uint32_t mesh_a, std::uint32_t mesh_b, Accuracy accuracy);
  // How far apart the two shall stay, instead of Options::minimum_separation; the same mesh twice: within it. >= 0.
  void set_separation(std::uint32_t mesh_a, std::uint32_t mesh_b, double separation);
  // What is tested between the two, instead of Options::features; the same mesh twice: within it.
  void set_features(std::uint32_t mesh_a, std::uint32_t mesh_b, TestedFeatures features);

  struct Mesh {
    std::string name;
    MeshOptions options;
    std::uint32_t first_vertex, n_vertices, first_face, n_faces;
  };
  const std::vector<Mesh>& meshes() const { return meshes_; }
  // Scene-wide vertex indices of each triangle.
  const std::vector<std::array<std::uint32_t, 3>>& faces() const { return faces_; }
  std::uint32_t n_vertices() const { return n_vertices_; }
  bool pair_enabled(std::uint32_t mesh_a, std::uint32_t mesh_b) const;
  Accuracy pair_accuracy(std::uint32_t mesh_a, std::uint32_t mesh_b, Accuracy otherwise) const;
  double pair_separation(std::uint32_t mesh_a, std::uint32_t mesh_b, double otherwise) const;
  TestedFeatures pair_features(std::uint32_t mesh_a, std::uint32_t mesh_b, TestedFeatures otherwise) const;

 private:
  using Pair = std::pair<std::uint32_t, std::uint32_t>;
  static Pair ordered(std::uint32_t a, std::uint32_t b) { return a < b ? Pair{a, b} : Pair{b, a}; }
  std::vector<Mesh> meshes_;
  std::vector<std::array<std::uint32_t, 3>> faces_;
  std::uint32_t n_vertices_ = 0;
  std::map<Pair, bool> ignored_;
  std::map<Pair, Accuracy> accuracy_;
  std::map<Pair, double> separation_;
  std::map<Pair, TestedFeatures> features_;
};

struct Options {
  Accuracy accuracy = Accuracy::exact;
  Backend backend = Backend::automatic;
  Report report = Report::all;
  Simd simd = Simd::automatic;
  int threads = 0;  // 0: all cores
  bool points = false;
  bool normals = false;
  bool closest = false;  // the nearest points of both sides
  // In units of the coordinates: report pairs that come within this Euclidean distance of each other, and when.
  double minimum_separation = 0;
  Method method = Method::standard;
  bool restructure = true;  // of `published` and `naive`: whether nodes that cull badly are split anew
  // Of backend `hybrid` (Kim et al. 2009, section 5.1): the triangle index queue, and how many GPUs; 0: all.
  std::size_t hybrid_segments = 128, hybrid_segment_pairs = 2048;
  int gpus = 0;
  // Of backend `gpu`: profile() tells the time on the device too, by stage. The events for it cost 1 us each.
  bool gpu_stages = false;
  // Of detect, collision_free_step and proximity. Intersections and smallest distances are of whole surfaces.
  TestedFeatures features;
  // Results are asked for on the device, by detect_on_device, proximity_on_device and intersections_on_device alone; it
  // decides all pairs that it can. Refused where there is no usable GPU.
  bool results_on_device = false;
  // So many copies of the scene, which know nothing of each other: positions hold all vertices of the first, then those
  // of the second, ... Each is answered as if it were alone, in every bit. 1 to most_worlds.
  std::uint32_t worlds = 1;
  static constexpr std::uint32_t most_worlds = 65536;
};

// Where the rows of each world stand among those of all; each of worlds + 1 numbers, the last that of all rows.
// Empty for a detector of one world.
struct WorldSlices {
  std::vector<std::uint64_t> vf, ee, ef;
  std::vector<std::uint64_t> hashes;  // of each world's rows
};

// Contacts of one motion step in canonical order: vertex-face by (vertex, face), then edge-edge by (a0, a1, b0, b1).
struct Contacts {
  std::vector<std::array<std::uint32_t, 2>> vf;
  std::vector<double> vf_toc;
  std::vector<std::array<std::uint32_t, 4>> ee;
  std::vector<double> ee_toc;
  // vf first, then ee; empty unless asked for. A normal points to the side of the face on which the vertex is just
  // before toc, or from edge a to the side on which edge b is then; for contact at t = 0, to where the straight-line
  // motion would have come from. Zero where the motion is coplanar throughout, and where at toc features are degenerate
  // or parallel.
  // With a minimum separation a point is the midpoint of the nearest points at toc, and a normal the direction from
  // face to vertex or from edge a to edge b.
  std::vector<std::array<double, 3>> points, normals;
  std::vector<std::array<std::array<double, 3>, 2>> closest;  // the nearest points of both sides at toc
  double first_toc = std::numeric_limits<double>::infinity();
  // Of several worlds the sum of each one's hash times 2 k + 1, k its number.
  std::uint64_t hash = 0;
  // Of several worlds, whose rows stand one after the other: first those of the first world.
  WorldSlices slices;
  std::vector<double> first_tocs;  // of each world; empty for a detector of one
};

// Pairs of features within a distance of each other at one time; order as in Contacts.
struct Proximity {
  std::vector<std::array<std::uint32_t, 2>> vf;
  std::vector<double> vf_distance;
  std::vector<std::array<std::uint32_t, 4>> ee;
  std::vector<double> ee_distance;
  std::vector<std::array<std::array<double, 3>, 2>> closest;  // vf first; empty unless asked for
  std::uint64_t hash = 0;
  WorldSlices slices;
};

// Edges that pierce or touch faces at one time, in lexicographic order.
struct Intersections {
  std::vector<std::array<std::uint32_t, 3>> ef;  // a0 < a1, face
  std::uint64_t hash = 0;
  WorldSlices slices;
};

// What two meshes have nearest to each other.
enum class GapKind : std::uint8_t { none, vertex_face, edge_edge, edge_face };
struct Gap {
  std::uint32_t mesh_a, mesh_b;
  double distance = std::numeric_limits<double>::infinity();
  GapKind kind = GapKind::none;             // edge_face: they intersect, the distance is 0
  std::array<std::uint32_t, 4> features{};  // as in vf, ee or ef
  std::array<std::array<double, 3>, 2> points{};
};

// Positions of all vertices at one time: n rows of x y z without gaps, float or double.
struct Positions {
  const void* data = nullptr;
  std::size_t n = 0;
  bool is_double = true;
  bool on_device = false;  // data is in a GPU's memory
  // On a device: the stream (cudaStream_t) after whose work so far they are there; without one, after all of the
  // device's. On the host it counts where results stay on the device: rows of earlier ones that nobody holds any more
  // are written when that work, which may still read them, has ended. One that is no stream of that device is refused
  // where CUDA says so; an address at which there is no stream at all may crash in CUDA.
  std::optional<void*> made_on = std::nullopt;
};

// Results that stay in a GPU's memory, complete when the call returns; rows and order as in Contacts, Proximity and
// Intersections. The memory is that of no later call while anybody holds it, and is taken again afterwards.
struct DeviceResults {
  std::shared_ptr<const void> memory;  // of all that follows
  int device = -1;                     // -1: page-locked memory of the host
  std::uint64_t n_vf = 0, n_ee = 0, n_ef = 0;
  const std::array<std::uint32_t, 2>* vf = nullptr;
  const std::array<std::uint32_t, 4>* ee = nullptr;
  const std::array<std::uint32_t, 3>* ef = nullptr;
  const double* values = nullptr;  // times of contact, or distances: n_vf, then n_ee
  // n_vf + n_ee rows; null unless asked for.
  const std::array<double, 3>*points = nullptr, *normals = nullptr;
  const std::array<std::array<double, 3>, 2>* closest = nullptr;
  double first_toc = std::numeric_limits<double>::infinity();
  std::uint64_t hash = 0;
  // Of several worlds, else null: as in WorldSlices and Contacts::first_tocs.
  const std::uint64_t *vf_offsets = nullptr, *ee_offsets = nullptr, *ef_offsets = nullptr, *hashes = nullptr;
  const double* first_tocs = nullptr;
};

// Contacts where they are already: rows in page-locked memory, as a GPU has written them, or else in vectors.
struct Detected {
  std::optional<DeviceResults> in_place;
  Contacts contacts;  // where it is not
};

// One call at a time: of those that several threads make of one detector, each waits until the one before has ended.
// Threads that are to work side by side need a detector each; the scene may be the same.
class Detector {
 public:
  Detector(std::shared_ptr<const Scene> scene, Options options);
  ~Detector();
  Detector(const Detector&) = delete;
  Detector& operator=(const Detector&) = delete;

  // Contacts of the straight-line motion from t0 to t1 (Kim et al. 2009, section 3.1).
  Contacts detect(Positions vertices_t0, Positions vertices_t1);
  // The same, without a copy where there need be none. Both refuse, as proximity and intersections do, a detector whose
  // results stay on the device.
  Detected detect_in_place(Positions vertices_t0, Positions vertices_t1);

  // The largest part of the motion that is certainly free of contacts, whatever Options::report says: at the tiers
  // exact and conservative never beyond the earliest one and at most 1e-9 before it, else that of the earliest one
  // found. 1 where nothing touches. Of several worlds: of all of them.
  double collision_free_step(Positions vertices_t0, Positions vertices_t1);
  // The same of each world by itself.
  std::vector<double> collision_free_steps(Positions vertices_t0, Positions vertices_t1);

  // Vertex-face and edge-edge pairs within this distance of each other, Euclidean, between closed features.
  Proximity proximity(Positions vertices, double distance);
  // Edges and faces that share a point but no vertex.
  Intersections intersections(Positions vertices);

  // The same three, whose results stay on the device, of a detector whose Options::results_on_device says so. What the
  // CPU had to compute, after a failure of the device, is brought there. Throws std::runtime_error where that fails
  // too.
  DeviceResults detect_on_device(Positions vertices_t0, Positions vertices_t1);
  DeviceResults proximity_on_device(Positions vertices, double distance);
  DeviceResults intersections_on_device(Positions vertices);
  // For detect_on_device() of arrays on the device that stay where they are, without a look from the host: with room
  // for `room` times, 1 to 1000, what the motion that they hold now takes. Throws InvalidArgument where outputs were
  // asked for, std::runtime_error where the device fails.
  std::unique_ptr<PreparedDetection> prepare(Positions vertices_t0, Positions vertices_t1, double room);
  // The smallest distance of each enabled pair of meshes, by (mesh_a, mesh_b), mesh_a <= mesh_b. Of pairs of features
  // whose distances are the same double the first in order, vertex-face before edge-edge. Of several worlds those of
  // the first, then those of the second, ...: as many of each.
  std::vector<Gap> distances(Positions vertices);

  // As Scene::set_separation, from the next call on, which fits its boxes to it as to any motion.
  void set_separation(std::uint32_t mesh_a, std::uint32_t mesh_b, double separation);

  // From any thread, without waiting: a call under way, those that wait for it, and all later ones throw Cancelled,
  // within 10 ms. What is on a GPU already comes to its end first.
  void cancel();

  // Of the last call; while one is under way, of that one when it has ended.
  std::map<std::string, double> profile() const;       // stage -> ms
  std::map<std::string, std::uint64_t> stats() const;  // counts
  std::string last_gpu_error() const;                  // why a frame meant for the GPU was computed on the CPU
  // These do not wait.
  const Options& options() const;  // with "automatic" resolved
  Backend last_backend() const;    // where the last frame was computed

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;  // also of what it has prepared
};

// Elementary queries one by one; of the options only accuracy, simd and minimum_separation matter.
// One query: rows v f0 f1 f2 (vertex-face) or a0 a1 b0 b1 (edge-edge) at t=0, then the same at t=1.
using Query = std::array<double, 24>;
void test_vertex_face(std::span<const Query> queries, const Options& options, bool* hit, double* toc);
void test_edge_edge(std::span<const Query> queries, const Options& options, bool* hit, double* toc);

// The instruction sets usable on this machine, best last.
std::vector<Simd> simd_levels();

}  // namespace hpccd
