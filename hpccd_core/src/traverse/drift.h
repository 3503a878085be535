// SPDX-License-Identifier: Apache-2.0
// Drift: how far the vertices of each node have moved from their positions in a snapshot, at both ends of a motion.
// Two features that were apart in the snapshot can only touch if they move apart by as much. A mesh that falls or
// rotates moves far, but neighbours in it hardly move apart. If the near pairs of the snapshot are listed, few other
// pairs have to be searched.
#pragma once

#include <cstdint>
#include <vector>

#include "base/parallel.h"
#include "base/vec3.h"
#include "bvh/tree.h"
#include "scene/vertex_motion.h"

namespace hpccd {

class Drift {
 public:
  // Starts from a snapshot, in coordinates of its own: motions that begin far away, with other box coordinates, may
  // come in between.
  void begin(const Tree& tree, const std::vector<Vec3<double>>& snapshot, ThreadPool& pool);
  // Fits the drift to a motion of the same vertices.
  void fit(const Tree& tree, const std::vector<VertexMotion>& motion, const std::vector<Vec3<double>>& snapshot,
           ThreadPool& pool);
  // States that all pairs within `distance` and a separation of each other are listed; `separation` is the largest one.
  void listed_within(double distance, double separation);

  // Whether unlisted features of these two nodes may touch up to a time. a == b: two features of one node.
  bool may_touch(std::uint32_t a, std::uint32_t b, float until) const;
  std::size_t bytes() const;

 private:
  // x y z and padding.
  struct Ends {
    Floats4 t0, t1;
  };
  struct Ways {
    Floats4 low_t0, high_t0, low_t1, high_t1;
    void include(const Ways& w) {
      low_t0 = min4(low_t0, w.low_t0), high_t0 = max4(high_t0, w.high_t0);
      low_t1 = min4(low_t1, w.low_t1), high_t1 = max4(high_t1, w.high_t1);
    }
    Ways until(float time) const {
      const Floats4 t = {time, time, time, time};
      return {low_t0, high_t0, low_t0 + t * (low_t1 - low_t0), high_t0 + t * (high_t1 - high_t0)};
    }
  };
  struct Place {
    Floats4 low, high;
    void include(const Place& p) { low = min4(low, p.low), high = max4(high, p.high); }
  };
  template <class Box, class OfVertex>
  static void join(const Tree& tree, std::vector<Box>& boxes, Box none, OfVertex&& of_vertex, ThreadPool& pool);

  std::vector<Ends> vertices_;
  std::vector<Ways> ways_;     // by node
  std::vector<Place> places_;  // by node, in the snapshot
  double scale_ = 1, largest_ = 0;
  float listed_ = 0, reach_ = 0;
};

// Features move on straight lines. Relative to each other they are farthest from their initial configuration at one of
// both ends, and features in the same order along an axis at both ends are separated throughout. Also true if a number
// is NaN.
inline bool Drift::may_touch(std::uint32_t a, std::uint32_t b, float time) const {
  const Ways p = ways_[a].until(time), q = ways_[b].until(time);
  const auto go_apart = [](Floats4 low_a, Floats4 high_a, Floats4 low_b, Floats4 high_b) {
    const Floats4 way = max4(high_b - low_a, high_a - low_b), s = way * way;
    return s[0] + s[1] + s[2];
  };
  const float most = listed_ * listed_;
  if (go_apart(p.low_t0, p.high_t0, q.low_t0, q.high_t0) < most &&
      go_apart(p.low_t1, p.high_t1, q.low_t1, q.high_t1) < most)
    return false;
  if (a == b) return true;
  const Floats4 reach = {reach_, reach_, reach_, reach_};
  const Floats4 above = places_[b].low - places_[a].high, below = places_[a].low - places_[b].high;
  const Mask4 apart = ((above + (q.low_t0 - p.high_t0) > reach) & (above + (q.low_t1 - p.high_t1) > reach)) |
                      ((below + (p.low_t0 - q.high_t0) > reach) & (below + (p.low_t1 - q.high_t1) > reach));
  return (bits4(apart) & 7) == 0;
}

}  // namespace hpccd
