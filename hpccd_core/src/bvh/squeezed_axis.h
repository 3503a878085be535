// SPDX-License-Identifier: Apache-2.0
// Coordinates of a scene that is far larger than its features and mostly empty: one vertex parked a million lengths
// away, or bodies in different places of the world. Mapped as a whole (coordinate_map.h), all that is small shares a
// few floats, and all boxes overlap. Here the wide gaps between vertices are shortened first.
//
// Along the axis vertices keep their order, and no two of them come farther apart than they were: features whose boxes
// are apart, or farther apart than a reach, are so in the scene. No motion crosses a gap, so mapped vertices still move
// on straight lines. A feature that spans a gap is bent by the map: its box holds it, the hull of its corners does not.
#pragma once

#include <vector>

namespace hpccd {

// Where a vertex is along an axis during its motion.
struct Stretch {
  double low, high;
};

class SqueezedAxis {
 public:
  // Shortens gaps no more than brings the length down to `wanted`, and none below `least`. Sorts the stretches.
  SqueezedAxis(std::vector<Stretch>& stretches, double wanted, double least);

  // With shortened gaps.
  double length() const { return length_; }
  // A power of two by which lengths are multiplied.
  void set_scale(double scale) { scale_ = scale; }
  // Around zero.
  float operator()(double x) const;
  bool operator==(const SqueezedAxis&) const = default;

 private:
  struct Segment {
    double low, high;   // in the scene
    double begin, end;  // where the low end is mapped to, and where the next segment begins
    bool operator==(const Segment&) const = default;
  };
  std::vector<Segment> segments_;
  double length_ = 0, scale_ = 1;
};

}  // namespace hpccd
