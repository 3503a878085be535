// SPDX-License-Identifier: Apache-2.0
// Shortens the motions of vertices until no pair of features touches: the factors, and the ends that they give.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/cancellation.h"
#include "hpccd/hpccd.h"

namespace hpccd {

// Each round shortens the pairs that touch in the present motion. Their vertices keep 0.9 of the part before contact,
// but not less than the floor: 0.9 of the step that is free of contacts if all vertices take it. Pairs at the floor do
// not touch; only a pair whose rounded ends do goes below it.
class Shortening {
 public:
  // Host positions of one world. groups: by vertex, -1 or a number; vertices with the same number share a factor.
  Shortening(Positions t0, Positions t1, std::span<const std::int64_t> groups, const Cancellation& cancellation);

  struct Touching {
    std::uint32_t vertices[4];
    double toc;
  };
  // The vertices whose ends have changed, and with them end(). None: nothing touches but what touches at the start.
  std::span<const std::uint32_t> shorten(std::span<const Touching> pairs);
  Positions end() const;
  CollisionFreeMotion result() &&;

 private:
  double& factor(std::uint32_t vertex) { return factors_[slots_.empty() ? vertex : slots_[vertex]]; }
  void move(std::uint32_t vertex);
  void take(const Touching& pair, double part);

  const Positions t0_, t1_;
  const Cancellation& cancellation_;
  std::vector<double> ends_;
  std::vector<float> float_ends_;     // for positions in floats
  std::vector<std::uint32_t> slots_;  // by vertex, of its factor; empty: its own number
  std::vector<double> factors_, next_;
  std::vector<char> moves_, stuck_;
  std::vector<char> grouped_;  // empty: none is
  std::vector<std::uint32_t> changed_;
  double floor_ = -1;
  int round_ = 0;
};

}  // namespace hpccd
