// SPDX-License-Identifier: Apache-2.0
// Elementary queries one by one, without a scene.
#pragma once

#include <array>
#include <span>

#include "hpccd/export.h"
#include "hpccd/options.h"

namespace hpccd {
inline namespace v0_1 {

/// One query: rows of x y z, v f0 f1 f2 (vertex-face) or a0 a1 b0 b1 (edge-edge) at t = 0, then the same at t = 1.
using Query = std::array<double, 24>;

/// Whether the two features of each query touch, or come within Options::minimum_separation, during the step, and when.
/// Of the options only accuracy, simd and minimum_separation matter.
/// hit, toc: room for queries.size() answers each; toc in [0, 1], infinite where there is no hit.
/// Throws InvalidArgument for a coordinate that is not finite or beyond 1e150 in magnitude, a minimum_separation that
/// is negative or not finite, and an instruction set that this machine lacks. From any number of threads at once; the
/// work is the caller's thread's.
HPCCD_API void test_vertex_face(std::span<const Query> queries, const Options& options, bool* hit, double* toc);
HPCCD_API void test_edge_edge(std::span<const Query> queries, const Options& options, bool* hit, double* toc);

}  // namespace v0_1
}  // namespace hpccd
