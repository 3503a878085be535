// SPDX-License-Identifier: Apache-2.0
// Elementary tests of single pairs of features, without a scene.
#pragma once

#include <array>
#include <span>

#include "hpccd/export.h"
#include "hpccd/options.h"

namespace hpccd {
inline namespace v0_1 {

/// One pair of features in motion: eight rows of x y z. Vertex-face: v, f0, f1, f2 at t = 0, then at t = 1.
/// Edge-edge: a0, a1, b0, b1 at t = 0, then at t = 1.
using Query = std::array<double, 24>;

/// Vertex-face tests: decides whether a vertex and a triangle touch, or come within Options::minimum_separation, during
/// the step, and when.
///
/// - queries: pairs of features
/// - options: only accuracy, simd and minimum_separation are used
/// - hit: array of queries.size() elements that the call fills
/// - toc: likewise; the time of impact in [0, 1], infinite without a hit
///
/// Throws InvalidArgument if a coordinate is not finite or exceeds 1e150 in magnitude, if minimum_separation is
/// negative or not finite, or if the machine lacks the instruction set. Thread-safe; runs on the caller's thread.
HPCCD_API void test_vertex_face(std::span<const Query> queries, const Options& options, bool* hit, double* toc);
/// Edge-edge tests; otherwise as test_vertex_face.
HPCCD_API void test_edge_edge(std::span<const Query> queries, const Options& options, bool* hit, double* toc);

}  // namespace v0_1
}  // namespace hpccd
