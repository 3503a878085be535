// SPDX-License-Identifier: Apache-2.0
// Two meshes of a snapshot, one of which is translated: boxes of their parts, and the times at which faces meet.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "base/cancellation.h"
#include "base/parallel.h"
#include "base/vec3.h"
#include "bvh/motion_bounds.h"
#include "scene/features.h"

namespace hpccd {

// What does not depend on positions.
struct MeshTopology {
  std::uint32_t first_face, n_faces;  // in the scene
  bool closed;
  std::vector<std::uint32_t> representatives;  // a vertex of each part that faces connect
};
MeshTopology topology_of(const Scene& scene, std::uint32_t mesh, const Cancellation& cancellation);

// The faces of one mesh, in a tree of boxes of double precision. It depends on positions alone, so that results do not
// depend on the queries before, as they would by the refitted tree of the detector. Coordinates are multiplied by a
// power of two, so that the largest of both meshes is between 1/2 and 1. (Losses by underflow are far below the error
// bounds.)
struct BoxedMesh {
  struct Box {
    Vec3<double> low, high;
  };
  struct Node {
    Box box;
    std::uint32_t children = 0;  // the left child; the right one follows it. 0: a leaf
    std::uint32_t first_face = 0, end_face = 0;
  };
  std::vector<Node> nodes;                          // the root first; children come after their parents
  std::vector<std::array<std::uint32_t, 3>> faces;  // vertices, in the order of the leaves
  std::vector<std::uint32_t> face_numbers;          // in the scene
  const MeshTopology* topology = nullptr;
};

// A time of first or last contact. The features whose contact it is determine it: a vertex and a face, two edges, or in
// degenerate cases fewer vertices. Without any it is 0.
struct ContactTime {
  double at = 0, error = 0;  // in the scale of BoxedMesh
  int n_a = 0, n_b = 0;
  std::array<std::uint32_t, 3> a{}, b{};  // vertices, in ascending order
  bool same_features(const ContactTime& other) const {
    return n_a == other.n_a && n_b == other.n_b && a == other.a && b == other.b;
  }
};

struct ContactInterval {
  ContactTime begin, end;
};

class MovedPair {
 public:
  // The arguments must outlive the object.
  MovedPair(const MotionBounds& snapshot, const Features& features, std::array<std::uint32_t, 2> meshes,
            const MeshTopology& a, const MeshTopology& b, ThreadPool& pool);

  const BoxedMesh& a() const { return meshes_[0]; }
  const BoxedMesh& b() const { return meshes_[1]; }
  double scale() const { return scale_; }
  Vec3<double> given(std::uint32_t vertex) const {
    const double* x = snapshot_.vertices[vertex].t0;
    return {x[0], x[1], x[2]};
  }
  Vec3<double> position(std::uint32_t vertex) const { return scale_ * given(vertex); }
  // The exponent of the lowest bit of any coordinate of both meshes, and the number of bits from there to the highest.
  struct Bits {
    int low, count;
  };
  const Bits& bits() const;
  void heed() const { cancellation_.heed(); }

 private:
  void build(BoxedMesh& mesh, const Features& features, const Extent& extent) const;
  void fit(BoxedMesh& mesh) const;

  const MotionBounds& snapshot_;
  const Cancellation& cancellation_;
  BoxedMesh meshes_[2];
  double scale_ = 1;
  mutable std::optional<Bits> bits_;
};

// Translation of mesh a along one direction, from a place to which it has been translated before: at time s by
// `from` + s direction, with the direction's length 1. Times are in the scale of BoxedMesh.
enum class Decided : bool { exactly, roughly };

class Translation {
 public:
  // Exactly only from 0. Roughly: times within rounding errors, without those of faces that the direction is in.
  Translation(const MovedPair& pair, const Vec3<double>& direction, const Vec3<double>& from = {0, 0, 0},
              Decided decided = Decided::exactly);

  // Two faces, or faces and edges, meet in one closed interval of times, as two convex sets whose difference meets a
  // line. These find, over all pairs of faces:
  // the latest end of all intervals, or of those that contain a time, if there is one; or any later than `enough`;
  std::optional<ContactTime> latest_end(const ContactTime* containing = nullptr, double enough = INFINITY) const;
  // the earliest begin after a time, if there is one, and none after `before` at least.
  std::optional<ContactTime> earliest_begin(const ContactTime& after, double before = INFINITY) const;

  // Just after a time at which no interval continues: whether a component of one mesh is inside the closed other one.
  bool contained_after(const ContactTime& time) const;

  struct Range {
    double low, high;
  };
  // Adds the times from 0 on at which a vertex of one mesh is inside the closed other one: the meshes are not free of
  // each other then. Within rounding errors; where those could matter, none.
  void inside_during(std::uint32_t vertex, bool of_a, std::vector<Range>& found) const;

  // Sign of the difference of two times.
  int compare(const ContactTime& s, const ContactTime& t) const;
  // In units of the scene, within 1e-15 of its size.
  double length(const ContactTime& time) const;

 private:
  struct FaceInFrame {
    double u[3], v[3], w[3];
    double low[3], high[3];  // of u, v and w
  };
  struct LeafInFrame {
    double low[3], high[3];
    FaceInFrame faces[16];
  };
  class LeavesInFrame;
  class Exact;

  bool meeting(const BoxedMesh::Box& a, const BoxedMesh::Box& b, Range& range) const;
  FaceInFrame in_frame(const std::array<std::uint32_t, 3>& face, bool moves) const;
  enum class Found : std::uint8_t { no, yes, unsure };
  template <class A, class B>
  static bool apart(const A& a, const B& b);
  Found interval(const FaceInFrame& a, const FaceInFrame& b, const std::array<std::uint32_t, 3>& face_a,
                 const std::array<std::uint32_t, 3>& face_b, ContactInterval& found) const;
  bool times(const FaceInFrame& a, const FaceInFrame& b, const std::array<std::uint32_t, 3>& face_a,
             const std::array<std::uint32_t, 3>& face_b, ContactInterval& found) const;
  template <bool latest, class Accept>
  std::optional<ContactTime> search(double after, double before, double enough, Accept&& accept) const;
  int winding_after(std::uint32_t vertex, bool of_a, const ContactTime& time) const;

  const MovedPair& pair_;
  Vec3<double> given_, from_, axis_[3];  // axis_[2]: the direction
  Vec3<double> per_axis_;                // 1 / axis_[2]
  bool exact_;
};

}  // namespace hpccd
