// SPDX-License-Identifier: Apache-2.0
// Single queries, computed by the same batches and fallbacks as whole scenes.
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "base/length.h"
#include "base/names.h"
#include "base/simd.h"
#include "base/standard_arithmetic.h"
#include "bvh/coordinate_map.h"
#include "elementary/distance/distance_batch.h"
#include "elementary/policy.h"
#include "elementary/undecided.h"

namespace hpccd {
namespace {

Vec3<double> point(const Query& q, int row) { return {q[3 * row], q[3 * row + 1], q[3 * row + 2]}; }

// The coordinate map of single precision. Each query has its own map, so that no result depends on other queries.
CoordinateMap map_of(const Query& q) {
  double low[3], high[3];
  for (int k = 0; k < 3; ++k) {
    low[k] = high[k] = q[k];
    for (int row = 1; row < 8; ++row)
      low[k] = std::min(low[k], q[3 * row + k]), high[k] = std::max(high[k], q[3 * row + k]);
  }
  return CoordinateMap::around(low, high);
}

[[noreturn]] void report_bad(const Query& query, std::size_t i) {
  std::size_t k = 0;
  while (std::fabs(query[k]) <= largest_coordinate) ++k;
  const std::string where =
      "queries[" + std::to_string(i) + ", " + std::to_string(k / 3) + ", " + std::to_string(k % 3) + "] is ";
  if (std::isnan(query[k])) throw InvalidArgument(where + "NaN; all coordinates must be finite");
  if (std::isinf(query[k])) throw InvalidArgument(where + "infinite; all coordinates must be finite");
  throw InvalidArgument(where + "beyond 1e150: intermediate results could overflow; scale the coordinates down");
}

void check_coordinates(std::span<const Query> queries) {
  for (std::size_t i = 0; i < queries.size(); ++i) {
    bool good = true;
    for (const double x : queries[i]) good &= std::fabs(x) <= largest_coordinate;
    if (!good) report_bad(queries[i], i);
  }
}

void test_queries(Kind kind, std::span<const Query> queries, const Options& options, bool* hit, double* toc) {
  const StandardArithmetic arithmetic;
  const Accuracy accuracy = options.accuracy;
  const double separation = options.minimum_separation;
  check_accuracy(accuracy);
  check_length("minimum_separation", separation);
  check_coordinates(queries);
  const BatchTest test =
      separation > 0 ? separation_batch(resolve(options.simd)) : batch_test(resolve(options.simd), accuracy);
  const Fallback fallback = separation > 0 ? decide_separation : decide_contact;
  auto result = std::make_unique<BatchResult>();
  FallbackCounts counts;
  std::vector<VertexMotion> rows(4 * batch_capacity);
  const bool rounds = accuracy == Accuracy::fast && separation == 0;
  std::vector<RoundedMotion> rounded(rounds ? rows.size() : 0);
  std::vector<std::array<std::uint32_t, 2>> edges(2 * batch_capacity);
  std::vector<std::array<std::uint32_t, 3>> faces(batch_capacity);
  std::vector<std::uint32_t> first(batch_capacity), second(batch_capacity);
  for (std::uint32_t i = 0; i < batch_capacity; ++i) {
    edges[2 * i] = {4 * i, 4 * i + 1};
    edges[2 * i + 1] = {4 * i + 2, 4 * i + 3};
    faces[i] = {4 * i + 1, 4 * i + 2, 4 * i + 3};
    first[i] = kind == Kind::vertex_face ? 4 * i : 2 * i;
    second[i] = kind == Kind::vertex_face ? i : 2 * i + 1;
  }
  const Geometry geometry{rows.data(), edges.data(), faces.data(), nullptr, rounded.data(), {separation}};
  for (std::size_t begin = 0; begin < queries.size(); begin += batch_capacity) {
    const auto n = static_cast<std::uint32_t>(std::min<std::size_t>(queries.size() - begin, batch_capacity));
    for (std::uint32_t i = 0; i < n; ++i) {
      const Query& q = queries[begin + i];
      const CoordinateMap map = rounds ? map_of(q) : CoordinateMap();
      for (int row = 0; row < 4; ++row)
        for (int k = 0; k < 3; ++k) {
          const double x0 = rows[4 * i + row].t0[k] = q[3 * row + k];
          const double x1 = rows[4 * i + row].t1[k] = q[12 + 3 * row + k];
          if (rounds) rounded[4 * i + row].t0[k] = map(x0, k), rounded[4 * i + row].t1[k] = map(x1, k);
        }
    }
    test(geometry, kind, first.data(), second.data(), n, *result);
    std::fill_n(hit + begin, n, false);
    std::fill_n(toc + begin, n, std::numeric_limits<double>::infinity());
    for (std::uint32_t i = 0; i < result->n_contacts; ++i) {
      const std::size_t at = begin + result->contact[i];
      hit[at] = true;
      toc[at] = reported_time(accuracy, result->toc[i], result->delta[i]);
    }
    for (std::uint32_t i = 0; i < result->n_undecided; ++i) {
      const std::size_t at = begin + result->undecided[i];
      const Query& q = queries[at];
      const UndecidedPair pair{kind,
                               {point(q, 0), point(q, 1), point(q, 2), point(q, 3)},
                               {point(q, 4), point(q, 5), point(q, 6), point(q, 7)},
                               separation};
      if (const auto t = fallback(accuracy, pair, counts)) hit[at] = true, toc[at] = *t;
    }
  }
}

}  // namespace
}  // namespace hpccd

// Outside of the namespace: inside, a declaration of the inline namespace would be declared again.
void hpccd::test_vertex_face(std::span<const Query> queries, const Options& options, bool* hit, double* toc) {
  test_queries(Kind::vertex_face, queries, options, hit, toc);
}

void hpccd::test_edge_edge(std::span<const Query> queries, const Options& options, bool* hit, double* toc) {
  test_queries(Kind::edge_edge, queries, options, hit, toc);
}
