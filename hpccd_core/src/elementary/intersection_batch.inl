// SPDX-License-Identifier: Apache-2.0
// Included once per instruction set, after its header (base/simd/scalar.h), under the rules of batch.inl.

#include "elementary/intersection_batch.h"
#include "elementary/intersection_filter.h"

namespace hpccd::HPCCD_ISA {
namespace {

#include "elementary/lane_groups.inl"

struct EdgeFacePairs {
  static constexpr int width = double_width;
  HPCCD_HD static EdgeFace<Double> load(const Geometry& g, const std::uint32_t* edge, const std::uint32_t* face) {
    const double* at[5][width];
    for (int lane = 0; lane < width; ++lane) {
      std::uint32_t v[5];
      edge_face_vertices(g, edge[lane], face[lane], v);
      for (int i = 0; i < 5; ++i) at[i][lane] = g.vertices[v[i]].t0;
    }
    const PointRows from = point_rows(at[2]);
    const auto span = [&](int to) { return transposed(difference(point_rows(at[to]), from)); };
    return {span(0), span(1), span(3), span(4)};
  }
};

}  // namespace

void intersection_batch(const Geometry& g, const std::uint32_t* edge, const std::uint32_t* face, std::uint32_t n,
                        BatchResult& result) {
  using Lanes = const EdgeFace<Double>&;
  std::uint32_t open[batch_capacity];
  std::uint32_t n_open = 0, n_outside = 0;
  result.n_contacts = result.n_undecided = 0;
  for_groups<EdgeFacePairs>(g, edge, face, nullptr, n, [&](Lanes q, const std::uint32_t* at, unsigned valid) {
    const Verdict<Double> v = volume_test(q);
    const unsigned yes = bits(v.yes) & valid, no = bits(v.no) & valid;
    append(result.contact, result.n_contacts, at, yes);
    append(open, n_open, at, valid & ~yes & ~no);
    n_outside += static_cast<unsigned>(__builtin_popcount(no));
  });
  for_groups<EdgeFacePairs>(g, edge, face, open, n_open, [&](Lanes q, const std::uint32_t* at, unsigned valid) {
    append(result.undecided, result.n_undecided, at, valid & ~bits(certainly_apart_in_projection(q)));
  });
  result.counts.tested += n;
  result.counts.coplanarity += n_outside;
  result.counts.projection += n_open - result.n_undecided;
  result.counts.contacts += result.n_contacts;
  result.counts.undecided += result.n_undecided;
}

}  // namespace hpccd::HPCCD_ISA
