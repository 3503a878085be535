// SPDX-License-Identifier: Apache-2.0
// Coordinates for scenes that are far larger than their features and mostly empty: one vertex parked a million lengths
// away, or bodies in different places of the world. Mapped as a whole (coordinate_map.h), small parts of such a scene
// have only a few distinct floats, and all boxes overlap. This map first shortens the wide gaps between vertices.
//
// Along the axis vertices keep their order, and no distance between two of them grows. Features whose mapped boxes are
// separated, or farther apart than a reach, are so in the scene as well. No motion crosses a gap, so mapped vertices
// still move on straight lines. The map bends a feature that spans a gap: its box contains it, but the hull of its
// corners does not.
#pragma once

#include <vector>

namespace hpccd {

// The interval of a vertex along an axis during its motion.
struct Stretch {
  double low, high;
};

class SqueezedAxis {
 public:
  // Shortens gaps until the length is `wanted`, but none to less than `least`. Sorts the stretches.
  SqueezedAxis(std::vector<Stretch>& stretches, double wanted, double least);

  // The length with shortened gaps.
  double length() const { return length_; }
  // Sets a power of two by which lengths are multiplied.
  void set_scale(double scale) { scale_ = scale; }
  // The mapped coordinate, centred around zero.
  float operator()(double x) const;
  bool operator==(const SqueezedAxis&) const = default;

 private:
  struct Segment {
    double low, high;   // in coordinates of the scene
    double begin, end;  // the mapped low end, and the start of the next segment
    bool operator==(const Segment&) const = default;
  };
  std::vector<Segment> segments_;
  double length_ = 0, scale_ = 1;
};

}  // namespace hpccd
