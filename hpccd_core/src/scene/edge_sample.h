// SPDX-License-Identifier: Apache-2.0
// The lengths of the edges of a scene, estimated from a fixed sample, so that all callers decide alike.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/hd.h"

namespace hpccd {

// A sample of the edges: the stride, and the number of edges in the sample, which is at least `wanted` if there are as
// many, and less than twice that.
struct EdgeSample {
  std::size_t stride, count;

  HPCCD_HD static EdgeSample of(std::size_t n_edges, std::size_t wanted) {
    const std::size_t stride = n_edges / wanted > 1 ? n_edges / wanted : 1;
    return {stride, (n_edges + stride - 1) / stride};
  }
  // The index of the lower quartile of the lengths in ascending order.
  HPCCD_HD std::size_t short_one() const { return count / 4; }
};

// Edges read in each step: each is a page of memory that nothing else needs at that time.
inline constexpr std::size_t edges_of_a_step = 64;

// The length of a short edge of the scene (EdgeSample::short_one). length(from, to): length of the edge between two
// vertices. `wanted`: at most edges_of_a_step.
template <class Length>
double short_edge(const std::vector<std::array<std::uint32_t, 2>>& edges, std::size_t wanted, Length&& length) {
  const EdgeSample sample = EdgeSample::of(edges.size(), wanted);
  if (sample.count == 0) return 0;
  std::array<double, 2 * edges_of_a_step> lengths;
  EdgeSample found{sample.stride, 0};
  for (std::size_t i = 0; i < sample.count; ++i) {
    const auto& [from, to] = edges[i * sample.stride];
    if (from != to) lengths[found.count++] = length(from, to);
  }
  if (found.count == 0) return 0;  // points only
  const auto at = lengths.begin() + static_cast<std::ptrdiff_t>(found.short_one());
  std::nth_element(lengths.begin(), at, lengths.begin() + static_cast<std::ptrdiff_t>(found.count));
  return *at;
}

// Whether single precision is fine enough if a quarter of the edges are at most this long, in coordinates of the boxes.
// Otherwise the scene is so large, or so fine, that too many results would be wrong or left to the tests in double
// precision. (By the mean length, one large triangle beside a fine cloth would pass: 1,955 false positives among 47,000
// contacts. Cloths with edges as short as this bound: one in a thousand.)
HPCCD_HD bool floats_suffice(double short_edge, double scale) {
  constexpr double least_rounded_edge = 1e-3;
  return scale * short_edge > least_rounded_edge;
}

}  // namespace hpccd
