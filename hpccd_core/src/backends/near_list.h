// SPDX-License-Identifier: Apache-2.0
// All pairs of features that are near each other in one snapshot, kept for motions that start there or close by (like
// the neighbour lists of molecular dynamics: Verlet 1967). While no vertex is farther from its position in the
// snapshot than the list's radius, no other pair can touch: features move no farther than their vertices.
#pragma once

#include <algorithm>
#include <limits>
#include <optional>
#include <vector>

#include "base/parallel.h"
#include "base/vec3.h"
#include "elementary/pair.h"
#include "elementary/policy.h"
#include "scene/features.h"
#include "scene/vertex_motion.h"
#include "traverse/worker.h"

namespace hpccd {

// The largest distance of vertices from a list's snapshot, and the longest way that they go: bounds of Euclidean
// distances.
struct Travel {
  double away = 0, way = 0;
  // From the largest differences along an axis.
  static Travel along_axes(double away, double way);
  // The farthest distance of any vertex up to a time.
  double until(double time) const { return (away + time * way) * (1 + 1e-9) + least; }

  // A product of denormal numbers has an absolute error, which no factor covers.
  static constexpr double least = std::numeric_limits<double>::denorm_min();
};

// The state that searches for the earliest contact keep about their list, on CPUs and on a device: until when it is
// sufficient, and whether the next list is worth its cost.
class NearRadius {
 public:
  double edge = 0;                // a typical length of the scene
  std::uint64_t separations = 0;  // the version of the separations that the list is for
  // A list of all pairs within listed_distance() of each other. for_later: the motion for which it was made has its
  // result already.
  void set(double radius, bool for_later = false) { radius_ = radius, answers_ = for_later, failures_ = 0; }
  void forget() { radius_ = -1; }
  bool known() const { return radius_ > 0; }
  // Unlisted pairs touch only if they move by this distance.
  double listed() const { return 2 * radius_; }
  // The list was most of the search, including the pairs that it left open.
  void helped() { ++answers_, last_rests_ = 1, failures_ = 0; }
  // The list did not help. True: it is not worth using again, because motions begin elsewhere, or too many have gone
  // too far.
  bool failed(const Travel& travel) { return !known() || travel.away > radius_ || ++failures_ >= most_failures; }
  // The last list was abandoned: it had more pairs than most_listed().
  void gave_up() { rests_ = rests; }
  // Whether no unlisted pair touches up to this time, or is reported as touching.
  bool answers(double time, const Travel& travel) {
    const bool complete = travel.until(std::min(time + same_time, 1.0)) <= radius_;
    if (complete) ++answers_, failures_ = 0;
    return complete;
  }
  // A list costs about as much as a search, so it pays if motions begin where a previous one began: if this one does,
  // or if the last list was used by more than the motion for which it was made.
  bool next_would_pay(const Travel& travel) {
    const bool again = travel.away <= least_radius * edge / 2;
    if (!again) wider_rests_ = 0, last_rests_ = 1;
    if (rests_ > 0) return --rests_, false;
    return answers_ > 1 || again;
  }
  // The same for a list of most pairs that can touch, for motions beyond the first list's radius. A motion without such
  // a list says little about the next: a short pause, and longer ones after more such motions from the same start.
  bool wider_would_pay() { return wider_rests_ == 0 || --wider_rests_ == 0; }
  void gave_up_wider() { wider_rests_ = last_rests_ = std::min(2 * last_rests_, rests); }
  // The radius of a list that is sufficient up to a time, with some margin for motions that go farther or begin
  // elsewhere. Nothing if the motion goes so far that it could bring neighbours of a mesh together, which outnumber all
  // other pairs.
  std::optional<double> next(const Travel& travel, double time) const;

 private:
  static constexpr double least_radius = 1.0 / 64;  // of an edge
  static constexpr int most_failures = 3;
  static constexpr int rests = 64;  // motions before the next attempt, which costs a few searches

  double radius_ = -1;
  int answers_ = 0, rests_ = 0, wider_rests_ = 0, last_rests_ = 1, failures_ = 0;
};

// The largest distance of listed pairs; nothing if no number is that large.
std::optional<double> listed_distance(std::optional<double> radius, double largest_separation);
// The largest number of listed pairs. More take longer than a search, and may be all pairs of a mesh, if a separation
// is larger than the mesh, or than its edges.
std::size_t most_listed(const Features& features);
// The same for a list that leaves part of the search open, which must be small in comparison.
std::size_t most_listed_wide(const Features& features);

class NearList {
 public:
  using Group = PairGroup;

  // Stores all pairs that are near in the snapshot where these motions begin, within the radius.
  void keep(std::vector<Group> groups, double radius, const std::vector<VertexMotion>& starts, ThreadPool& pool);
  // Stores that snapshot only.
  void begin_at(const std::vector<VertexMotion>& starts, ThreadPool& pool);
  void forget();
  const std::vector<Group>& groups() const { return groups_; }
  std::size_t size() const;
  const std::vector<Vec3<double>>& snapshot() const { return snapshot_; }
  std::uint64_t number() const { return number_; }  // of the snapshot: unique in this process
  // Hints: a few pairs that touched first in the last motion. They give the next one its first bound.
  std::vector<Group> hints;

  // How far a motion goes from the snapshot. If nothing is listed, the motion's start becomes the snapshot.
  Travel see(const std::vector<VertexMotion>& vertices, ThreadPool& pool);
  NearRadius& radius() { return radius_; }
  std::size_t bytes() const;

 private:
  std::vector<Group> groups_;
  std::vector<Vec3<double>> snapshot_;
  std::uint64_t number_ = 0;
  NearRadius radius_;
};

// Sorts pairs into groups.
class Grouping {
 public:
  Grouping(const Features& features, const PairRules& rules) : features_(features), rules_(rules) {}
  void add(const Candidate& pair);
  std::vector<NearList::Group> groups;

 private:
  const Features& features_;
  const PairRules& rules_;
};

// The mean of some edges' largest extents: the scale of what is near in a scene.
double typical_length(const Features& features, const std::vector<VertexMotion>& vertices);

}  // namespace hpccd
