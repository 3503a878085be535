// SPDX-License-Identifier: Apache-2.0
// How long the edges of a scene are, by a few of them: whoever asks looks at the same ones and adds them up in the same
// order, so that all decide alike.
#pragma once

#include <cstddef>

#include "base/hd.h"

namespace hpccd {

// Every so many edges, and how many that makes: at least `wanted` where there are as many, and less than twice that.
struct EdgeSample {
  std::size_t stride, count;

  HPCCD_HD static EdgeSample of(std::size_t n_edges, std::size_t wanted) {
    const std::size_t stride = n_edges / wanted > 1 ? n_edges / wanted : 1;
    return {stride, (n_edges + stride - 1) / stride};
  }
};

// What is looked at in each step: each is a page of memory that nothing else needs then.
inline constexpr std::size_t edges_of_a_step = 64;

// Whether floats are fine enough for single precision where the typical edge is so long, in the coordinates of the
// boxes. Else a scene is so large, or so fine, that too much would be left to the tests in double precision.
HPCCD_HD bool floats_suffice(double typical_edge, double scale) {
  constexpr double least_rounded_edge = 5e-4;
  return scale * typical_edge > least_rounded_edge;
}

}  // namespace hpccd
