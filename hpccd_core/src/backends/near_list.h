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
#include "traverse/tasks.h"

namespace hpccd {

// How far vertices are from a list's snapshot at most, and how far they go: bounds of Euclidean distances.
struct Travel {
  double away = 0, way = 0;
  // From the largest differences along an axis.
  static Travel along_axes(double away, double way);
  // The farthest that any of them is up to a time.
  double until(double time) const { return (away + time * way) * (1 + 1e-9) + least; }

  // A product of denormal numbers is off by as much, which no factor makes up for.
  static constexpr double least = std::numeric_limits<double>::denorm_min();
};

// What the searches for the earliest contact remember of their list, on CPUs and on a device: up to when it answers,
// and whether the next is worth its cost.
class NearRadius {
 public:
  double edge = 0;                // a typical length of the scene
  std::uint64_t separations = 0;  // the version of the separations that the list is for
  // Of all pairs within listed_distance() of each other. for_later: the motion that it was made for has its answer.
  void set(double radius, bool for_later = false) { radius_ = radius, answers_ = for_later, failures_ = 0; }
  void forget() { radius_ = -1; }
  bool known() const { return radius_ > 0; }
  // Pairs that are not listed touch only where they go so far apart.
  double listed() const { return 2 * radius_; }
  // The list was most of the search, with what it left open.
  void helped() { ++answers_, last_rests_ = 1, failures_ = 0; }
  // It was not. True: it is worth no look more, as motions begin elsewhere, or too many have gone too far.
  bool failed(const Travel& travel) { return !known() || travel.away > radius_ || ++failures_ >= most_failures; }
  // The last list was given up: it had more pairs than most_listed().
  void gave_up() { rests_ = rests; }
  // Whether no pair that is not listed touches up to this time, or is reported to.
  bool answers(double time, const Travel& travel) {
    const bool complete = travel.until(std::min(time + same_time, 1.0)) <= radius_;
    if (complete) ++answers_, failures_ = 0;
    return complete;
  }
  // A list costs about what a search costs, so it pays where motions begin where one began before: where this one does,
  // or the last list has answered more than the motion that it was made for.
  bool next_would_pay(const Travel& travel) {
    const bool again = travel.away <= least_radius * edge / 2;
    if (!again) wider_rests_ = 0, last_rests_ = 1;
    if (rests_ > 0) return --rests_, false;
    return answers_ > 1 || again;
  }
  // The same of one that has most of what can touch, where the first does not reach. A motion for which there is none
  // says little of the next: a short rest, and longer ones after more of them from the same start.
  bool wider_would_pay() { return wider_rests_ == 0 || --wider_rests_ == 0; }
  void gave_up_wider() { wider_rests_ = last_rests_ = std::min(2 * last_rests_, rests); }
  // The radius of a list that is to answer up to a time, with room for motions that go farther or begin elsewhere.
  // Nothing where the motion goes so far that it could bring neighbours of a mesh together, of which there are more
  // than of all other pairs.
  std::optional<double> next(const Travel& travel, double time) const;

 private:
  static constexpr double least_radius = 1.0 / 64;  // of an edge
  static constexpr int most_failures = 3;
  static constexpr int rests = 64;  // so many motions before another try, whose price is that of a few searches

  double radius_ = -1;
  int answers_ = 0, rests_ = 0, wider_rests_ = 0, last_rests_ = 1, failures_ = 0;
};

// How far apart the pairs of a list may be at most; nothing where no number is that large.
std::optional<double> listed_distance(std::optional<double> radius, double largest_separation);
// How many they may be at most. More are looked at in more time than a search takes, and may be all pairs of a mesh:
// where others have a separation that is larger than it, or edges that are.
std::size_t most_listed(const Features& features);
// The same of a list that leaves some of the search to be done: that is to be little beside it.
std::size_t most_listed_wide(const Features& features);

class NearList {
 public:
  // Pairs of one kind that are tested by one rule.
  struct Group {
    Kind kind;
    Rule rule;
    std::vector<std::uint32_t> first, second;
  };

  // All pairs that are near in the snapshot where these motions begin, for as far as the radius.
  void keep(std::vector<Group> groups, double radius, const std::vector<VertexMotion>& starts, ThreadPool& pool);
  // That snapshot alone.
  void begin_at(const std::vector<VertexMotion>& starts, ThreadPool& pool);
  void forget();
  const std::vector<Group>& groups() const { return groups_; }
  std::size_t size() const;
  const std::vector<Vec3<double>>& snapshot() const { return snapshot_; }
  std::uint64_t number() const { return number_; }  // of the snapshot: another for each of this process
  // A few pairs that touched first in the last motion: they give the next one its first bound.
  std::vector<Group> hints;

  // How far a motion goes from the snapshot, which is the motion's start from then on where nothing is listed.
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

// The mean of some edges' largest extents: what counts as near in a scene.
double typical_length(const Features& features, const std::vector<VertexMotion>& vertices);

}  // namespace hpccd
