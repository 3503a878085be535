// SPDX-License-Identifier: Apache-2.0
#include "backends/short_edge.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "scene/edge_sample.h"

namespace hpccd {
namespace {

double extent(const double* a, const double* b) {
  return std::max({std::abs(a[0] - b[0]), std::abs(a[1] - b[1]), std::abs(a[2] - b[2])});
}

}  // namespace

double short_edge(const Features& features, const std::vector<VertexMotion>& vertices) {
  const EdgeSample sample = EdgeSample::of(features.edges.size(), edges_of_a_step);
  if (sample.count == 0) return 0;
  std::array<double, 2 * edges_of_a_step> lengths;
  for (std::size_t i = 0; i < sample.count; ++i) {
    const auto& [from, to] = features.edges[i * sample.stride];
    const VertexMotion &a = vertices[from], &b = vertices[to];
    lengths[i] = std::min(extent(a.t0, b.t0), extent(a.t1, b.t1));
  }
  const auto at = lengths.begin() + static_cast<std::ptrdiff_t>(sample.short_one());
  std::nth_element(lengths.begin(), at, lengths.begin() + static_cast<std::ptrdiff_t>(sample.count));
  return *at;
}

}  // namespace hpccd
