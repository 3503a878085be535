// SPDX-License-Identifier: Apache-2.0
// All pairs of features that are near each other in one snapshot, kept for the motions that begin there or close by (a
// list of neighbours as molecular dynamics keeps: Verlet 1967). While no vertex is farther from where it was in that
// snapshot than the list's radius, no other pair touches: features move no farther than their vertices.
#pragma once

#include <limits>
#include <vector>

#include "base/parallel.h"
#include "base/vec3.h"
#include "elementary/pair.h"
#include "scene/features.h"
#include "scene/vertex_motion.h"
#include "traverse/tasks.h"

namespace hpccd {

// How far vertices are from a list's snapshot at most, and how far they go: bounds of Euclidean distances.
struct Travel {
  double away = 0, way = 0;
  // The farthest that any of them is up to a time.
  double until(double time) const { return (away + time * way) * (1 + 1e-9); }
};

class NearList {
 public:
  // Pairs of one kind that are tested by one rule.
  struct Group {
    Kind kind;
    Rule rule;
    std::vector<std::uint32_t> first, second;
  };

  // Replaces the list. Radius below 0: of pairs that are worth a look, but not of all.
  void keep(std::vector<Group> groups, const std::vector<VertexMotion>& starts, double radius, ThreadPool& pool);
  const std::vector<Group>& groups() const { return groups_; }
  std::size_t size() const;

  Travel travel(const std::vector<VertexMotion>& vertices, ThreadPool& pool) const;
  // Whether no pair that is not listed touches up to this time.
  bool complete_until(double time, const Travel& travel) const { return travel.until(time) <= radius_; }
  std::size_t bytes() const;

 private:
  std::vector<Group> groups_;
  std::vector<Vec3<double>> snapshot_;
  double radius_ = -1;
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
